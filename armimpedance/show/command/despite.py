"""The option that goes on where a check says STOP."""

from __future__ import annotations

import argparse


def add_despite(parser: argparse._ActionsContainer) -> None:
    """The option ``--despite CHECK``; `arguments.despite` is a list of names."""
    parser.add_argument(
        "--despite",
        action="append",
        default=[],
        metavar="CHECK",
        help="go on although this check of `inspect` says STOP, such as 'force sign'; results are "
        "marked; may be given again",
    )
