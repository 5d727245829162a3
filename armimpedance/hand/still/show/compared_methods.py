"""Every method on the same trials, as a table and in a few lines."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from armimpedance.core.arrays import FrozenRecord
from armimpedance.core.conventions import group_name
from armimpedance.core.records import Subject
from armimpedance.hand.show.estimates import Estimates
from armimpedance.hand.still.show.methods_table import methods_table
from armimpedance.hand.still.side_by_side import SideBySide

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, repr=False, eq=False)
class ComparedMethods(FrozenRecord):
    """Every method on every group of trials.

    Attributes
    ----------
    groups : tuple of SideBySide
        What each method found in each group, and how far it lies from the reference.
    reference : str
        The method that the others are measured against.
    subject : Subject or None
    gravity_m_s2 : (d,) tuple or None
        Gravity along the hand's axes, as the recording says.
    """

    groups: tuple[SideBySide, ...]
    reference: str
    subject: Subject | None = None
    gravity_m_s2: tuple[float, ...] | None = None

    @property
    def estimates(self) -> Estimates:
        """The estimates of the methods that ran, group by group."""
        made = tuple(e for side in self.groups for e in side.estimates)
        return Estimates(made, self.subject, self.gravity_m_s2)

    def to_frame(self) -> pd.DataFrame:
        """One row per group and method: distance from the reference in M, B and K.

        In percent of the reference's matrix and in standard errors of the difference; `reason`
        says why a method cannot run.
        """
        import pandas as pd

        return pd.DataFrame([row for side in self.groups for row in self._rows(side)])

    def _rows(self, side: SideBySide) -> Iterator[dict[str, Any]]:
        apart = {d.method: d for d in side.disagreements}
        for result in side.results:
            row = {**side.keys, "method": result.method, "reason": result.reason}
            known = apart.get(result.method)
            for i, symbol in enumerate("MBK"):
                row[f"{symbol}_percent"] = np.nan if known is None else known.percent[i]
                row[f"{symbol}_standard_errors"] = (
                    np.nan if known is None else known.standard_errors[i]
                )
            yield row

    def __str__(self) -> str:
        return methods_table(self.groups, self.reference)

    def _lines(self) -> list[str]:
        said = [
            f"{group_name(side.keys)}: {sentence}"
            for side in self.groups
            for d in side.disagreements
            for sentence in d.sentences
        ]
        nothing = f"no method differs from {self.reference} by more than chance and a few percent"
        left = [f"... and {len(said) - 10} more"] if len(said) > 10 else []
        return [f"{len(self.groups)} groups", *(said[:10] or [nothing]), *left]

    def __repr__(self) -> str:
        return "\n".join(self._lines())

    def _repr_html_(self) -> str:
        return "".join(f"<p>{escape(line)}</p>" for line in self._lines())
