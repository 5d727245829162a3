"""DIFFERENCES.csv: one row per pair of groups and quantity or test, or per quantity over subjects.

Angles in degrees, sd of a ratio as that of its logarithm; what does not exist stays empty.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Final, TypeVar

import numpy as np

from armimpedance.comparison import Change, MatrixTest, Pair, SubjectsChange

Row = dict[str, Any]
AnyChange = TypeVar("AnyChange", Change, SubjectsChange)

PAIR_COLUMNS: Final = (
    *("group_1", "group_2", "matrix", "quantity", "unit", "kind", "value_1", "value_2"),
    *("change", "ci_low", "ci_high", "sd", "dof", "p", "p_adjusted", "basis", "notes"),
)
SUBJECTS_COLUMNS: Final = (
    *("group_1", "group_2", "matrix", "quantity", "unit", "kind", "change", "ci_low", "ci_high"),
    *("between_sd", "ci_low_between_sd", "ci_high_between_sd", "n_subjects", "p", "p_adjusted"),
)
_ANGLES: Final = (
    *("first", "second", "value", "low", "high", "sd"),
    *("between_sd", "between_low", "between_high"),
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
        found = [_subjects_cells(in_degrees(change)) for change in over_subjects]
        return SUBJECTS_COLUMNS, [_known(row, SUBJECTS_COLUMNS) for row in found]
    rows: list[Row] = []
    for pair in pairs:
        head = {"group_1": pair.first, "group_2": pair.second, "basis": pair.basis}
        head["notes"] = "; ".join(pair.notes)
        rows += [{**head, **_change_cells(change)} for change in pair.changes]
        rows += [{**head, **cells} for test in pair.tests for cells in _test_cells(test)]
    return PAIR_COLUMNS, [_known(row, PAIR_COLUMNS) for row in rows]


def _known(row: Row, columns: Sequence[str]) -> Row:
    """The cells of a row in their order, None instead of a number that does not exist."""
    cells = {column: row.get(column) for column in columns}
    return {k: None if isinstance(v, float) and np.isnan(v) else v for k, v in cells.items()}


def in_degrees(change: AnyChange) -> AnyChange:
    """An orientation in degrees; anything else as it is."""
    if change.unit != "rad" or change.quantity != "orientation":
        return change
    turned: dict[str, Any] = {
        name: float(np.degrees(getattr(change, name)))
        for name in _ANGLES
        if isinstance(getattr(change, name, None), float)
    }
    return replace(change, unit="deg", **turned)


def _change_cells(given: Change) -> Row:
    change = in_degrees(given)
    return {
        "matrix": change.matrix,
        "quantity": change.quantity,
        "unit": change.unit,
        "kind": change.kind,
        "value_1": change.first,
        "value_2": change.second,
        "change": change.value,
        "ci_low": change.low,
        "ci_high": change.high,
        "sd": change.sd,
        "dof": change.dof,
    }


def _test_cells(test: MatrixTest) -> tuple[Row, Row]:
    head = {"matrix": test.matrix, "kind": "test"}
    return (
        {
            **head,
            "quantity": "distance",
            "change": test.distance,
            "p": test.p_distance,
            "p_adjusted": test.p_distance_adjusted,
        },
        {
            **head,
            "quantity": "t2",
            "change": test.t2,
            "p": test.p_t2,
            "p_adjusted": test.p_t2_adjusted,
        },
    )


def _subjects_cells(change: SubjectsChange) -> Row:
    return {
        "group_1": change.first,
        "group_2": change.second,
        "matrix": change.matrix,
        "quantity": change.quantity,
        "unit": change.unit,
        "kind": change.kind,
        "change": change.value,
        "ci_low": change.low,
        "ci_high": change.high,
        "between_sd": change.between_sd,
        "ci_low_between_sd": change.between_low,
        "ci_high_between_sd": change.between_high,
        "n_subjects": change.n,
        "p": change.p,
        "p_adjusted": change.p_adjusted,
    }
