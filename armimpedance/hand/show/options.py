"""Options that several commands of the hand have."""

from __future__ import annotations

import argparse


def add_by(parser: argparse.ArgumentParser, more: str = "") -> None:
    """The argument that names the columns of the groups."""
    parser.add_argument(
        "--by",
        action="append",
        metavar="COLUMN",
        help="trials alike in this column of trials.csv form a group; may be given again "
        f"(default: condition){more}",
    )


def add_force_by(parser: argparse.ArgumentParser) -> None:
    """The argument that settles the sign of a Kinarm exam's force sensor."""
    parser.add_argument(
        "--force-by",
        choices=("limb", "device"),
        help="Kinarm exams: whose force on the other the sensor's columns hold",
    )
