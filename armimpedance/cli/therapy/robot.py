"""Friction, cables and counterbalance spring of a therapy robot, from sweeps and holds.

Examples:
  armimpedance simulate therapy-calibration --out calibration     something to try it on
  armimpedance therapy robot calibration --drawings calibration/drawings.json --out robot.json
  armimpedance simulate therapy-validation --seed 1 --out moving
  armimpedance therapy robot calibration --drawings calibration/drawings.json --validate moving

The recording is of kind "joint", the robot empty, with the motors' torques ("torque": "commanded").
Each trial is a sweep or a hold; its table says so in the column condition, and has the columns axis
(from 1), onset_s and end_s (of the steady part).
  sweep  one axis at a constant velocity; every axis at three or more speeds, both ways
  hold   axis 1 still; at four or more angles, each reached from below and from above (column
         approach: 1 or -1), since a held axis sticks
The drawings are a ROBOT.json without loads: axes, links with their masses, rotors, limits.
--validate predicts the torques of a recording of other movements of the empty robot: rms and R^2 of
each axis, Guidali (16)-(17).
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("recording", metavar="RECORDING", type=Path)
    parser.add_argument(
        "--drawings",
        type=Path,
        required=True,
        metavar="DRAWINGS.json",
        help="what is known of the robot before",
    )
    parser.add_argument("--out", type=Path, metavar="ROBOT.json", help="for the next steps")
    parser.add_argument(
        "--validate", type=Path, metavar="RECORDING", help="of other movements: predict its torques"
    )
    parser.add_argument("--figure", type=Path, metavar="PATH.png", help="draw friction and spring")


def run(arguments: argparse.Namespace) -> int:
    """Read, fit, print, write."""
    from armimpedance.cli.parts.checks import check_outputs, naming, refuse_same_file
    from armimpedance.cli.parts.joint_input import read_joint
    from armimpedance.files import read_robot, write_robot
    from armimpedance.report import robot_object, robot_text
    from armimpedance.therapy import identify_robot, validate_robot

    check_outputs(figure=arguments.figure, out=arguments.out)
    refuse_same_file({"drawings": arguments.drawings}, out=arguments.out)
    drawings = read_robot(arguments.drawings)
    recording = read_joint(arguments.recording)
    with naming(arguments.recording):
        calibration = identify_robot(recording, drawings)
    validation: Any = ()
    if arguments.validate is not None:
        other = read_joint(arguments.validate)
        with naming(arguments.validate):
            validation = validate_robot(other, calibration.robot)
    print(robot_text(calibration, validation))
    if arguments.out is not None:
        more = robot_object(calibration, validation)
        write_robot(calibration.robot, arguments.out, calibration.summary, **more)
        print(f"\nrobot {calibration.robot.name} written to {arguments.out}")
    if arguments.figure is not None:
        from armimpedance.plots import plot_robot_calibration, save

        figure = plot_robot_calibration(calibration)
        save(figure, arguments.figure.with_suffix(""), (arguments.figure.suffix[1:],))
    return 0
