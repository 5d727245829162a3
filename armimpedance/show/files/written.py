"""Forms that every result has: wide and long data frame, labelled arrays, file."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar

from armimpedance.core.described import Meaning, meanings
from armimpedance.numerics.regression import FitSummary
from armimpedance.show.files.content import About, Content
from armimpedance.show.files.fit_json import FIT_COLUMNS, fit_content
from armimpedance.show.files.labelled import dataset_of
from armimpedance.show.files.tables import write_content

if TYPE_CHECKING:
    import pandas as pd
    import xarray


class WrittenResult:
    """A result whose `content` is what its files hold.

    Examples
    --------
    >>> import armimpedance as ai
    >>> from armimpedance.show.files import WrittenResult
    >>> from manipulandum_sim.hand import simulate
    >>> session, _ = simulate("cocontraction", seed=1, sets=1, conditions=["cocontraction_10"])
    >>> hand = ai.estimate(session)
    >>> isinstance(hand, WrittenResult)
    True
    """

    #: What the columns of its table are, beside those of an impedance.
    DESCRIBED: ClassVar[Mapping[str, Meaning]] = {}

    @property
    def content(self) -> Content:
        """The content of this result's file, independent of its format."""
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

    def to_xarray(self) -> xarray.Dataset:
        """The table as labelled arrays: matrices whole, names of axes, units as attributes.

        Raises InputError: xarray is not installed, or rows at several levels.
        """
        return dataset_of(self.content)

    def write(
        self, path: str | os.PathLike[str], *, long: bool = False, about: About | None = None
    ) -> None:
        """Write the result; the ending decides the format.

        `path`: ends in .csv, .json, .parquet, .xlsx (a workbook) or .mat (MATLAB structs).
        `long`: the table of `to_long` in place of that of `to_frame`: .csv, .json and .parquet.
        `about`: methods paragraph, checks and options, for the formats that have a place for them.
        Raises InputError: another ending, nothing to write, or the file cannot be written.
        """
        write_content(self.content, path, long=long, about=about)


class FittedResult(WrittenResult):
    """A result that is a list of fitted numbers; its file is FIT.json, or a row a number.

    Examples
    --------
    >>> from armimpedance.joint.relaxed import PassiveFits
    >>> from armimpedance.show.files import FittedResult
    >>> issubclass(PassiveFits, FittedResult), PassiveFits.MEANINGS["h"].words
    (True, 'viscosity')
    """

    DESCRIBED = meanings(FIT_COLUMNS)
    #: What the numbers are, by their names; ``{}`` in a name stands for a muscle or a segment.
    MEANINGS: ClassVar[Mapping[str, Meaning]] = {}

    if TYPE_CHECKING:
        # a field of some, worked out by others

        @property
        def summary(self) -> FitSummary:
            """Method, size, condition and parameters: what FIT.json holds of every fit."""

    def to_dict(self) -> dict[str, Any]:
        """The content of FIT.json."""
        return self.summary.to_dict()

    @property
    def content(self) -> Content:
        """FIT.json as it is, a row a parameter in every other format."""
        return fit_content(self.summary, self.to_dict(), self.MEANINGS)

    def to_frame(self) -> pd.DataFrame:
        """One row a parameter: value, standard error, 95 % limits, unit."""
        return self.summary.to_frame()

    def _repr_html_(self) -> str:
        return self.summary._repr_html_()
