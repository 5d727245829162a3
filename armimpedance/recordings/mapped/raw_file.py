"""What a file of any layout holds before a mapping says what it means: runs of named columns.

A run is one stretch of recording: one trial, or a whole session. Its columns stand on one clock or
on several (topics of a bag, groups of a file); each clock is a table.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from armimpedance.core.errors import RecordError

#: Whether a column is wanted, by its name; a reader may skip what is not.
Wanted = Callable[[str], bool]


@dataclass(frozen=True)
class RawColumn:
    """One column as the file has it.

    Attributes
    ----------
    values : (N,)
        float64, NaN where a value is missing; or texts.
    unit : str or None
        As the file states it, not interpreted.
    """

    values: NDArray[np.float64] | NDArray[np.str_]
    unit: str | None = None

    @property
    def is_text(self) -> bool:
        """Whether the column holds texts."""
        return self.values.dtype.kind == "U"


@dataclass(frozen=True)
class RawTable:
    """Columns of one clock, of equal length.

    Attributes
    ----------
    columns : mapping
        Name -> column. Names are different over all tables of a run.
    time_s : (N,) or None
        The time of the rows where the file itself knows it (stamps of messages, a start and a
        rate); None where at most a column tells it.
    rate_hz : float or None
        Where the file states it.
    first_row : int
        Where the first row stands in the file, for messages: the line of a text file, else 1.
    """

    columns: Mapping[str, RawColumn]
    time_s: NDArray[np.float64] | None = None
    rate_hz: float | None = None
    first_row: int = 1

    def __post_init__(self) -> None:
        lengths = {len(column.values) for column in self.columns.values()}
        if self.time_s is not None:
            lengths.add(len(self.time_s))
        if len(lengths) > 1:
            raise RecordError(f"columns of {sorted(lengths)} rows", expected="one clock a table")

    @property
    def rows(self) -> int:
        """Number of rows N."""
        if self.time_s is not None:
            return len(self.time_s)
        return next((len(column.values) for column in self.columns.values()), 0)


@dataclass(frozen=True)
class RawRun:
    """One stretch of recording: its tables, and what the file says of it as a whole.

    Attributes
    ----------
    name : str
        For messages: the file, or the part of it.
    facts : mapping
        Numbers and texts that hold for the run, such as a condition or a subject's mass.
    """

    name: str
    tables: tuple[RawTable, ...]
    facts: Mapping[str, float | str] = field(default_factory=dict)


@dataclass(frozen=True)
class RawFile:
    """All runs of a file or folder, and sentences on what in it is not among them."""

    runs: tuple[RawRun, ...]
    not_taken: tuple[str, ...] = ()


@dataclass(frozen=True)
class Source:
    """A kind of file whose columns a mapping explains.

    Attributes
    ----------
    name : str
        In messages, such as "a MATLAB file (.mat)".
    recognises : callable
        Whether an existing file or folder is of this kind, without any package that may be
        missing.
    read : callable
        Reads the columns that are wanted; `InputError` for whatever is wrong with the file.
    """

    name: str
    recognises: Callable[[Path], bool]
    read: Callable[[Path, Wanted], RawFile]
