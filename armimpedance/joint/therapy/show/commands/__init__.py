"""A patient's contribution to a movement with a therapy robot, in three steps (Guidali 2013).

Examples:
  armimpedance therapy robot calibration --drawings drawings.json --out robot.json
  armimpedance therapy arm session --robot robot.json --out arm.json
  armimpedance therapy contribution session --robot robot.json --arm arm.json --out result.csv

`armimpedance therapy robot --help` and its sisters say what each step reads and writes.
"""

from __future__ import annotations

import argparse

#: Step -> its line in the overview; the module with its name in this folder has the command.
STEPS = {
    "robot": "the robot's friction, cables and spring, from sweeps and holds",
    "arm": "what a relaxed arm needs in the robot: weight, inertia, stiffness",
    "contribution": "how much of a movement is the patient's own",
}


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command: one subcommand per step."""
    from armimpedance.show.command.options import add_commands

    add_commands(parser, STEPS, "armimpedance.joint.therapy.show.commands", "STEP")
