"""What `compare` returns: changes and tests as a table, a figure and text."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from textwrap import fill
from typing import Any

from armimpedance.core.arrays import FrozenRecord
from armimpedance.core.findings import Finding
from armimpedance.hand.comparison.groups import ComparedGroup
from armimpedance.hand.comparison.pairs import Pair
from armimpedance.hand.comparison.show.table import comparison_content
from armimpedance.hand.comparison.show.text import comparison_text, subjects_text
from armimpedance.hand.comparison.subjects import SubjectsChange
from armimpedance.show.files import Content
from armimpedance.show.text import TABLE_WIDTH, checks_lines, html_table
from armimpedance.show.verbs.written import WrittenResult


@dataclass(frozen=True, repr=False, eq=False)
class Comparison(WrittenResult, FrozenRecord):
    """What differs between groups of trials, and whether chance could have done it.

    Attributes
    ----------
    groups : tuple of ComparedGroup
        All groups, of all subjects.
    pairs : sequence of Pair
        Pairs of groups with their changes and tests; empty where subjects were told apart.
    over_subjects : tuple of SubjectsChange
        Mean changes over subjects and the spread between them; empty otherwise.
    warnings : tuple of str
        What the checks of the recordings said; each row of the table is marked with them.
    checks : tuple of Finding
        What holds the groups against each other, with the smallest change it would have seen.

    Examples
    --------
    >>> import armimpedance as ai
    >>> from manipulandum_sim.hand import simulate
    >>> levels = ["cocontraction_10", "cocontraction_30"]
    >>> session, _ = simulate("cocontraction", seed=1, sets=2, conditions=levels)
    >>> difference = ai.compare(session, permutations=99)
    >>> sorted(difference.to_frame()["matrix"].unique())
    ['all', 'inertia', 'stiffness', 'viscosity']
    """

    groups: tuple[ComparedGroup, ...]
    pairs: Sequence[Pair] = ()
    over_subjects: tuple[SubjectsChange, ...] = ()
    warnings: tuple[str, ...] = ()
    checks: tuple[Finding, ...] = ()

    @property
    def content(self) -> Content:
        """The rows and columns of DIFFERENCES.csv, marked where checks warned."""
        return comparison_content(self.pairs, self.over_subjects, self.warnings, self.checks)

    def to_dict(self) -> list[dict[str, Any]]:
        """One mapping per row of DIFFERENCES.csv."""
        return [dict(row) for row in self.content.rows]

    def __str__(self) -> str:
        """The tables that ``armimpedance compare`` prints."""
        subjects = self.over_subjects
        tables = subjects_text(subjects) if subjects else comparison_text(self.pairs)
        warnings = [fill(f"warning: {text}", TABLE_WIDTH) for text in self.warnings]
        seen = [check for check in self.checks if check.verdict == "ok"]
        return "\n\n".join([tables, *warnings, *("\n".join(checks_lines(seen)),) * bool(seen)])

    def _table(self) -> list[list[str]]:
        rows = [
            [f"{pair.first} | {pair.second}", *(f"{t.p_t2_adjusted:.3g}" for t in pair.tests)]
            for pair in self.pairs[:9]
        ]
        rows += [
            [f"{c.first} | {c.second}", f"{c.p_adjusted:.3g}"]
            for c in self.over_subjects
            if (c.matrix, c.quantity) == ("stiffness", "size")
        ]
        count = len(self.pairs) or len(rows)
        left = [["...", f"{count - 9} more"]] if count > 9 else []
        heads = ["M", "B", "K", "all"] if self.pairs else ["size of K"]
        return [["adjusted p", *heads], *rows[:9], *left]

    def __repr__(self) -> str:
        return "\n".join(f"{first}: {', '.join(others)}" for first, *others in self._table())

    def _repr_html_(self) -> str:
        table = self._table()
        return html_table([row + [""] * (len(table[0]) - len(row)) for row in table])
