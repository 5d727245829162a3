"""What a relaxed arm needs in the therapy robot: weight, inertia and passive stiffness.

Examples:
  armimpedance simulate therapy --subject S1 --out session        something to try it on
  armimpedance therapy arm session --robot robot.json --out arm.json
  armimpedance therapy arm session --robot robot.json --mass-kg 72 --forearm-m 0.26 --hand-m 0.19
  armimpedance simulate therapy-mockup --out pipes
  armimpedance therapy arm pipes --robot robot.json --pipe 1.8,0.32,0.10 --pipe 1.7,0.30,0.09

The robot moves the relaxed arm: trials of the condition "passive", three or more of a movement.
They give the stiffness k_s and rest angle q_0 of each axis, Guidali (21). Its masses come from
Winter's table; body mass and lengths are those of the recording's subject, or the options.
Intervals count the scatter of the repetitions, that the table's masses are some per cent off
(--mass-sd-percent), and what is not known of the robot. Where repetitions do not agree, the axis
has no model: the command says so, and `therapy contribution` leaves it out.
--pipe checks the robot with a mock-up of two weighed pipes instead of a person: mass (kg), length,
diameter (m), the upper arm first. It prints what the robot measures beside what they weigh.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from armimpedance.records import Recording, Subject
    from armimpedance.therapy import ArmSegment, TherapyRobot

_OF_A_PERSON: Final = "a person: a mock-up was weighed and has no ARM.json"
#: What a person's arm needs, and where the recording may say it.
_WANTED: Final = {
    "mass_kg": ("the body mass", "subject.mass_kg"),
    "upper_arm_m": ("the upper arm's length", "subject.upper_arm_m or height_m"),
    "forearm_m": ("the forearm's length", "subject.forearm_hand_m or height_m"),
    "hand_m": ("the hand's length", "subject.forearm_hand_m or height_m"),
}


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
    parser.add_argument("--out", type=Path, metavar="ARM.json", help="for `therapy contribution`")
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
        "--pipe",
        action="append",
        metavar="KG,M,M",
        help="twice: a mock-up's upper arm, then its forearm; mass, length, diameter",
    )
    parser.add_argument(
        "--figure", type=Path, metavar="PATH.png", help="draw passive torques and their model"
    )


def run(arguments: argparse.Namespace) -> int:
    """Read, fit, print, write."""
    from armimpedance.cli.parts.checks import check_outputs, naming, refuse_same_file
    from armimpedance.cli.parts.joint_input import read_joint
    from armimpedance.files import read_robot

    check_outputs(figure=arguments.figure, out=arguments.out)
    refuse_same_file({"robot": arguments.robot}, out=arguments.out)
    mass_sd, tubes = _mass_sd(arguments), _mock_up_of(arguments)
    robot = read_robot(arguments.robot)
    with naming(arguments.robot):
        robot.identified  # noqa: B018 - the file at fault is the robot's
    recording = read_joint(arguments.recording)
    with naming(arguments.recording):
        if tubes:
            return _mock_up(recording, robot, tubes, arguments)
        return _person(recording, robot, mass_sd, arguments)


def _mass_sd(arguments: argparse.Namespace) -> float:
    from armimpedance.errors import InputError
    from armimpedance.therapy import MASS_SD

    percent = arguments.mass_sd_percent
    if percent is None:
        return MASS_SD
    if not 0 <= percent < 50:
        raise InputError(f"--mass-sd-percent {percent:g}", expected="0 or more, less than 50")
    return float(percent) / 100


def _mock_up_of(arguments: argparse.Namespace) -> tuple[ArmSegment, ...]:
    """The pipes of a mock-up; none for a person."""
    from armimpedance.errors import InputError

    if not arguments.pipe:
        return ()
    for name in ("out", "figure", "mass_kg", "forearm_m", "hand_m", "mass_sd_percent"):
        if getattr(arguments, name) is not None:
            raise InputError(f"--{name.replace('_', '-')} with --pipe", expected=_OF_A_PERSON)
    if arguments.point_masses:
        raise InputError("--point-masses with --pipe", expected=_OF_A_PERSON)
    return pipes(arguments.pipe)


def _person(
    recording: Recording, robot: TherapyRobot, mass_sd: float, arguments: argparse.Namespace
) -> int:
    from armimpedance.files import write_arm
    from armimpedance.report import arm_object, arm_text
    from armimpedance.therapy import identify_arm, segments_of, upper_arm_length

    subject = recording.subject
    _refuse_unknown(subject, arguments)
    segments = segments_of(
        subject,
        mass_kg=arguments.mass_kg,
        upper_arm_m=arguments.upper_arm_m,
        forearm_m=arguments.forearm_m,
        hand_m=arguments.hand_m,
        point_masses=arguments.point_masses,
    )
    calibration = identify_arm(
        recording,
        robot,
        segments,
        upper_arm_m=upper_arm_length(subject, arguments.upper_arm_m),
        mass_sd=mass_sd,
    )
    print(arm_text(calibration))
    if arguments.out is not None:
        write_arm(calibration.arm, arguments.out, calibration.summary, **arm_object(calibration))
        print(f"\narm of subject {subject.id} written to {arguments.out}")
    if arguments.figure is not None:
        from armimpedance.plots import plot_passive_arm, save

        save(
            plot_passive_arm(calibration),
            arguments.figure.with_suffix(""),
            (arguments.figure.suffix[1:],),
        )
    return 0


def _refuse_unknown(subject: Subject, arguments: argparse.Namespace) -> None:
    """Say with which option a mass or length can be given that the recording does not have."""
    from armimpedance.errors import InputError

    tall, beyond = subject.height_m is not None, subject.forearm_hand_m is not None
    for name, known in (
        ("mass_kg", subject.mass_kg is not None),
        ("upper_arm_m", subject.upper_arm_m is not None or tall),
        ("forearm_m", beyond or tall),
        ("hand_m", beyond or tall),
    ):
        if not known and getattr(arguments, name) is None:
            what, where = _WANTED[name]
            raise InputError(
                f"subject {subject.id}: {what} is not known",
                expected=f"{where} in recording.json, or --{name.replace('_', '-')}",
            )


def _mock_up(
    recording: Recording,
    robot: TherapyRobot,
    tubes: tuple[ArmSegment, ...],
    arguments: argparse.Namespace,
) -> int:
    from armimpedance.report import mockup_text
    from armimpedance.therapy import check_mockup

    check = check_mockup(recording, robot, tubes, upper_arm_m=arguments.upper_arm_m)
    print(mockup_text(check))
    return 0


def pipes(given: list[str]) -> tuple[ArmSegment, ...]:
    """Two pipes, the upper arm first, of ``--pipe KG,M,M``.

    Raises
    ------
    InputError
        Not two pipes of three numbers each.
    """
    from armimpedance.errors import InputError
    from armimpedance.therapy import FOREARM, UPPER_ARM, pipe

    words = [word.split(",") for word in given]
    try:
        numbers = [[float(part) for part in parts] for parts in words]
    except ValueError:
        numbers = []
    if len(numbers) != 2 or any(
        len(n) != 3 or not all(0 < part < float("inf") for part in n) for n in numbers
    ):
        raise InputError(
            f"--pipe {' --pipe '.join(given)}",
            expected="--pipe twice, each with a mass in kg, a length and a diameter in m, such as "
            "1.8,0.32,0.10",
        )
    upper, fore = numbers
    return pipe("upper_pipe", UPPER_ARM, *upper), pipe("lower_pipe", FOREARM, *fore)
