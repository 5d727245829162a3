"""What every result with a table shares: as a data frame, wide or long, and as a file."""

from __future__ import annotations

from typing import TYPE_CHECKING

from armimpedance.show.files import About, Content, write_content
from armimpedance.show.verbs.sources import PathLike

if TYPE_CHECKING:
    import pandas as pd


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

        Parameters
        ----------
        path : path
            Ends in .csv, .json, .parquet, .xlsx (a workbook) or .mat (MATLAB structs).
        long : bool
            The table of `to_long` in place of that of `to_frame`: .csv, .json and .parquet.
        about : About, optional
            Methods paragraph, checks and options, for the formats that have a place for them.

        Raises
        ------
        InputError
            Another ending, nothing to write, or the file cannot be written.
        """
        write_content(self.content, path, long=long, about=about)
