"""Friction, cables and counterbalance spring of a therapy robot, from sweeps and holds.

Examples:
  armimpedance simulate therapy-calibration --out calibration     something to try it on
  armimpedance robot calibration --drawings calibration/drawings.json --out robot.json
  armimpedance simulate therapy-validation --seed 1 --out moving
  armimpedance robot calibration --drawings calibration/drawings.json --validate moving

The recording is of kind "joint", the robot empty, with the motors' torques ("torque": "commanded").
Its trial table has the columns axis (from 1), onset_s, end_s and, in the condition "sweep", a
constant velocity both ways at several speeds; in the condition "hold", axis 1 held still at several
angles, each reached from below and from above (column approach: 1 or -1).
The drawings are a ROBOT.json without loads: axes, links with their masses, rotors, limits.
--validate predicts a recording of other movements: rms and R^2 per axis, Guidali (16)-(17).
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("recording", metavar="RECORDING", type=Path)
    parser.add_argument("--drawings", type=Path, required=True, metavar="DRAWINGS.json")
    parser.add_argument("--out", type=Path, metavar="ROBOT.json")
    parser.add_argument("--validate", type=Path, metavar="RECORDING", help="predict its torques")
    parser.add_argument("--figure", type=Path, metavar="PATH.png", help="draw friction and spring")


def run(arguments: argparse.Namespace) -> int:
    """Read, fit, print, write."""
    from armimpedance.cli.checks import check_outputs, naming
    from armimpedance.cli.joint_input import read_joint
    from armimpedance.contribution.calibrate import identify_robot
    from armimpedance.contribution.robot_validation import validate_robot
    from armimpedance.report.therapy_json import read_robot, write_robot
    from armimpedance.report.therapy_text import robot_object, robot_text

    check_outputs(figure=arguments.figure, out=arguments.out)
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
        from armimpedance.plots.contribution import plot_robot_calibration
        from armimpedance.plots.style import save

        figure = plot_robot_calibration(calibration)
        save(figure, arguments.figure.with_suffix(""), (arguments.figure.suffix[1:],))
    return 0
