"""What a relaxed arm needs in the therapy robot: weight, inertia and passive stiffness.

Examples:
  armimpedance simulate therapy --subject S1 --out session        something to try it on
  armimpedance therapy arm session --robot robot.json --out arm.json
  armimpedance therapy arm session --robot robot.json --mass-kg 72 --forearm-m 0.26 --hand-m 0.19
  armimpedance simulate therapy-mockup --out pipes
  armimpedance therapy arm pipes --robot robot.json --pipe 1.8,0.32,0.10 --pipe 1.7,0.30,0.09

The robot moves the relaxed arm: trials of the condition "passive" (or --condition), three or more
of a movement.
They give the stiffness k_s and rest angle q_0 of each axis, Guidali (21). Its masses come from
Winter's table; body mass and lengths are those of the recording's subject, or the options.
Intervals count the scatter of the repetitions, that the table's masses are some per cent off
(--mass-sd-percent), what is not known of the robot and, where an axis was moved one way only, that
the arm may resist its speed. Where repetitions do not agree, the axis has no model: the command
says so, and `therapy contribution` leaves it out. A muscle that was active (--emg-gate) refuses.
--pipe checks the robot with a mock-up of two weighed pipes instead of a person: mass (kg), length,
diameter (m), the upper arm first. It prints what the robot measures beside what they weigh.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Final

from armimpedance.core.errors import InputError
from armimpedance.show.command.options import add_choice
from armimpedance.show.command.outputs import (
    FIGURE,
    FIT,
    Output,
    add_figure,
    add_out,
    check_outputs,
)
from armimpedance.show.verbs.options import DESPITE

_OF_A_PERSON: Final = "a person: a mock-up was weighed and has no ARM.json"
_PASSIVE: Final = "passive"


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("recording", metavar="RECORDING", type=Path)
    parser.add_argument(
        "--robot",
        type=Path,
        required=True,
        metavar="ROBOT.json",
        help="as `armimpedance therapy robot` wrote it",
    )
    add_out(parser, "the arm for `therapy contribution`", FIT)
    parser.add_argument(
        "--condition", metavar="NAME", help=f"trials of this condition only (default: {_PASSIVE})"
    )
    _configure_person(parser)
    add_figure(parser, "passive torques and their model")
    DESPITE.add(parser)
    add_choice(parser, "recording")


def _configure_person(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--mass-kg", type=float, metavar="KG", help="mass of the whole body")
    for name, what in (
        ("upper-arm", "shoulder to elbow"),
        ("forearm", "elbow to wrist"),
        ("hand", "wrist to finger tip"),
    ):
        parser.add_argument(f"--{name}-m", type=float, metavar="M", help=what)
    parser.add_argument(
        "--point-masses", action="store_true", help="no inertia of their own, as in the source"
    )
    parser.add_argument(
        "--mass-sd-percent",
        type=float,
        metavar="PERCENT",
        help="sd of a person's masses about the table (default: 3); goes into the intervals",
    )
    parser.add_argument(
        "--emg-gate",
        metavar="PERCENT|off",
        help="a muscle above this part of its maximum is not relaxed (default: 3)",
    )
    parser.add_argument(
        "--pipe",
        action="append",
        metavar="KG,M,M",
        help="twice: a mock-up's upper arm, then its forearm; mass, length, diameter",
    )


def run(arguments: argparse.Namespace) -> int:
    """Read, fit, write, print."""
    check_outputs(
        Output("--out", arguments.out, FIT),
        Output("--figure", arguments.figure, FIGURE),
        reads=(arguments.recording, arguments.robot),
    )
    if arguments.pipe:
        return _mock_up(arguments)
    return _person(arguments)


def _person(arguments: argparse.Namespace) -> int:
    from armimpedance.joint.therapy.show.models_json import write_arm
    from armimpedance.joint.therapy.show.plots import plot_passive_arm
    from armimpedance.joint.therapy.show.text import arm_text
    from armimpedance.joint.therapy.show.verb import calibrate_arm
    from armimpedance.show.command.options import draw_picture
    from armimpedance.show.command.screen import bar

    out = arguments.out
    body = ("mass_kg", "upper_arm_m", "forearm_m", "hand_m", "point_masses")
    options = {name: getattr(arguments, name) for name in body}
    options |= _mass_sd(arguments) | _gate(arguments)
    with bar("calibrating") as progress:
        calibration = calibrate_arm(
            arguments.recording,
            arguments.robot,
            condition=arguments.condition or _PASSIVE,
            despite=arguments.despite,
            progress=progress,
            **options,
        )
    if out is not None:
        write_arm(calibration, out)
    print(arm_text(calibration))
    if out is not None:
        print(f"\narm of subject {calibration.arm.subject} written to {out}")
    draw_picture(
        arguments,
        lambda: plot_passive_arm(calibration),
        "Torque of each axis that the relaxed arm adds to the robot's own, over its angle: "
        "measured, and as the model makes it.",
    )
    return 0


def _mass_sd(arguments: argparse.Namespace) -> dict[str, float]:
    """The option as a fraction; empty without the option."""
    percent = arguments.mass_sd_percent
    if percent is None:
        return {}
    if not 0 <= percent < 50:
        raise InputError(f"--mass-sd-percent {percent:g}", expected="0 or more, less than 50")
    return {"mass_sd": float(percent) / 100}


def _gate(arguments: argparse.Namespace) -> dict[str, float | None]:
    """The option as a number, or None for off; empty without the option."""
    from armimpedance.show.command.outputs import number

    gate = arguments.emg_gate
    if gate is None:
        return {}
    off = gate == "off"
    return {
        "emg_gate_percent": None if off else number(gate, "--emg-gate", "% of the maximum, or off")
    }


def _mock_up(arguments: argparse.Namespace) -> int:
    from armimpedance.joint.therapy.show.text import mockup_text
    from armimpedance.joint.therapy.show.verb import check_mockup
    from armimpedance.show.command.screen import bar

    persons = ("out", "figure", "mass_kg", "forearm_m", "hand_m", "mass_sd_percent", "emg_gate")
    for name in persons:
        if getattr(arguments, name) is not None:
            raise InputError(f"--{name.replace('_', '-')} with --pipe", expected=_OF_A_PERSON)
    if arguments.point_masses:
        raise InputError("--point-masses with --pipe", expected=_OF_A_PERSON)
    upper, lower = tubes(arguments.pipe)
    with bar("measuring") as progress:
        check = check_mockup(
            arguments.recording,
            arguments.robot,
            upper_pipe=upper,
            lower_pipe=lower,
            upper_arm_m=arguments.upper_arm_m,
            condition=arguments.condition,
            progress=progress,
        )
    print(mockup_text(check))
    return 0


def tubes(options: list[str]) -> list[tuple[float, float, float]]:
    """Mass, length and diameter of two pipes from ``--pipe KG,M,M``, the upper arm first.

    Raises InputError: not two pipes of three numbers each.
    """
    try:
        numbers = [tuple(float(part) for part in word.split(",")) for word in options]
    except ValueError:
        numbers = []
    if len(numbers) != 2 or any(
        len(n) != 3 or not all(0 < part < float("inf") for part in n) for n in numbers
    ):
        raise InputError(
            f"--pipe {' --pipe '.join(options)}",
            expected="--pipe twice, each with a mass in kg, a length and a diameter in m, such as "
            "1.8,0.32,0.10",
        )
    return [(mass, length, diameter) for mass, length, diameter in numbers]
