"""What `estimate` returns: estimates of all groups, found by their names, as tables and files."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any, Final, overload

import numpy as np

from armimpedance.core.arrays import FrozenRecord
from armimpedance.core.conventions import UNITS
from armimpedance.core.errors import InputError
from armimpedance.core.records import ImpedanceEstimate, Subject
from armimpedance.hand.show.labelled import LabelledEstimate
from armimpedance.hand.show.quantities import condition_of
from armimpedance.hand.show.results_csv import results_content
from armimpedance.show.files import Content
from armimpedance.show.text import counted, html_table
from armimpedance.show.verbs.named import position_of
from armimpedance.show.verbs.sources import PathLike
from armimpedance.show.verbs.written import WrittenResult

#: Estimates that a short text shows.
_MOST_SHOWN: Final = 10


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

        Parameters
        ----------
        which : int, slice, str or tuple
            A position from 0 or a slice gives plain records. A text is the value of one of the
            group's columns, a tuple holds the values of all of them in their order. Where several
            methods estimated one group, the method's name comes last.

        Returns
        -------
        ImpedanceEstimate, Estimates or LabelledEstimate

        Raises
        ------
        InputError
            No group has this name, or several have; the message lists the names.
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
        return "\n".join([self._head(), *lines])

    def _repr_html_(self) -> str:
        return f"<p>{escape(self._head())}</p>{html_table(self._table())}"


def _stiffness(estimate: ImpedanceEstimate) -> str:
    """The principal values of the symmetric part of K, the largest first, with the unit."""
    K = estimate.stiffness
    values = ", ".join(f"{v:.4g}" for v in np.linalg.eigvalsh((K + K.T) / 2)[::-1])
    return f"K {values} {UNITS[estimate.level]['K']}"
