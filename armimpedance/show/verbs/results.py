"""What every result shares: groups found by their columns' values, a data frame, a file."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from armimpedance.core.errors import InputError
from armimpedance.show.files import About, Content, write_content
from armimpedance.show.verbs.sources import PathLike

if TYPE_CHECKING:
    import pandas as pd


def position_of(which: object, groups: Sequence[tuple[Any, ...]]) -> int:
    """Number of the group that a name means.

    `which`: the value of one of the group's columns, or a tuple of the values of all of them.
    `groups`: the values of each group's columns.
    Raises InputError: no group has this name, or several have; the message lists the names.
    """
    wanted = tuple(map(str, which)) if isinstance(which, tuple) else None
    texts = [tuple(map(str, values)) for values in groups]
    fits = [i for i, own in enumerate(texts) if own == wanted or str(which) in own]
    if len(fits) == 1:
        return fits[0]
    problem = "names several groups" if fits else "names no group"
    # a single name is looked up as a text, several as a tuple
    known = ", ".join(repr(own[0] if len(own) == 1 else own) for own in texts)
    raise InputError(f"{which!r} {problem}", expected=f"one of {known}")


def as_columns(by: str | Sequence[str]) -> tuple[str, ...]:
    """One column's name or several as a tuple."""
    return (by,) if isinstance(by, str) else tuple(by)


class WrittenResult:
    """A result whose `content` is what its files hold."""

    @property
    def content(self) -> Content:
        """What a file of this result holds, whatever its format."""
        raise NotImplementedError

    def to_frame(self) -> pd.DataFrame:
        """The table that `write` writes: its columns and values."""
        import pandas as pd

        content = self.content
        return pd.DataFrame(list(content.rows), columns=list(content.columns))

    def to_long(self) -> pd.DataFrame:
        """One row a number: its group, its name, value, 95 % limits, standard error and unit."""
        import pandas as pd

        columns, rows = self.content.long_table
        return pd.DataFrame(rows, columns=columns)

    def write(self, path: PathLike, *, long: bool = False, about: About | None = None) -> None:
        """Write the result; the ending decides the format.

        `path`: ends in .csv, .json, .parquet, .xlsx (a workbook) or .mat (MATLAB structs).
        `long`: the table of `to_long` in place of that of `to_frame`: .csv, .json and .parquet.
        `about`: methods paragraph, checks and options, for the formats that have a place for them.
        Raises InputError: another ending, nothing to write, or the file cannot be written.
        """
        write_content(self.content, path, long=long, about=about)
