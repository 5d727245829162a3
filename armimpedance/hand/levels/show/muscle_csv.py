"""Results at the muscle level as CSV: one row for each condition.

Sums over muscles in N m/rad (B: N m s/rad), single muscles in N/m (B: N s/m). `K_sum_ij` are the
elements of ``G^T K_m G``, which the joint stiffness determines; `K_<muscle>` stands only where it
determines a single one. `feasible_low_/high_` are the least and largest value among all muscle
stiffnesses that give the joint stiffness, `ci_low_/ci_high_` the 95 % limits of that range.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from armimpedance.core.errors import InputError
from armimpedance.hand.levels.muscle_map import MuscleEstimate
from armimpedance.hand.levels.muscle_share import Combination, FeasibleRange, MuscleShare
from armimpedance.hand.show.result_row import group_cells, require_results
from armimpedance.show.files import Content, in_one_cell, table_content, write_content

Cells = dict[str, Any]


def write_muscle_results(estimates: Sequence[MuscleEstimate], path: str | Path) -> None:
    """Write all rows through a temporary name; what is not known stays empty.

    Parameters
    ----------
    estimates : sequence of MuscleEstimate
    path : path
        Its ending decides the format, see `write_content`.

    Raises
    ------
    InputError
        Without estimates, or when a group's column is named like a column of the results.
    """
    require_results(estimates, path)
    write_content(muscles_content(estimates), path)


def muscles_content(estimates: Sequence[MuscleEstimate]) -> Content:
    """What a file holds of estimates of muscles.

    Parameters
    ----------
    estimates : sequence of MuscleEstimate

    Returns
    -------
    Content

    Raises
    ------
    InputError
        A group's column is named like a column of the results.
    """
    columns, rows = muscle_rows(estimates)
    groups = dict.fromkeys(name for one in estimates for name in group_cells(one.keys))
    keys = (*groups, "level", "method", "n_trials", "arm")
    return table_content(rows, columns, keys=keys)


def muscle_rows(estimates: Sequence[MuscleEstimate]) -> tuple[list[str], list[Cells]]:
    """The columns of the table, the group's first, and the cells of each row.

    Parameters
    ----------
    estimates : sequence of MuscleEstimate

    Returns
    -------
    columns : list of str
    rows : list of mappings from a column's name to a number, a text or None

    Raises
    ------
    InputError
        A group's column is named like a column of the results.
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
    known = [
        group | {name: _known(cell) for name, cell in row.items()}
        for group, row in zip(groups, rows, strict=True)
    ]
    return [*keys, *columns], known


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
    determined = {found.name: found for found in share.combinations}
    cells: Cells = {f"{symbol}_outside_se": share.outside_se}
    for name, found in determined.items():
        if name not in share.muscles:
            cells |= _combination_cells(f"{symbol}_sum_{name}", found)
            cells[f"ci_low_{symbol}_sum_{name}"] = found.low
            cells[f"ci_high_{symbol}_sum_{name}"] = found.high
    for reach in share.single:
        column = f"{symbol}_{reach.name}"
        cells |= _combination_cells(column, determined.get(reach.name))
        cells |= _range_cells(column, reach)
    for reach in share.groups:
        cells |= _range_cells(f"{symbol}_{reach.name}", reach)
    return cells


def _combination_cells(column: str, found: Combination | None) -> Cells:
    value, sd = (None, None) if found is None else (found.value, found.sd)
    return {column: value, f"sd_{column}": sd}


def _range_cells(column: str, reach: FeasibleRange) -> Cells:
    return {
        f"feasible_low_{column}": reach.low,
        f"feasible_high_{column}": reach.high,
        f"ci_low_{column}": reach.outer_low,
        f"ci_high_{column}": reach.outer_high,
    }


def _known(value: Any) -> Any:
    missing = value is None or (isinstance(value, float) and math.isnan(value))
    return None if missing else value
