"""Stiffness, viscosity and friction of relaxed joints, from markers, joint motion or torque.

Examples:
  armimpedance simulate p5 --out relaxed                  something to try it on
  armimpedance passive relaxed --rest-angle 1.5 --out fit.json
  armimpedance passive relaxed --rest-angle free --mass-sd-percent 3 --out fit.json
  armimpedance passive arm --joint right_elbow_flexion --joint right_wrist_flexion \\
      --rest-angle right_elbow_flexion=1.5 --rest-angle right_wrist_flexion=0 --out fit.json

k (q - q_r) + h qd + f sign(qd) [+ K (q - q_r)^2] is fitted to the passive torque, after Venture.
The recording is a folder of kind "markers" or "motion" with its skeleton.json (the passive torque
is minus that of inertia and gravity), or of kind "joint" whose torque columns hold the passive
torque or its opposite.
Where the rest angle is not known it is fitted (free), which may widen the interval of k several
times; where the data contradict a given one, a warning says where they put it.
k, h and f are proportional to the limb's mass, which no free swing shows: --mass-sd-percent says
how well it is known, and their intervals count it.
Trials are left out in turn and predicted from the others; --validate predicts another recording.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Final

from armimpedance.show.command.options import add_despite
from armimpedance.show.command.outputs import (
    FIGURE,
    TABLE,
    Output,
    add_figure,
    add_out,
    check_long,
    check_outputs,
    write_result,
)

if TYPE_CHECKING:
    from armimpedance.joint.relaxed.equations import RestAngle


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    from armimpedance.joint.relaxed.methods import METHODS

    parser.add_argument("recording", metavar="RECORDING", type=Path)
    add_out(
        parser,
        "all that is known of the parameters (FIT.json), or a row a parameter",
        TABLE,
        long=True,
    )
    add_figure(parser, "torque and its prediction")
    add_despite(parser)
    _configure_model(parser, METHODS.listed())
    _configure_reading(parser)


def _configure_model(parser: argparse.ArgumentParser, methods: str) -> None:
    parser.add_argument("--validate", type=Path, metavar="RECORDING", help="predict its torque too")
    parser.add_argument(
        "--rest-angle",
        action="append",
        metavar="RAD|free|JOINT=RAD",
        help="where the elastic torque vanishes: once for all joints, or once per joint (default: "
        "free, that is fitted)",
    )
    parser.add_argument(
        "--method",
        metavar="NAME",
        help=f"{methods}; output-error fits the measured swing itself, parallel takes "
        "every term through the filter, ls is the source's with its unfiltered sign",
    )
    parser.add_argument(
        "--joint",
        action="append",
        metavar="NAME",
        help="an angle of the skeleton (default: its only elbow); may be given again",
    )
    parser.add_argument("--quadratic", action="store_true", help="fit K (q - q_r)^2 too")
    parser.add_argument(
        "--without-friction", action="store_true", help="the joint is known to have f = 0"
    )
    parser.add_argument(
        "--mass-sd-percent",
        type=float,
        metavar="PERCENT",
        help="how well the limb's mass is known, to which k, h, f are proportional; 0: weighed "
        "(default: the subject's mass_sd_kg, else what tables differ by, 7.5)",
    )


def _configure_reading(parser: argparse.ArgumentParser) -> None:
    """How the recording becomes angle and torque."""
    parser.add_argument(
        "--cutoff-hz",
        default="8",
        metavar="HZ|none",
        help="cut-off of the zero-phase low-pass (default: 8; a joint that swings at 5 Hz needs "
        "15)",
    )
    parser.add_argument(
        "--emg-gate",
        default="3",
        metavar="PERCENT|off",
        help="a muscle above this part of its maximum is not relaxed (default: 3)",
    )
    parser.add_argument(
        "--torque-sign",
        type=int,
        choices=(1, -1),
        help="kind joint: 1 passive torque, -1 torque of the limb on the device (default: "
        "detected)",
    )
    parser.add_argument(
        "--longest-gap-s",
        type=float,
        metavar="S",
        help="longest loss of a marker to bridge (default: 0.2)",
    )


_CAPTION: Final = (
    "Torque of each relaxed joint over time: measured, and as its stiffness, viscosity and "
    "friction (method {}) make it of the joint's motion."
)


def _unless(word: str, given: str, option: str, expected: str) -> float | None:
    """The number of an option; None where it is this word."""
    from armimpedance.show.command.outputs import number

    return None if given == word else number(given, option, expected)


def run(arguments: argparse.Namespace) -> int:
    """Fit, write, print."""
    from armimpedance.joint.relaxed.show.plot import plot_passive_fits
    from armimpedance.joint.relaxed.show.text import passive_text
    from armimpedance.joint.relaxed.show.verb import passive
    from armimpedance.show.command.options import draw_picture
    from armimpedance.show.command.screen import bar

    out, figure, gate = arguments.out, arguments.figure, arguments.emg_gate
    check_outputs(
        Output("--out", out, TABLE),
        Output("--figure", figure, FIGURE),
        reads=[arguments.recording, arguments.validate],
    )
    check_long(arguments)
    cutoff = arguments.cutoff_hz
    with bar("passive joints") as progress:
        fits = passive(
            arguments.recording,
            rest_angle=rest_angles(arguments.rest_angle or ["free"]),
            method=arguments.method,
            quadratic=arguments.quadratic,
            friction=not arguments.without_friction,
            mass_sd_percent=arguments.mass_sd_percent,
            joints=arguments.joint,
            cutoff_hz=_unless("none", cutoff, "--cutoff-hz", "more than 0 Hz, or none"),
            emg_gate_percent=_unless("off", gate, "--emg-gate", "% of the maximum, or off"),
            torque_sign=arguments.torque_sign,
            longest_gap_s=arguments.longest_gap_s,
            validate=arguments.validate,
            despite=arguments.despite,
            progress=progress,
        )
    write_result(fits.content, arguments)
    print(passive_text(fits))
    draw_picture(arguments, lambda: plot_passive_fits(fits), _CAPTION.format(fits[0].method))
    return 0


def rest_angles(words: list[str]) -> RestAngle | dict[str, RestAngle]:
    """One rest angle for all joints, or one each; a joint that is not named is free.

    Raises InputError: not an angle, one joint twice, or one angle for all beside one for a joint.
    """
    from armimpedance.core.errors import InputError

    named = {w.split("=", 1)[0]: _angle(w) for w in words if "=" in w}
    if len(words) == 1 and not named:
        return _angle(words[0])
    if len(named) != len(words):
        raise InputError(
            f"--rest-angle {' '.join(words)}", expected="one angle for all joints, or one each"
        )
    return named


def _angle(word: str) -> RestAngle:
    """The angle in ``0.3``, ``free`` or ``elbow=0.3``."""
    from armimpedance.core.errors import InputError

    text = word.split("=", 1)[-1]
    try:
        value = float("nan" if text == "free" else text)
    except ValueError:
        value = float("nan")
    if value != value and text != "free":
        raise InputError(f"--rest-angle {word}", expected="radians, or free")
    return "free" if text == "free" else value
