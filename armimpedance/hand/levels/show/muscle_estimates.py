"""What several joint matrices say of the muscles, found by name, as tables and files."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any, Final, overload

import numpy as np

from armimpedance.core.arrays import FrozenRecord
from armimpedance.core.conventions import group_name
from armimpedance.hand.levels.muscle_map import MuscleEstimate
from armimpedance.hand.levels.show.muscle_csv import muscles_content
from armimpedance.show.files import Content
from armimpedance.show.text import html_table
from armimpedance.show.verbs.named import position_of
from armimpedance.show.verbs.written import WrittenResult

#: Estimates that a short text shows.
_MOST_SHOWN: Final = 10


@dataclass(frozen=True, repr=False, eq=False)
class MuscleEstimates(WrittenResult, FrozenRecord, Sequence[MuscleEstimate]):
    """Estimates at the muscle level of several groups of trials.

    It is a sequence of `MuscleEstimate`; a group's name finds its estimate, as
    ``muscles["relaxed"].stiffness.single``.

    Attributes
    ----------
    estimates : tuple of MuscleEstimate
    """

    estimates: tuple[MuscleEstimate, ...]

    def __len__(self) -> int:
        return len(self.estimates)

    def __iter__(self) -> Iterator[MuscleEstimate]:
        return iter(self.estimates)

    @overload
    def __getitem__(self, which: int | str | tuple[Any, ...]) -> MuscleEstimate: ...
    @overload
    def __getitem__(self, which: slice) -> MuscleEstimates: ...
    def __getitem__(
        self, which: int | slice | str | tuple[Any, ...]
    ) -> MuscleEstimate | MuscleEstimates:
        """Look up estimates by position, or one by the values of its group's columns.

        Raises
        ------
        InputError
            No group has this name, or several have; the message lists the names.
        """
        if isinstance(which, slice):
            return MuscleEstimates(self.estimates[which])
        if isinstance(which, int | np.integer):
            return self.estimates[which]
        return self.estimates[position_of(which, [tuple(e.keys.values()) for e in self.estimates])]

    @property
    def names(self) -> tuple[str, ...]:
        """The groups in words: the condition alone, or all columns with their values."""
        return tuple(group_name(estimate.keys) for estimate in self.estimates)

    @property
    def content(self) -> Content:
        """The columns and values of the written file, one row a group."""
        return muscles_content(self.estimates)

    def to_dict(self) -> list[dict[str, Any]]:
        """One mapping a group, with the columns of the written file."""
        return [dict(row) for row in self.content.rows]

    def _table(self) -> list[list[str]]:
        rows = [
            [name, ", ".join(f"{c.name} {c.value:.4g}" for c in e.stiffness.combinations)]
            for name, e in zip(self.names, self.estimates[:_MOST_SHOWN], strict=False)
        ]
        return [["group", "sums of stiffness (N m/rad)"], *rows]

    def _head(self) -> str:
        left = len(self) - _MOST_SHOWN
        more = f", {left} of them not shown" if left > 0 else ""
        arms = ", ".join(dict.fromkeys(e.arm for e in self.estimates))
        return f"{len(self)} estimates of the muscles of {arms}{more}"

    def __repr__(self) -> str:
        return "\n".join([self._head(), *(f"{name}: {sums}" for name, sums in self._table()[1:])])

    def _repr_html_(self) -> str:
        return f"<p>{escape(self._head())}</p>{html_table(self._table())}"
