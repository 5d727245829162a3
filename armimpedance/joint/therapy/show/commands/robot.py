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

from armimpedance.show.command.outputs import (
    FIGURE,
    FIT,
    Output,
    add_figure,
    add_out,
    check_outputs,
)
from armimpedance.show.verbs.options import DESPITE


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
    add_out(parser, "the robot for the next steps", FIT)
    parser.add_argument(
        "--validate", type=Path, metavar="RECORDING", help="of other movements: predict its torques"
    )
    add_figure(parser, "friction and spring")
    DESPITE.add(parser)


def run(arguments: argparse.Namespace) -> int:
    """Read, fit, write, print."""
    from armimpedance.joint.therapy.show.models_json import write_robot
    from armimpedance.joint.therapy.show.plots import plot_robot_calibration
    from armimpedance.joint.therapy.show.text import robot_text
    from armimpedance.joint.therapy.show.verb import calibrate_robot
    from armimpedance.show.command.options import draw_picture
    from armimpedance.show.command.screen import bar

    out, figure = arguments.out, arguments.figure
    check_outputs(
        Output("--out", out, FIT),
        Output("--figure", figure, FIGURE),
        reads=(arguments.recording, arguments.drawings, arguments.validate),
    )
    with bar("identifying") as progress:
        calibration = calibrate_robot(
            arguments.recording,
            arguments.drawings,
            validate=arguments.validate,
            despite=arguments.despite,
            progress=progress,
        )
    if out is not None:
        write_robot(calibration, out)
    print(robot_text(calibration))
    if out is not None:
        print(f"\nrobot {calibration.robot.name} written to {out}")
    draw_picture(
        arguments,
        lambda: plot_robot_calibration(calibration),
        "Friction of each axis over its speed and the torque of its spring over its angle: "
        "measured, and as the robot's model makes them.",
    )
    return 0
