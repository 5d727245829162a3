"""What a file claims to hold is checked before room is made for it."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from armimpedance.core.errors import InputError

#: So much may always be asked for...
PLENTY: Final = 300_000_000
#: ... and beyond it this many times the size of the file: what compression does to real samples.
MOST_PACKED: Final = 30


def check_claim(claimed: int, file: Path, part: str | None = None) -> None:
    """Refuse a claim that the size of the file makes impossible, or that no memory bears.

    Parameters
    ----------
    claimed : int
        Bytes that its content would take.
    file : Path
    part : str, optional
        Name of the column or variable.

    Raises
    ------
    InputError
    """
    if claimed <= PLENTY or claimed <= MOST_PACKED * file.stat().st_size:
        return
    problem = f"claims {claimed / 1e9:.3g} GB in a file of {file.stat().st_size / 1e6:.3g} MB"
    raise InputError(problem, file=file, column=part, expected="a file that is not damaged")
