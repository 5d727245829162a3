"""The verb `reflex` and its verdicts: does the stiffness contain a reflex?"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any, overload

import numpy as np

from armimpedance.core.arrays import FrozenRecord
from armimpedance.core.conventions import group_name
from armimpedance.core.described import meanings
from armimpedance.core.progress import Progress
from armimpedance.core.records import Recording
from armimpedance.core.shown import html_table
from armimpedance.hand.show.estimates import ForceBy, opened
from armimpedance.hand.still.doubts.filter import in_step
from armimpedance.hand.still.reflex import reflex_guard
from armimpedance.hand.still.reflex_verdict import ReflexVerdict
from armimpedance.hand.still.show.gate import checked_response
from armimpedance.hand.still.show.options import REFLEX
from armimpedance.hand.still.show.text import VERDICT, headline, verdict_rows
from armimpedance.show.files import Content, WrittenResult, table_content
from armimpedance.show.verbs.results import PathLike, position_of


@REFLEX.function
def reflex(
    recording: Recording | PathLike,
    *,
    by: str | Sequence[str] = "condition",
    delay_ms: float | None = None,
    seed: int = 0,
    force_by: ForceBy | None = None,
    despite: str | Collection[str] = (),
    progress: Progress | None = None,
) -> ReflexVerdicts:
    """Judge for every group of trials whether its stiffness contains a reflex.

    Parameters
    ----------
    recording : Recording or path
        Of the hand or of joints, with disturbances that return.
    {options}
    progress : function (done, all), optional
        Called after each group.

    Returns
    -------
    ReflexVerdicts
        One verdict per group, in the order of the trial table.

    Raises
    ------
    InputError
        The recording cannot be read, a check of `inspect` says STOP, a column is missing, there are
        too few trials, the delay is out of range, or the perturbation is stochastic.
    NotIdentifiableError
        The motion of a group does not determine M, B and K.

    Examples
    --------
    >>> from armimpedance.hand.still.show import reflex
    >>> from manipulandum_sim.hand import simulate
    >>> recording, _ = simulate("cocontraction", seed=1, sets=1, conditions=["cocontraction_10"])
    >>> verdicts = reflex(recording)
    >>> verdicts["cocontraction_10"].outcome in ("none", "contaminated", "unknown")
    True
    """
    delay_s = None if delay_ms is None else delay_ms / 1e3
    with opened(recording, by, seed, force_by) as (read, columns):
        marks: tuple[str, ...] = ()
        if read.perturbation != "stochastic":
            marks = checked_response(read, despite, by=columns)
        # leave out marks on reflexes: this verb judges them, group by group
        marks = tuple(mark for mark in marks if not mark.startswith("reflex"))
        read, _ = in_step(read)
        verdicts = reflex_guard(read, by=columns, delay_s=delay_s, seed=seed, progress=progress)
        return ReflexVerdicts(tuple(verdicts), marks)


@dataclass(frozen=True, repr=False, eq=False)
class ReflexVerdicts(WrittenResult, FrozenRecord, Sequence[ReflexVerdict]):
    """Verdicts of the reflex guard on every group of trials.

    Iteration gives `ReflexVerdict`; a number, or the value of a group's column, selects one.

    Attributes
    ----------
    verdicts : tuple of ReflexVerdict
    warnings : tuple of str
        Warnings of the recording's checks; each row of the table is marked with them.

    Examples
    --------
    >>> import armimpedance as ai
    >>> from manipulandum_sim.hand import simulate
    >>> session, truth = simulate("cocontraction", seed=1, sets=1, conditions=["cocontraction_10"])
    >>> verdicts = ai.reflex(session)
    >>> verdicts.names
    ('cocontraction_10',)
    """

    DESCRIBED = meanings(VERDICT)

    verdicts: tuple[ReflexVerdict, ...]
    warnings: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.verdicts)

    @overload
    def __getitem__(self, which: int | str | tuple[Any, ...]) -> ReflexVerdict: ...
    @overload
    def __getitem__(self, which: slice) -> ReflexVerdicts: ...
    def __getitem__(
        self, which: int | slice | str | tuple[Any, ...]
    ) -> ReflexVerdict | ReflexVerdicts:
        """Look up verdicts by position, slice or name.

        Raises InputError: no group has this name, or several have; the message lists the names.
        """
        if isinstance(which, slice):
            return ReflexVerdicts(self.verdicts[which], self.warnings)
        if isinstance(which, int | np.integer):
            return self.verdicts[which]
        return self.verdicts[position_of(which, [tuple(v.keys.values()) for v in self])]

    @property
    def names(self) -> tuple[str, ...]:
        """The groups in words: the condition alone, or all columns with their values."""
        return tuple(group_name(verdict.keys) for verdict in self)

    @property
    def content(self) -> Content:
        """One row per group, with the columns of ``armimpedance reflex --out``."""
        keys = dict.fromkeys(str(name) for verdict in self for name in verdict.keys)
        return table_content(
            self.to_dict(), keys=(*keys, "outcome", "n_trials"), described=self.DESCRIBED
        )

    def to_dict(self) -> list[dict[str, Any]]:
        """One mapping per group, with the names of the table's columns."""
        rows = verdict_rows(self.verdicts)
        marks = {"warnings": "; ".join(self.warnings)} if self.warnings else {}
        return [row | marks for row in rows]

    def _table(self) -> list[list[str]]:
        rows = [[name, headline(v)] for name, v in zip(self.names, self, strict=True)]
        rest = [["...", f"{len(rows) - 10} more"]] if len(rows) > 10 else []
        return [["group", "verdict"], *rows[:10], *rest]

    def __repr__(self) -> str:
        return "\n".join(f"{name}: {verdict}" for name, verdict in self._table()[1:])

    def _repr_html_(self) -> str:
        return html_table(self._table())
