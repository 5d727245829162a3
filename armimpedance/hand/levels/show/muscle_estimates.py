"""Estimates at the muscle level as a result with its CSV and its text."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape
from math import floor, isnan, log10
from typing import Any, Final, overload

import numpy as np

from armimpedance.core.arrays import FrozenRecord
from armimpedance.core.conventions import group_name
from armimpedance.core.described import Meaning
from armimpedance.core.errors import InputError
from armimpedance.core.shown import fixed, html_table, with_half_width
from armimpedance.hand.levels.muscle_identifiable import Combination, FeasibleRange, MuscleShare
from armimpedance.hand.levels.muscle_map import MuscleEstimate
from armimpedance.hand.show.quantities import group_cells
from armimpedance.show.files import Content, WrittenResult, in_one_cell, table_content
from armimpedance.show.text import (
    TABLE_WIDTH,
    note_numbers,
    numbered_notes,
    short,
    table_by_condition,
)
from armimpedance.show.verbs.results import position_of

# Results at the muscle level as CSV: one row for each condition.
#
# Sums over muscles in N m/rad (B: N m s/rad), single muscles in N/m (B: N s/m). `K_sum_ij` are the
# elements of ``G^T K_m G``, which the joint stiffness determines; `K_<muscle>` exists only if it
# determines a single muscle. `feasible_low_/high_` are the least and largest value among all muscle
# stiffnesses that give the joint stiffness, `ci_low_/ci_high_` the 95 % limits of that range.

Cells = dict[str, Any]

#: Meanings of the columns, except K and B of muscles and their sums.
MUSCLE_COLUMNS: Final = {
    "arm": Meaning("arm whose moment arms were used"),
    "tension_{}_N": Meaning("tension of {}", "N"),
}


def muscles_content(estimates: Sequence[MuscleEstimate]) -> Content:
    """Content of a file of estimates of muscles.

    Raises InputError: a group's column is named like a column of the results.
    """
    columns, rows = muscle_rows(estimates)
    groups = dict.fromkeys(name for estimate in estimates for name in group_cells(estimate.keys))
    keys = (*groups, "level", "method", "n_trials", "arm")
    return table_content(rows, columns, keys=keys, described=MUSCLE_COLUMNS)


def muscle_rows(estimates: Sequence[MuscleEstimate]) -> tuple[list[str], list[Cells]]:
    """The columns of the table, the group's first, and the cells of each row.

    Raises InputError: a group's column is named like a column of the results.
    """
    groups = [group_cells(e.keys) for e in estimates]
    rows = [_cells(e) for e in estimates]
    columns = list(dict.fromkeys(name for row in rows for name in row))
    keys = list(dict.fromkeys(name for group in groups for name in group))
    for name in keys:
        if name in columns:
            raise InputError(
                "a group cannot be named like a column of the results",
                column=name,
                expected="another name for the column",
            )
    complete = [
        group | {name: _without_nan(cell) for name, cell in row.items()}
        for group, row in zip(groups, rows, strict=True)
    ]
    return [*keys, *columns], complete


def _cells(estimate: MuscleEstimate) -> Cells:
    angles = estimate.joint_angles
    named = ("shoulder", "elbow") if len(angles) == 2 else range(1, len(angles) + 1)
    tension = estimate.tension
    return {
        "n_trials": estimate.n_trials,
        "method": estimate.method,
        "level": "muscle",
        "arm": estimate.arm,
        **{f"q_{name}_rad": float(q) for name, q in zip(named, angles, strict=True)},
        **{
            f"tension_{name}_N": None if tension is None else float(tension[i])
            for i, name in enumerate(estimate.muscles)
        },
        **_share_cells("K", estimate.stiffness),
        **_share_cells("B", estimate.viscosity),
        "warnings": in_one_cell(estimate.warnings),
        "provenance": in_one_cell(estimate.provenance),
    }


def _share_cells(symbol: str, share: MuscleShare) -> Cells:
    determined = {combination.name: combination for combination in share.combinations}
    cells: Cells = {f"{symbol}_outside_se": share.outside_se}
    for name, combination in determined.items():
        if name not in share.muscles:
            cells |= _combination_cells(f"{symbol}_sum_{name}", combination)
            cells[f"ci_low_{symbol}_sum_{name}"] = combination.low
            cells[f"ci_high_{symbol}_sum_{name}"] = combination.high
    for reach in share.single:
        column = f"{symbol}_{reach.name}"
        cells |= _combination_cells(column, determined.get(reach.name))
        cells |= _range_cells(column, reach)
    for reach in share.groups:
        cells |= _range_cells(f"{symbol}_{reach.name}", reach)
    return cells


def _combination_cells(column: str, combination: Combination | None) -> Cells:
    value, sd = (None, None) if combination is None else (combination.value, combination.sd)
    return {column: value, f"sd_{column}": sd}


def _range_cells(column: str, reach: FeasibleRange) -> Cells:
    return {
        f"feasible_low_{column}": reach.low,
        f"feasible_high_{column}": reach.high,
        f"ci_low_{column}": reach.outer_low,
        f"ci_high_{column}": reach.outer_high,
    }


def _without_nan(value: Any) -> Any:
    missing = value is None or (isinstance(value, float) and math.isnan(value))
    return None if missing else value


#: Number of estimates in a short text.
_MOST_SHOWN: Final = 10


@dataclass(frozen=True, repr=False, eq=False)
class MuscleEstimates(WrittenResult, FrozenRecord, Sequence[MuscleEstimate]):
    """Estimates at the muscle level of several groups of trials.

    It is a sequence of `MuscleEstimate`; a group's name selects its estimate, for example
    ``muscles["relaxed"].stiffness.single``.
    """

    DESCRIBED = MUSCLE_COLUMNS

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

        Raises InputError: no group has this name, or several have; the message lists the names.
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
        """Columns and values of the written file, one row per group."""
        return muscles_content(self.estimates)

    def to_dict(self) -> list[dict[str, Any]]:
        """One mapping per group, with the columns of the written file."""
        return [dict(row) for row in self.content.rows]

    def _table(self) -> list[list[str]]:
        rows = [
            [name, ", ".join(f"{c.name} {c.value:.4g}" for c in e.stiffness.combinations)]
            for name, e in zip(self.names, self.estimates[:_MOST_SHOWN], strict=False)
        ]
        return [["group", "sums of stiffness (N m/rad)"], *rows]

    def _head(self) -> str:
        hidden = len(self) - _MOST_SHOWN
        more = f", {hidden} of them not shown" if hidden > 0 else ""
        arms = ", ".join(dict.fromkeys(e.arm for e in self.estimates))
        return f"{len(self)} estimates of the muscles of {arms}{more}"

    def __repr__(self) -> str:
        return "\n".join([self._head(), *(f"{name}: {sums}" for name, sums in self._table()[1:])])

    def _repr_html_(self) -> str:
        return f"<p>{escape(self._head())}</p>{html_table(self._table())}"


# Results at the muscle level as text for a terminal of 100 columns.

#: Columns of one table, apart from the condition.
_MOST_COLUMNS = 6
_HEADING = 12
_MATRICES = (("K", "stiffness", "N m/rad"), ("B", "viscosity", "N m s/rad"))
#: Field and part of an estimate, and a description of its ranges.
_RANGES = (
    ("stiffness", "single", "stiffness of single muscles (N/m)"),
    ("stiffness", "groups", "parts of K by groups of muscles (N m/rad)"),
    ("viscosity", "single", "viscosity of single muscles (N s/m)"),
    ("viscosity", "groups", "parts of B by groups of muscles (N m s/rad)"),
)
_SUMS = (
    "Identifiable: sums over all muscles of moment arm i x moment arm j x stiffness (or viscosity) "
    "for the joints i, j (s shoulder, e elbow); ± is the half-width of the 95 % interval. se is a "
    "sum over the two-joint muscles alone."
)
_LEGEND = (
    "Three sums do not tell more than three muscles apart. A range runs from the least to the "
    "largest value of all stiffnesses >= 0 that give the joint's, with the 95 % limits that the "
    "joint's own error adds; the truth may lie anywhere in it. Tensions make the mean torque, with "
    "least effort or nearest to the EMG; least effort leaves out what opposing muscles add without "
    "torque, there and in the curvature term. The joints' own tissue counts as single-joint muscle."
)


def muscle_text(estimates: Sequence[MuscleEstimate]) -> str:
    """Identifiable sums, ranges of the others, tensions, notes.

    Returns: lines of at most 100 characters.
    """
    warnings = list(dict.fromkeys(w for e in estimates for w in e.warnings))
    blocks = [
        *_sums(estimates, warnings),
        *_determined(estimates),
        *_ranges(estimates),
        *_tensions(estimates),
        textwrap.fill(_LEGEND, TABLE_WIDTH),
    ]
    return "\n\n".join([*blocks, *numbered_notes(warnings)])


def _sums(estimates: Sequence[MuscleEstimate], warnings: list[str]) -> list[str]:
    notes = [note_numbers(e.warnings, warnings) for e in estimates]
    first = estimates[0]
    title = textwrap.fill(f"Muscle level, arm {first.arm}: {first.arm_source}", TABLE_WIDTH)
    blocks = [title, textwrap.fill(_SUMS, TABLE_WIDTH)]
    for symbol, field, unit in _MATRICES:
        elements = [_elements(e, field) for e in estimates]
        names = list(dict.fromkeys(name for sums in elements for name in sums))
        rows = [
            [*(_half_width(sums.get(name)) for name in names), note]
            for sums, note in zip(elements, notes, strict=True)
        ]
        header = [*(f"{symbol} {name}" for name in names), "notes"]
        blocks.append(_block(f"Sums of {field} ({unit})", estimates, header, rows))
    return blocks


def _elements(estimate: MuscleEstimate, field: str) -> dict[str, Combination]:
    """Determined sums that are elements of the joint matrix."""
    combinations: tuple[Combination, ...] = getattr(estimate, field).combinations
    return {c.name: c for c in combinations if c.name not in estimate.muscles}


def _half_width(combination: Combination | None) -> str:
    return (
        "-"
        if combination is None
        else with_half_width(combination.value, combination.high - combination.value)
    )


def _block(
    title: str, estimates: Sequence[MuscleEstimate], header: list[str], rows: list[list[str]]
) -> str:
    names = [group_name(e.keys) for e in estimates]
    return f"{title}\n{table_by_condition(names, header, rows)}"


def _determined(estimates: Sequence[MuscleEstimate]) -> list[str]:
    """Tables of single muscles that the joint matrix determines, if there are any."""
    tables = []
    for symbol, field, _ in _MATRICES:
        by_name = [{c.name: c for c in getattr(e, field).combinations} for e in estimates]
        names = [name for name in estimates[0].muscles if any(name in row for row in by_name)]
        for part in _parts(names):
            rows = [[_half_width(row.get(name)) for name in part] for row in by_name]
            unit = "N/m" if symbol == "K" else "N s/m"
            title = f"Identifiable: {field} of single muscles ({unit})"
            tables.append(_block(title, estimates, _headings(part), rows))
    return tables


def _ranges(estimates: Sequence[MuscleEstimate]) -> list[str]:
    tables = []
    for field, kind, what in _RANGES:
        reaches = [_undetermined(e, field, kind) for e in estimates]
        names = list(dict.fromkeys(name for reach in reaches for name in reach))
        for part in _parts(names):
            rows = [[_range(reach.get(name)) for name in part] for reach in reaches]
            title = f"Not identifiable: {what}, 95 % limits of the feasible range"
            tables.append(_block(title, estimates, _headings(part), rows))
    return tables


def _undetermined(estimate: MuscleEstimate, field: str, kind: str) -> dict[str, FeasibleRange]:
    ranges: tuple[FeasibleRange, ...] = getattr(getattr(estimate, field), kind)
    return {reach.name: reach for reach in ranges if not reach.determined}


def _tensions(estimates: Sequence[MuscleEstimate]) -> list[str]:
    tables = []
    for part in _parts(list(estimates[0].muscles)):
        rows = []
        for e in estimates:
            tensions = dict(zip(e.muscles, e.tension, strict=True)) if e.tension is not None else {}
            rows.append([fixed(tensions[name], 1) if name in tensions else "-" for name in part])
        title = "Tensions from static optimisation (N)"
        tables.append(_block(title, estimates, _headings(part), rows))
    return tables


def _parts(names: list[str]) -> list[list[str]]:
    return [names[i : i + _MOST_COLUMNS] for i in range(0, len(names), _MOST_COLUMNS)]


def _headings(names: Sequence[str]) -> list[str]:
    return [short(name, _HEADING) for name in names]


def _range(reach: FeasibleRange | None) -> str:
    if reach is None or isnan(reach.outer_low):
        return "-"
    # three digits of the larger limit
    size = max(abs(reach.outer_low), abs(reach.outer_high))
    decimals = 2 - floor(log10(size)) if size > 0 else 0
    return f"{fixed(reach.outer_low, decimals)} to {fixed(reach.outer_high, decimals)}"
