"""Results at the muscle level as text for a terminal of 100 columns."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from math import floor, isnan, log10

from armimpedance.core.conventions import group_name
from armimpedance.hand.levels.muscle_map import MuscleEstimate
from armimpedance.hand.levels.muscle_share import Combination, FeasibleRange
from armimpedance.show.text import (
    TABLE_WIDTH,
    fixed,
    note_numbers,
    numbered_notes,
    short,
    table_by_condition,
    with_half_width,
)

#: Columns of one table beside the condition.
_MOST_COLUMNS = 6
_HEADING = 12
_MATRICES = (("K", "stiffness", "N m/rad"), ("B", "viscosity", "N m s/rad"))
#: Field and part of an estimate, and what its ranges are of.
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
    """What is identifiable, the ranges of what is not, tensions, notes.

    Parameters
    ----------
    estimates : sequence of MuscleEstimate

    Returns
    -------
    str
        Lines of at most 100 characters.
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
        found = [_elements(e, field) for e in estimates]
        names = list(dict.fromkeys(name for sums in found for name in sums))
        rows = [
            [*(_half_width(sums.get(name)) for name in names), note]
            for sums, note in zip(found, notes, strict=True)
        ]
        header = [*(f"{symbol} {name}" for name in names), "notes"]
        blocks.append(_block(f"Sums of {field} ({unit})", estimates, header, rows))
    return blocks


def _elements(estimate: MuscleEstimate, field: str) -> dict[str, Combination]:
    """The determined sums that are elements of the joint matrix."""
    found: tuple[Combination, ...] = getattr(estimate, field).combinations
    return {c.name: c for c in found if c.name not in estimate.muscles}


def _half_width(found: Combination | None) -> str:
    return "-" if found is None else with_half_width(found.value, found.high - found.value)


def _block(
    title: str, estimates: Sequence[MuscleEstimate], header: list[str], rows: list[list[str]]
) -> str:
    names = [group_name(e.keys) for e in estimates]
    return f"{title}\n{table_by_condition(names, header, rows)}"


def _determined(estimates: Sequence[MuscleEstimate]) -> list[str]:
    """Single muscles that the joint matrix determines, where there are any."""
    tables = []
    for symbol, field, _ in _MATRICES:
        found = [{c.name: c for c in getattr(e, field).combinations} for e in estimates]
        names = [name for name in estimates[0].muscles if any(name in row for row in found)]
        for part in _parts(names):
            rows = [[_half_width(row.get(name)) for name in part] for row in found]
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
            found = dict(zip(e.muscles, e.tension, strict=True)) if e.tension is not None else {}
            rows.append([fixed(found[name], 1) if name in found else "-" for name in part])
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
    # three digits of the larger one
    size = max(abs(reach.outer_low), abs(reach.outer_high))
    decimals = 2 - floor(log10(size)) if size > 0 else 0
    return f"{fixed(reach.outer_low, decimals)} to {fixed(reach.outer_high, decimals)}"
