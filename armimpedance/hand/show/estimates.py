"""What `estimate` returns: estimates of all groups, found by their names, as tables and files."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, overload

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.conventions import AXES, MATRICES, UNITS
from armimpedance.core.errors import InputError, shortened
from armimpedance.core.findings import by_gravity
from armimpedance.core.records import ImpedanceEstimate, Recording, Subject
from armimpedance.hand.ellipses import Ellipse, Which, ellipse_of
from armimpedance.hand.show.quantities import check_group_columns, condition_of
from armimpedance.hand.show.results_csv import results_content
from armimpedance.hand.show.text import estimate_text
from armimpedance.numerics.regression import t_factor
from armimpedance.show.files import Content, WrittenResult
from armimpedance.show.text import counted, html_table
from armimpedance.show.verbs.results import (
    PathLike,
    as_columns,
    naming,
    position_of,
    read_recording,
)

if TYPE_CHECKING:
    import pandas as pd

# Matrices with their intervals and the names of their axes, as a person reads them.


@dataclass(frozen=True, repr=False, eq=False)
class LabelledMatrix(FrozenRecord):
    """One matrix of an estimate with its 95 % intervals.

    NumPy takes it as the matrix: ``np.linalg.eigvalsh(hand["relaxed"].stiffness)``.

    Attributes
    ----------
    symbol, unit : str
        Such as ``K`` and ``N/m``.
    axes : tuple of k str
        Names of the rows and columns.
    value, sd, low, high : (k, k)
        Elements, their standard errors and their 95 % limits.

    Examples
    --------
    >>> import armimpedance as ai
    >>> from manipulandum_sim.hand import simulate
    >>> session, truth = simulate("cocontraction", seed=1, sets=1, conditions=["cocontraction_10"])
    >>> stiffness = ai.estimate(session)["cocontraction_10"].stiffness
    >>> stiffness.axes
    ('x', 'y')
    >>> bool((stiffness.low < stiffness.value).all())
    True
    """

    symbol: str
    unit: str
    axes: Annotated[tuple[str, ...], "k"]
    value: Annotated[FloatArray, "k k"]
    sd: Annotated[FloatArray, "k k"]
    low: Annotated[FloatArray, "k k"]
    high: Annotated[FloatArray, "k k"]

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        return np.array(self.value, dtype=dtype) if copy else np.asarray(self.value, dtype=dtype)

    def to_frame(self) -> pd.DataFrame:
        """One row an element: its row and column, value, standard error, 95 % limits, unit."""
        import pandas as pd

        places = pd.MultiIndex.from_product([self.axes, self.axes], names=["row", "column"])
        columns = {name: getattr(self, name).ravel() for name in ("value", "sd", "low", "high")}
        return pd.DataFrame({**columns, "unit": self.unit}, index=places)

    def _table(self) -> list[list[str]]:
        """The heading and the rows: ``104 [95.4, 113]`` of every element."""
        rows = [
            [axis, *(f"{v:.4g} [{a:.4g}, {b:.4g}]" for v, a, b in zip(*row, strict=True))]
            for axis, row in zip(
                self.axes, np.stack([self.value, self.low, self.high], axis=1), strict=True
            )
        ]
        return [[f"{self.symbol} ({self.unit})", *self.axes], *rows]

    def __repr__(self) -> str:
        table = self._table()
        widths = [max(map(len, column)) for column in zip(*table, strict=True)]
        return "\n".join(
            "   ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)).rstrip()
            for row in table
        )

    def _repr_html_(self) -> str:
        return html_table(self._table())


class LabelledEstimate:
    """One estimate as a person reads it: its matrices with intervals, units and axes.

    Every other attribute is the record's own: ``hand["relaxed"].quality``. `print` shows all of it.

    Parameters
    ----------
    estimate : ImpedanceEstimate

    Attributes
    ----------
    estimate : ImpedanceEstimate
        The record, with plain arrays.
    inertia, viscosity, stiffness : LabelledMatrix

    Examples
    --------
    >>> import armimpedance as ai
    >>> from manipulandum_sim.hand import simulate
    >>> session, truth = simulate("cocontraction", seed=1, sets=1, conditions=["cocontraction_10"])
    >>> level = ai.estimate(session)["cocontraction_10"]
    >>> level.stiffness.unit, level.inertia.unit
    ('N/m', 'kg')
    """

    def __init__(self, estimate: ImpedanceEstimate) -> None:
        self.estimate = estimate

    @property
    def inertia(self) -> LabelledMatrix:
        """M, the limb's own."""
        return self._labelled("inertia")

    @property
    def viscosity(self) -> LabelledMatrix:
        """B."""
        return self._labelled("viscosity")

    @property
    def stiffness(self) -> LabelledMatrix:
        """K."""
        return self._labelled("stiffness")

    def ellipse(self, which: Which = "stiffness") -> Ellipse | None:
        """The ellipse of a matrix at the hand with its limits; None where there is none.

        Parameters
        ----------
        which : {"inertia", "viscosity", "stiffness"}
        """
        return ellipse_of(self.estimate, which)

    def __getattr__(self, name: str) -> Any:
        if name == "estimate":
            raise AttributeError(name)
        return getattr(self.estimate, name)

    def _labelled(self, which: Which) -> LabelledMatrix:
        estimate, (symbol, _) = self.estimate, MATRICES[which]
        value, sd = getattr(estimate, which), estimate.sd["MBK".index(symbol)]
        half = t_factor(estimate.dof) * sd
        unit = UNITS[estimate.level][symbol]
        return LabelledMatrix(
            symbol, unit, axes_of(estimate), value, sd, value - half, value + half
        )

    def __str__(self) -> str:
        """The estimate in full: matrices, their parts and ellipses, quality, warnings."""
        return estimate_text(self.estimate)

    def __repr__(self) -> str:
        return "\n".join(map(repr, (self.inertia, self.viscosity, self.stiffness)))

    def _repr_html_(self) -> str:
        matrices = (self.inertia, self.viscosity, self.stiffness)
        return "".join(matrix._repr_html_() for matrix in matrices)


def axes_of(estimate: ImpedanceEstimate) -> tuple[str, ...]:
    """Names of an estimate's axes: x and y, shoulder and elbow, or the muscles."""
    k = estimate.k
    if estimate.level == "hand" and k <= len(AXES):
        return AXES[:k]
    if estimate.level == "joint" and k == 2:
        return ("shoulder", "elbow")
    if estimate.level == "muscle" and len(estimate.muscles) == k:
        return estimate.muscles
    return tuple(map(str, range(1, k + 1)))


#: Estimates that a short text shows.
_MOST_SHOWN: Final = 10
#: Letters of the gravest warning in the same place.
_LONGEST_WARNING: Final = 160


@dataclass(frozen=True, repr=False, eq=False)
class Estimates(WrittenResult, FrozenRecord, Sequence[ImpedanceEstimate]):
    """Inertia, viscosity and stiffness of several groups of trials.

    It is a sequence of `ImpedanceEstimate`: iteration, a number and a slice give the plain records
    that all functions of the package take. A group's name gives the same estimate with labelled
    matrices and their intervals: ``hand["relaxed"].stiffness``.

    Attributes
    ----------
    estimates : tuple of ImpedanceEstimate
    subject : Subject or None
        Who was measured; None where it is not known or where there are several.
    gravity_m_s2 : (d,) tuple or None
        Gravity along the hand's axes, as the recording says.

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

    def __len__(self) -> int:
        return len(self.estimates)

    def __iter__(self) -> Iterator[ImpedanceEstimate]:
        return iter(self.estimates)

    @overload
    def __getitem__(self, which: int) -> ImpedanceEstimate: ...
    @overload
    def __getitem__(self, which: slice) -> Estimates: ...
    @overload
    def __getitem__(self, which: str | tuple[Any, ...]) -> LabelledEstimate: ...
    def __getitem__(
        self, which: int | slice | str | tuple[Any, ...]
    ) -> ImpedanceEstimate | Estimates | LabelledEstimate:
        """Look up estimates by position or by name.

        `which`: a position from 0 or a slice gives plain records. A text is the value of one of the
        group's columns, a tuple holds the values of all of them in their order. Where several
        methods estimated one group, the method's name comes last.
        Raises InputError: no group has this name, or several have; the message lists the names.
        """
        if isinstance(which, slice):
            return Estimates(self.estimates[which], self.subject, self.gravity_m_s2)
        if isinstance(which, int | np.integer):
            return self.estimates[which]
        return LabelledEstimate(self.estimates[position_of(which, self._values)])

    @property
    def _values(self) -> list[tuple[Any, ...]]:
        """The values of each group's columns, and the method where these do not tell it."""
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
        """What RESULTS.csv holds, one row a group.

        Raises
        ------
        InputError
            No estimates.
        """
        return results_content(self.estimates)

    def to_dict(self) -> list[dict[str, Any]]:
        """One mapping a group with nested lists of numbers, as the JSON file holds them."""
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
        """One line on the warnings: how many there are, and the gravest; none where none is."""
        said = by_gravity(text for one in self.estimates for text in one.warnings)
        if not said:
            return []
        return [f"{counted(len(said), 'warning')}: {shortened(said[0], _LONGEST_WARNING)}"]

    def _repr_html_(self) -> str:
        warned = "".join(f"<p><b>{escape(line)}</b></p>" for line in self._warned())
        return f"<p>{escape(self._head())}</p>{html_table(self._table())}{warned}"


def _stiffness(estimate: ImpedanceEstimate) -> str:
    """The principal values of the symmetric part of K, the largest first, with the unit."""
    K = estimate.stiffness
    values = ", ".join(f"{v:.4g}" for v in np.linalg.eigvalsh((K + K.T) / 2)[::-1])
    return f"K {values} {UNITS[estimate.level]['K']}"


# A recording of the hand, opened with the columns of its groups.

ForceBy = Literal["limb", "device"]


@contextmanager
def opened(
    source: Recording | PathLike, by: str | Sequence[str], seed: int, force_by: ForceBy | None
) -> Iterator[tuple[Recording, tuple[str, ...]]]:
    """The recording and the columns of its groups; errors inside name its path."""
    columns = as_columns(by)
    check_group_columns(columns)
    if seed < 0:
        raise InputError(f"seed {seed}", expected="0 or more")
    with naming(source):
        yield read_recording(source, force_by=force_by), columns
