"""What a relaxed arm needs in the therapy robot: weight, inertia and passive stiffness.

Examples:
  armimpedance simulate therapy --subject S1 --out session        something to try it on
  armimpedance arm session --robot robot.json --out arm.json
  armimpedance arm session --robot robot.json --mass-kg 72 --forearm-m 0.26 --hand-m 0.19
  armimpedance simulate therapy-mockup --out pipes
  armimpedance arm pipes --robot robot.json --pipe 1.8,0.32,0.10 --pipe 1.7,0.30,0.09

Masses come from Winter's table, lengths and body mass from the recording's subject or the options;
k_s and q_0 (Guidali, 21) from the trials of the condition "passive", three or more of a movement.
Intervals count that the table's masses are some per cent off (--mass-sd-percent) and what is not
known of the robot. An axis whose repetitions do not agree is not identified, and said so.
--pipe is a mock-up instead of a person: mass (kg), length, diameter (m), the upper arm first.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from armimpedance.contribution.arm import ArmSegment
    from armimpedance.contribution.robot import TherapyRobot
    from armimpedance.records import Recording


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("recording", metavar="RECORDING", type=Path)
    parser.add_argument("--robot", type=Path, required=True, metavar="ROBOT.json")
    parser.add_argument("--out", type=Path, metavar="ARM.json")
    parser.add_argument("--mass-kg", type=float, metavar="KG", help="of the body")
    for name, what in (
        ("upper-arm", "shoulder to elbow"),
        ("forearm", "elbow to wrist"),
        ("hand", "wrist to finger tip"),
    ):
        parser.add_argument(f"--{name}-m", type=float, metavar="M", help=what)
    parser.add_argument(
        "--point-masses", action="store_true", help="as the source: no inertia of their own"
    )
    parser.add_argument(
        "--mass-sd-percent",
        type=float,
        metavar="PERCENT",
        help="by which a person's masses depart from the table (default: 3; pipes: 0)",
    )
    parser.add_argument(
        "--pipe",
        action="append",
        metavar="KG,M,M",
        help="a mock-up's upper arm, then its forearm: mass, length, diameter",
    )
    parser.add_argument("--figure", type=Path, metavar="PATH.png", help="draw torques and model")


def run(arguments: argparse.Namespace) -> int:
    """Read, fit, print, write."""
    from armimpedance.cli.checks import check_outputs, naming
    from armimpedance.cli.joint_input import read_joint
    from armimpedance.report.therapy_json import read_robot

    check_outputs(figure=arguments.figure, out=arguments.out)
    robot = read_robot(arguments.robot)
    recording = read_joint(arguments.recording)
    with naming(arguments.recording):
        if arguments.pipe:
            return _mock_up(recording, robot, arguments)
        return _person(recording, robot, arguments)


def _person(recording: Recording, robot: TherapyRobot, arguments: argparse.Namespace) -> int:
    from armimpedance.contribution.arm import MASS_SD
    from armimpedance.contribution.passive_arm import identify_arm
    from armimpedance.contribution.person import segments_of, upper_arm_length
    from armimpedance.report.therapy_json import write_arm
    from armimpedance.report.therapy_text import arm_object, arm_text

    subject = recording.subject
    segments = segments_of(
        subject,
        mass_kg=arguments.mass_kg,
        upper_arm_m=arguments.upper_arm_m,
        forearm_m=arguments.forearm_m,
        hand_m=arguments.hand_m,
        point_masses=arguments.point_masses,
    )
    spread = arguments.mass_sd_percent
    calibration = identify_arm(
        recording,
        robot,
        segments,
        upper_arm_m=upper_arm_length(subject, arguments.upper_arm_m),
        mass_sd=MASS_SD if spread is None else spread / 100,
    )
    print(arm_text(calibration))
    if arguments.out is not None:
        write_arm(calibration.arm, arguments.out, calibration.summary, **arm_object(calibration))
        print(f"\narm of subject {subject.id} written to {arguments.out}")
    if arguments.figure is not None:
        from armimpedance.plots.contribution import plot_passive_arm
        from armimpedance.plots.style import save

        save(
            plot_passive_arm(calibration),
            arguments.figure.with_suffix(""),
            (arguments.figure.suffix[1:],),
        )
    return 0


def _mock_up(recording: Recording, robot: TherapyRobot, arguments: argparse.Namespace) -> int:
    from armimpedance.contribution.mockup import check_mockup
    from armimpedance.errors import InputError
    from armimpedance.report.therapy_text import mockup_text

    if arguments.out is not None:
        raise InputError("--out with --pipe", expected="a person: a mock-up has no ARM.json")
    segments = pipes(arguments.pipe)
    print(mockup_text(check_mockup(recording, robot, segments)))
    return 0


def pipes(given: list[str]) -> tuple[ArmSegment, ...]:
    """Two pipes, the upper arm first, of ``--pipe KG,M,M``.

    Raises
    ------
    InputError
        Not two pipes of three numbers each.
    """
    from armimpedance.contribution.mockup import pipe
    from armimpedance.contribution.robot import FOREARM, UPPER_ARM
    from armimpedance.errors import InputError

    words = [word.split(",") for word in given]
    try:
        numbers = [[float(part) for part in parts] for parts in words]
    except ValueError:
        numbers = []
    if len(numbers) != 2 or any(len(n) != 3 or not min(n) > 0 for n in numbers):
        raise InputError(
            f"--pipe {' --pipe '.join(given)}",
            expected="two of them: mass in kg, length and diameter in m, such as 1.8,0.32,0.10",
        )
    upper, fore = numbers
    return pipe("upper_pipe", UPPER_ARM, *upper), pipe("lower_pipe", FOREARM, *fore)
