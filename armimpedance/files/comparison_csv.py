"""DIFFERENCES.csv: one row per pair of groups and quantity or test, or per quantity over subjects.

Angles in degrees, sd of a ratio as that of its logarithm; what does not exist stays empty.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from armimpedance.comparison import Pair, SubjectsChange
from armimpedance.files.tables import table_content
from armimpedance.files.written.content import About, Content, Quantity
from armimpedance.files.written.words import meaning_of
from armimpedance.findings import Finding

Row = dict[str, Any]

PAIR_COLUMNS: Final = (
    *("group_1", "group_2", "matrix", "quantity", "unit", "kind", "value_1", "value_2"),
    *("change", "ci_low", "ci_high", "sd", "dof", "p", "p_adjusted", "basis", "notes"),
)
SUBJECTS_COLUMNS: Final = (
    *("group_1", "group_2", "matrix", "quantity", "unit", "kind", "change", "ci_low", "ci_high"),
    *("between_sd", "ci_low_between_sd", "ci_high_between_sd", "n_subjects", "p", "p_adjusted"),
)


def comparison_rows(
    pairs: Sequence[Pair], over_subjects: Sequence[SubjectsChange] = ()
) -> tuple[tuple[str, ...], list[Row]]:
    """The columns and rows of DIFFERENCES.csv; None where a number does not exist.

    Tests are rows of kind "test": quantity "distance" (`change` is the affine-invariant distance)
    or "t2" (`change` is Hotelling's T2), with `p` and `p_adjusted`.

    Parameters
    ----------
    pairs : sequence of Pair
        Every change and test of each pair is a row.
    over_subjects : sequence of SubjectsChange
        Where there are any, the rows are these mean changes and the sd between subjects.

    Returns
    -------
    columns : tuple of str
    rows : list of mappings
    """
    if over_subjects:
        found = [_subjects_cells(change.in_degrees()) for change in over_subjects]
        return SUBJECTS_COLUMNS, [_known(row, SUBJECTS_COLUMNS) for row in found]
    rows: list[Row] = []
    for pair in pairs:
        head = {"group_1": pair.first, "group_2": pair.second, "basis": pair.basis}
        head["notes"] = "; ".join(pair.notes)
        rows += [{**head, **cells} for cells in (*_changes(pair), *_tests(pair))]
    return PAIR_COLUMNS, [_known(row, PAIR_COLUMNS) for row in rows]


def comparison_content(
    pairs: Sequence[Pair],
    over_subjects: Sequence[SubjectsChange] = (),
    warnings: Sequence[str] = (),
    checks: Sequence[Finding] = (),
) -> Content:
    """What a file holds of a comparison.

    Parameters
    ----------
    pairs, over_subjects
        As for `comparison_rows`.
    warnings : sequence of str
        Each row is marked with them.
    checks : sequence of Finding

    Returns
    -------
    Content
    """
    columns, rows = comparison_rows(pairs, over_subjects)
    if warnings:
        said = {"warnings": "; ".join(warnings)}
        columns, rows = (*columns, *said), [row | said for row in rows]
    about = About(checks=tuple(checks))
    return table_content(
        rows, columns, quantities=lambda: [_quantity(row) for row in rows], about=about
    )


def _quantity(row: Row) -> Quantity:
    """A change or a test as a row of the long table; what else is known of it stands beside it."""
    means = meaning_of(row["quantity"] or "")
    own = ("quantity", "change", "ci_low", "ci_high", "sd", "unit")
    keys = {name: row[name] for name in ("group_1", "group_2", "matrix", "kind")}
    return Quantity(
        keys,
        row["quantity"],
        f"{row['kind']} of {row['matrix']} {row['quantity']}",
        row["change"],
        row["ci_low"],
        row["ci_high"],
        row.get("sd"),
        # the sd of a ratio is that of its logarithm
        "1" if row["kind"] == "ratio" else row["unit"] or "",
        means.i,
        means.j,
        {name: cell for name, cell in row.items() if name not in own and name not in keys},
    )


def _known(row: Row, columns: Sequence[str]) -> Row:
    """The cells of a row in their order, None instead of a number that does not exist."""
    cells = {column: row.get(column) for column in columns}
    return {k: None if isinstance(v, float) and np.isnan(v) else v for k, v in cells.items()}


def _changes(pair: Pair) -> list[Row]:
    """The rows of a pair's changes."""
    shown = [change.in_degrees() for change in pair.changes]
    names = ("matrix", "quantity", "unit", "kind", "sd", "dof")
    return [
        {
            **{name: getattr(change, name) for name in names},
            "value_1": change.first,
            "value_2": change.second,
            "change": change.value,
            "ci_low": change.low,
            "ci_high": change.high,
        }
        for change in shown
    ]


def _tests(pair: Pair) -> list[Row]:
    """The rows of a pair's tests: the distance and T2 of each matrix."""
    rows: list[Row] = []
    for test in pair.tests:
        head = {"matrix": test.matrix, "kind": "test"}
        apart = {"change": test.distance, "p": test.p_distance}
        rows.append(
            {**head, "quantity": "distance", **apart, "p_adjusted": test.p_distance_adjusted}
        )
        t2 = {"quantity": "t2", "change": test.t2, "p": test.p_t2}
        rows.append({**head, **t2, "p_adjusted": test.p_t2_adjusted})
    return rows


def _subjects_cells(change: SubjectsChange) -> Row:
    names = ("matrix", "quantity", "unit", "kind", "between_sd", "p", "p_adjusted")
    return {
        **{name: getattr(change, name) for name in names},
        "group_1": change.first,
        "group_2": change.second,
        "change": change.value,
        "ci_low": change.low,
        "ci_high": change.high,
        "ci_low_between_sd": change.between_low,
        "ci_high_between_sd": change.between_high,
        "n_subjects": change.n,
    }
