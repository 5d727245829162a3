"""Result of `estimate`: estimates of all groups, accessible by name, as tables and files."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal, cast, overload

import numpy as np

from armimpedance.core.arrays import FrozenRecord
from armimpedance.core.conventions import UNITS
from armimpedance.core.errors import InputError, beginning, check_number
from armimpedance.core.findings import by_gravity
from armimpedance.core.records import ImpedanceEstimate, Recording, Subject
from armimpedance.core.shown import html_table
from armimpedance.hand.show.labelled import LabelledEstimate
from armimpedance.hand.show.quantities import check_group_columns, condition_of
from armimpedance.hand.show.results_csv import read_rows, results_content
from armimpedance.show.files import Content, WrittenResult
from armimpedance.show.text import counted
from armimpedance.show.verbs.chosen import ChosenPath
from armimpedance.show.verbs.results import (
    PathLike,
    as_columns,
    naming,
    position_of,
    read_recording,
)

if TYPE_CHECKING:
    pass

#: Number of estimates in a short text.
_MOST_SHOWN: Final = 10
#: Letters of the gravest warning in a short text.
_LONGEST_WARNING: Final = 160


@dataclass(frozen=True, repr=False, eq=False)
class Estimates(WrittenResult, FrozenRecord, Sequence[LabelledEstimate]):
    """Inertia, viscosity and stiffness of several groups of trials.

    A number, a group's name and iteration give one estimate with labelled matrices and their
    intervals: ``hand[0]``, ``hand["relaxed"].stiffness``. A slice, a list of names and `where` give
    several.

    Attributes
    ----------
    estimates : tuple of ImpedanceEstimate
        They are labelled on construction.
    subject : Subject or None
        Person who was measured; None if unknown or if there are several.
    gravity_m_s2 : (d,) tuple or None
        Gravity along the hand's axes, from the recording.

    Examples
    --------
    >>> from armimpedance.hand.show import Estimates
    >>> from armimpedance.hand.still import estimate
    >>> from manipulandum_sim.hand import simulate
    >>> conditions = ["cocontraction_10", "cocontraction_30"]
    >>> recording, _ = simulate("cocontraction", seed=1, sets=1, conditions=conditions)
    >>> hand = Estimates(tuple(estimate(recording)), recording.subject)
    >>> hand.names
    ('cocontraction_10', 'cocontraction_30')
    >>> hand["cocontraction_10"].stiffness.axes
    ('x', 'y')
    >>> hand.to_frame().shape[0]
    2
    """

    estimates: tuple[ImpedanceEstimate, ...]
    subject: Subject | None = None
    gravity_m_s2: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "estimates", tuple(map(LabelledEstimate.of, self.estimates)))
        super().__post_init__()

    def __len__(self) -> int:
        return len(self.estimates)

    @property
    def _labelled(self) -> tuple[LabelledEstimate, ...]:
        return cast(tuple[LabelledEstimate, ...], self.estimates)

    def __iter__(self) -> Iterator[LabelledEstimate]:
        return iter(self._labelled)

    @overload
    def __getitem__(self, which: int | str | tuple[Any, ...]) -> LabelledEstimate: ...
    @overload
    def __getitem__(self, which: slice | list[Any]) -> Estimates: ...
    def __getitem__(
        self, which: int | slice | str | tuple[Any, ...] | list[Any]
    ) -> LabelledEstimate | Estimates:
        """Look up estimates by position or by name.

        `which`: a position from 0, or a slice. A text is the value of one of the group's columns, a
        tuple holds the values of all of them in their order. If several methods estimated one
        group, the method's name comes last. A list holds several of these.
        Raises InputError: no group has this name, or several have; the message lists the names.
        """
        if isinstance(which, slice):
            return self._some(self._labelled[which])
        if isinstance(which, list):
            return self._some([self[one] for one in which])
        if isinstance(which, int | np.integer):
            return self._labelled[which]
        return self._labelled[position_of(which, self._values)]

    def _some(self, estimates: Sequence[LabelledEstimate]) -> Estimates:
        return Estimates(tuple(estimates), self.subject, self.gravity_m_s2)

    def items(self) -> list[tuple[str, LabelledEstimate]]:
        """Names and estimates, in their order."""
        return list(zip(self.names, self._labelled, strict=True))

    def where(self, **columns: Any) -> Estimates:
        """Select estimates by the values of columns: ``hand.where(condition="relaxed")``.

        Parameters
        ----------
        **columns
            One value, or several in a list, for each of these columns of the groups.

        Returns
        -------
        Estimates
            May be empty.

        Raises
        ------
        InputError
            A column that the groups do not have.
        """
        columns_of_groups = {name for estimate in self.estimates for name in estimate.keys}
        for name in columns:
            if name not in columns_of_groups:
                raise InputError(
                    f"no column {name!r}", expected=f"one of {', '.join(columns_of_groups)}"
                )
        wanted = {
            name: set(map(str, value if isinstance(value, list | tuple | set) else [value]))
            for name, value in columns.items()
        }
        return self._some(
            [e for e in self._labelled if all(str(e.keys.get(n)) in w for n, w in wanted.items())]
        )

    @property
    def _values(self) -> list[tuple[Any, ...]]:
        """Values of each group's columns, with the method if these are not unique."""
        groups = [tuple(e.keys.values()) for e in self.estimates]
        if len(set(map(repr, groups))) == len(groups):
            return groups
        return [(*g, e.method) for g, e in zip(groups, self.estimates, strict=True)]

    @property
    def names(self) -> tuple[str, ...]:
        """The groups in words: the condition alone, or all columns with their values."""
        return tuple(condition_of(estimate) for estimate in self.estimates)

    @property
    def content(self) -> Content:
        """Content of RESULTS.csv, one row per group.

        Raises
        ------
        InputError
            No estimates.
        """
        return results_content(self.estimates)

    def to_dict(self) -> list[dict[str, Any]]:
        """One mapping per group with nested lists of numbers, as in the JSON file."""
        make = self.content.objects
        return [] if make is None else list(make())

    def to_csv(self, path: PathLike) -> None:
        """Write RESULTS.csv, as the command ``armimpedance estimate --out`` does.

        Parameters
        ----------
        path : path
            Ends in .csv.

        Raises
        ------
        InputError
            Another ending, or no estimates.
        """
        if Path(path).suffix != ".csv":
            raise InputError("not a CSV file's name", file=path, expected="one that ends in .csv")
        self.write(path)

    def _table(self) -> list[list[str]]:
        rows = [
            [name, e.method, str(e.quality.n_trials), _stiffness(e)]
            for name, e in zip(self.names, self.estimates[:_MOST_SHOWN], strict=False)
        ]
        return [["group", "method", "trials", "stiffness"], *rows]

    def _head(self) -> str:
        left = len(self) - _MOST_SHOWN
        return counted(len(self), "estimate") + (f", {left} of them not shown" if left > 0 else "")

    def __repr__(self) -> str:
        lines = [f"{name}: {method}, {n} trials, {K}" for name, method, n, K in self._table()[1:]]
        return "\n".join([self._head(), *lines, *self._warned()])

    def _warned(self) -> list[str]:
        """One line with the number of warnings, and the gravest; empty if there are no warnings."""
        warnings = by_gravity(text for estimate in self.estimates for text in estimate.warnings)
        if not warnings:
            return []
        return [f"{counted(len(warnings), 'warning')}: {beginning(warnings[0], _LONGEST_WARNING)}"]

    def _repr_html_(self) -> str:
        warned = "".join(f"<p><b>{escape(line)}</b></p>" for line in self._warned())
        return f"<p>{escape(self._head())}</p>{html_table(self._table())}{warned}"


def _stiffness(estimate: ImpedanceEstimate) -> str:
    """Principal values of the symmetric part of K, the largest first, with the unit."""
    K = estimate.stiffness
    values = ", ".join(f"{v:.4g}" for v in np.linalg.eigvalsh((K + K.T) / 2)[::-1])
    return f"K {values} {UNITS[estimate.level]['K']}"


def read_results(path: PathLike) -> Estimates:
    """Read RESULTS.csv, written by this package or by a script in the same format.

    Needed are `n_trials`, `method`, `level`, all of `M_ij, B_ij, K_ij`, and either `covariance`
    or all of `sd_M_ij, sd_B_ij, sd_K_ij`: with the latter alone the covariance is diagonal and the
    estimate says so in a warning. `shared_errors` may be missing. Without `dof` it is taken as
    `n_trials - 1`. Intervals, ellipses and antisymmetric parts are not read: they follow from the
    rest. Columns that are not the results' own are the group's; their texts that look like numbers
    become numbers (`condition` stays text). A column without a name, such as a data frame's row
    numbers, is ignored.

    Parameters
    ----------
    path : path
        RESULTS.csv.

    Returns
    -------
    Estimates
        One for each row of the file, in its order.

    Raises
    ------
    InputError
        With file, row and column of a missing or wrong value.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> import armimpedance as ai
    >>> from manipulandum_sim.hand import simulate
    >>> recording, _ = simulate("cocontraction", seed=1, sets=1, conditions=["cocontraction_10"])
    >>> hand = ai.estimate(recording)
    >>> with TemporaryDirectory() as folder:
    ...     hand.to_csv(Path(folder) / "results.csv")
    ...     again = ai.read_results(Path(folder) / "results.csv")
    >>> again[0].keys["condition"]
    'cocontraction_10'
    """
    if isinstance(path, ChosenPath):
        raise path.refused()
    return Estimates(tuple(read_rows(path)))


_TAKEN: Final = (
    "estimates are expected, what `estimate` returns, some of it, or the path of a RESULTS.csv"
)
#: Estimates as input: a result, one or several of its estimates, or a RESULTS.csv.
GivenEstimates = Sequence[ImpedanceEstimate] | ImpedanceEstimate | PathLike


def estimates_of(given: GivenEstimates) -> Sequence[ImpedanceEstimate]:
    """Estimates from the input of a user; those of a file are read.

    Raises TypeError: another type; the message names it.
    """
    if isinstance(given, ImpedanceEstimate):
        return [given]
    if isinstance(given, str | os.PathLike):
        return read_results(given)
    if not isinstance(given, Iterable) or isinstance(given, Mapping):
        raise TypeError(f"got {type(given).__name__}: {_TAKEN}")
    rows: Sequence[Any] = given if isinstance(given, Sequence) else list(given)
    for row in rows:
        if not isinstance(row, ImpedanceEstimate):
            raise TypeError(f"got {type(given).__name__} of {type(row).__name__}: {_TAKEN}")
    return rows


# A recording of the hand, opened with the columns of its groups.

ForceBy = Literal["limb", "device"]


@contextmanager
def opened(
    source: Recording | PathLike, by: str | Sequence[str], seed: int, force_by: ForceBy | None
) -> Iterator[tuple[Recording, tuple[str, ...]]]:
    """Open a recording with the columns of its groups; errors inside name its path."""
    columns = as_columns(by)
    check_group_columns(columns)
    check_number(seed, f"seed {seed}", low=0)
    with naming(source):
        yield read_recording(source, force_by=force_by), columns
