"""The option that leaves out the trials of a list."""

from __future__ import annotations

import argparse
from pathlib import Path


def add_leave_out(
    parser: argparse._ActionsContainer, what: str = "leave out the trials of this list"
) -> None:
    """The option ``--leave-out FILE``: a CSV with the columns trial and why."""
    parser.add_argument(
        "--leave-out", type=Path, metavar="FILE.csv", help=f"{what}, as `trials` saves it"
    )
