"""Quantities derived from an estimate for all tables, and a row of RESULTS.csv."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterable, Mapping, Sized
from functools import cache
from typing import Any

import numpy as np
import pandas as pd

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.conventions import AXES, element_names, group_name
from armimpedance.core.described import cells
from armimpedance.core.errors import InputError
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.hand.ellipses import FIELDS, Ellipse, Ellipsoid, Which, ellipse_of, ellipsoid_of
from armimpedance.hand.levels import antisymmetric_part
from armimpedance.numerics.regression import t_factor
from armimpedance.show.files import IMPEDANCE_COLUMNS, QUALITY_COLUMNS, in_one_cell


def condition_of(estimate: ImpedanceEstimate) -> str:
    """Name of the group: the condition alone, or all columns by name.

    `estimate`: the estimate of the group.
    Returns: the name of the group.
    """
    return group_name(estimate.keys)


def is_recording_of_joints(estimate: ImpedanceEstimate) -> bool:
    """True if `position` and `force` are angle and torque.

    This is so if the device itself turned joints: then the level is joint from the start, and the
    estimate has neither a shoulder in the hand's frame nor an arm posture. An estimate that was
    mapped from the hand has the joint angles of the mapping.

    `estimate`: the estimate of a group.
    Returns: True if the device turned joints, False if the hand was moved.
    """
    mapped = estimate.joint_angles is not None or estimate.shoulder_m is not None
    return estimate.level == "joint" and not mapped


def half_widths(estimate: ImpedanceEstimate) -> FloatArray:
    """Half-widths of the 95 % intervals of M, B, K, (3, k, k).

    `estimate`: the estimate of a group, with k axes.
    Returns: (3, k, k) ndarray: the half-widths, in the units of the matrices.
    """
    return t_factor(estimate.dof) * estimate.sd


def antisymmetric(estimate: ImpedanceEstimate, symbol: str) -> tuple[float, float]:
    """Antisymmetric part ``(A_12 - A_21) / 2`` of a 2 x 2 matrix and its standard error.

    `estimate`: the estimate that holds the matrix; it has two axes.
    `symbol`: which matrix.
    Returns: `value`, `sd`: the antisymmetric part and its standard error, in the unit of the
    matrix.
    """
    part, row = antisymmetric_part(estimate), "MBK".index(symbol)
    return float(part.value[row, 0]), float(part.sd[row, 0])


def principal_values(estimate: ImpedanceEstimate, field: Which) -> tuple[FloatArray, FloatArray]:
    """Eigenvalues of the symmetric part, the largest first, and their 95 % half-widths, (k,) each.

    First order: ``dl = v^T dA v`` for the eigenvector v of l.

    Parameters
    ----------
    estimate : ImpedanceEstimate
        The estimate that holds the matrix, with k axes.
    field : {"inertia", "viscosity", "stiffness"}
        Which matrix.

    Returns
    -------
    values, half_widths : (k,) ndarray
        The eigenvalues and their half-widths, in the unit of the matrix.
    """
    k, i = estimate.k, FIELDS.index(field)
    matrix = getattr(estimate, field)
    values, vectors = np.linalg.eigh((matrix + matrix.T) / 2)
    weights = np.einsum("in,jn->nij", vectors, vectors).reshape(k, k * k)
    block = slice(i * k * k, (i + 1) * k * k)
    covariance = weights @ estimate.covariance[block, block] @ weights.T
    half = t_factor(estimate.dof) * np.sqrt(np.maximum(np.diag(covariance), 0.0))
    return values[::-1], half[::-1]


def ellipse_values(
    estimate: ImpedanceEstimate, field: Which, with_handle: bool = False
) -> dict[str, tuple[float, float, float]]:
    """Size, orientation_deg and shape as (value, low, high) at 95 %; empty without an ellipse.

    `estimate`: the estimate of the matrix.
    `field`: the matrix.
    `with_handle`: use the inertia as measured, with the mass between sensor and hand.
    Returns: under each of the three names its value and its lower and upper 95 % limit.
    """
    ellipse = ellipse_of(estimate, field, with_handle=with_handle)
    return {} if ellipse is None else limits_of(ellipse)


def limits_of(ellipse: Ellipse) -> dict[str, tuple[float, float, float]]:
    """Size, orientation_deg and shape of an ellipse with a covariance: value, low, high at 95 %."""
    values = np.array([ellipse.size, ellipse.orientation_rad, ellipse.shape])
    table = np.column_stack([values, ellipse.interval()])
    table[1] = np.degrees(table[1])
    names = ("size", "orientation_deg", "shape")
    return {n: (float(v), float(a), float(b)) for n, (v, a, b) in zip(names, table, strict=True)}


# Content of one row of RESULTS.csv: every quantity of an estimate under its column's name.
#
# The columns come in blocks, so that files that mix one, two and three axes keep them in order.

Cells = dict[str, Any]

#: Columns without numbers or matrix symbols in their names.
PLAIN_COLUMNS = frozenset(column.name for column in IMPEDANCE_COLUMNS)

_RESULT_COLUMN = re.compile(
    r"(position_\d_(m|rad)|force_\d_(N|Nm)|q_(shoulder|elbow|\d)_rad|torque_\d_Nm|(sd_)?alpha_\d+|shoulder_[xyz]_m"
    r"|((sd|ci_low|ci_high|efficiency)_)?[MBK]_\d\d|M_with_handle_\d\d"
    r"|((ci_low|ci_high)_)?[MBK]_(size|orientation_deg|shape|axis_[123])|(sd_)?[MBK]_antisymmetric"
    r"|[MBK]_axis_[123]_([xyz]|turn_deg))"
)


def is_result_column(name: str) -> bool:
    """True if a column of RESULTS.csv belongs to the result; the others are the group's."""
    return name in PLAIN_COLUMNS or _RESULT_COLUMN.fullmatch(name) is not None


def require_results(estimates: Sized, path: str | os.PathLike[str]) -> None:
    """Refuse to write a file without rows.

    Raises InputError: there are no estimates.
    """
    if not len(estimates):
        raise InputError("no results to write", file=path, expected="at least one estimate")


def check_group_columns(names: Iterable[str]) -> None:
    """Refuse group columns whose names RESULTS.csv needs for itself.

    `names`: the names of the group columns.
    Raises InputError: naming the column.
    """
    for name in names:
        if is_result_column(str(name)) or not str(name):
            raise InputError(
                "a group cannot be named like a column of the results",
                column=str(name) or "(no name)",
                expected="another name for the column",
            )


def group_cells(keys: Mapping[str, Any]) -> Cells:
    """Columns of the group as plain numbers and text; missing values are left out."""
    check_group_columns(keys)
    plain = {str(k): v.item() if isinstance(v, np.generic) else v for k, v in keys.items()}
    cells = {k: v for k, v in plain.items() if not (pd.api.types.is_scalar(v) and pd.isna(v))}
    return {k: v if type(v) in (int, float) else str(v) for k, v in cells.items()}


def quality_cells(estimate: ImpedanceEstimate) -> Cells:
    """Quality and degrees of freedom; None if unknown (no rows, rank 0, nan)."""
    return cells(QUALITY_COLUMNS, estimate)


def _without_nan(value: float | None) -> float | None:
    return None if value is None or np.isnan(value) else float(value)


def lower_triangle(covariance: FloatArray) -> list[float]:
    """Lower triangle with the diagonal, row by row."""
    return list(map(float, covariance[_below_diagonal(len(covariance))]))


@cache
def _below_diagonal(size: int) -> tuple[IntArray, IntArray]:
    """Rows and columns of the lower triangle with the diagonal."""
    rows, columns = np.tril_indices(size)
    return rows, columns


def shared_lists(estimate: ImpedanceEstimate) -> dict[str, list[float]]:
    """Errors of M, B, K that all rows share, a list for each cause."""
    return {name: error.tolist() for name, error in estimate.shared_errors.items()}


def row_blocks(estimate: ImpedanceEstimate) -> dict[str, Cells]:
    """One row of RESULTS.csv, block by block; unknown values are left out or None."""
    return {
        "group": group_cells(estimate.keys),
        "head": {
            "n_trials": int(estimate.quality.n_trials),
            "method": estimate.method,
            "level": estimate.level,
        },
        "place": _place_cells(estimate),
        "shoulder": _shoulder_cells(estimate),
        "matrices": _matrix_cells(estimate),
        "ellipses": _ellipse_cells(estimate),
        "antisymmetric": _antisymmetric_cells(estimate),
        "quality": quality_cells(estimate),
        "text": {
            "covariance": json.dumps(lower_triangle(estimate.covariance)),
            "shared_errors": json.dumps(shared_lists(estimate)) if estimate.shared_errors else None,
            "muscles": in_one_cell(estimate.muscles) or None,
            "warnings": in_one_cell(estimate.warnings),
            "provenance": in_one_cell(estimate.provenance),
        },
    }


def _numbered(template: str, values: FloatArray | None) -> Cells:
    return {template.format(i): float(v) for i, v in enumerate(() if values is None else values, 1)}


def _place_cells(estimate: ImpedanceEstimate) -> Cells:
    joints = is_recording_of_joints(estimate)
    angles = _numbered("q_{}_rad", estimate.joint_angles)
    if len(angles) == 2:
        angles = dict(zip(("q_shoulder_rad", "q_elbow_rad"), angles.values(), strict=True))
    return {
        **_numbered("position_{}_rad" if joints else "position_{}_m", estimate.position),
        **_numbered("force_{}_Nm" if joints else "force_{}_N", estimate.force),
        **angles,
        **_numbered("torque_{}_Nm", estimate.torque),
        **_numbered("alpha_{}", estimate.activation),
        **_numbered("sd_alpha_{}", estimate.activation_sd),
    }


def _shoulder_cells(estimate: ImpedanceEstimate) -> Cells:
    shoulder = () if estimate.shoulder_m is None else estimate.shoulder_m
    return {f"shoulder_{axis}_m": float(v) for axis, v in zip(AXES, shoulder, strict=False)}


def _matrix_cells(estimate: ImpedanceEstimate) -> Cells:
    values = np.stack([estimate.inertia, estimate.viscosity, estimate.stiffness])
    half = half_widths(estimate)
    cells = _elements("MBK", values)
    cells |= _elements(("M_with_handle",), estimate.inertia_with_handle)
    tables = {"sd_": estimate.sd, "ci_low_": values - half, "ci_high_": values + half}
    for prefix, table in tables.items():
        cells |= _elements([prefix + symbol for symbol in "MBK"], table)
    if estimate.efficiency is not None:
        cells |= _elements([f"efficiency_{symbol}" for symbol in "MBK"], estimate.efficiency)
    return cells


def _elements(symbols: Iterable[str], matrices: FloatArray | None) -> Cells:
    values = np.asarray(matrices)
    names = [name for symbol in symbols for name in element_names(symbol, values.shape[-1])]
    return dict(zip(names, map(float, values.ravel()), strict=True))


def _ellipse_cells(estimate: ImpedanceEstimate) -> Cells:
    cells: Cells = {}
    for field, symbol in zip(FIELDS, "MBK", strict=True):
        cells |= ellipse_cells(symbol, ellipse_values(estimate, field))
        if estimate.k == 3:
            cells |= ellipsoid_cells(symbol, ellipsoid_of(estimate, field))
    return cells


def ellipse_cells(symbol: str, found: Mapping[str, tuple[float, float, float]]) -> Cells:
    """Cells ``K_size, ci_low_K_size, …``; empty without an ellipse.

    The columns are in every file, so that a script finds them even without ellipses.
    """
    cells: Cells = {}
    for name in ("size", "orientation_deg", "shape"):
        column = f"{symbol}_{name}"
        columns = (column, f"ci_low_{column}", f"ci_high_{column}")
        cells |= dict(zip(columns, found.get(name, (None, None, None)), strict=True))
    return cells


def ellipsoid_cells(symbol: str, found: Ellipsoid | None) -> Cells:
    """Cells ``K_axis_1`` to ``K_axis_3``: half-axes with limits and directions; empty without one.

    ``K_size`` is the volume, ``K_axis_1_x`` and so on the direction (its largest component is
    positive), ``K_axis_1_turn_deg`` the angle by which it may turn towards either other axis
    (95 %); 90 if any direction is possible.
    """
    cells: Cells = {}
    names = [f"{symbol}_axis_{i}" for i in (1, 2, 3)]
    limits = np.full((4, 2), np.nan) if found is None else found.interval()
    for i, name in enumerate((*names, f"{symbol}_size")):
        value = np.nan if found is None else float(np.append(found.semi_axes, found.size)[i])
        columns = (name, f"ci_low_{name}", f"ci_high_{name}")
        cells |= dict(zip(columns, map(_without_nan, (value, *limits[i].tolist())), strict=True))
    for i, name in enumerate(names):
        direction, turn = np.full(3, np.nan), np.nan
        if found is not None:
            direction, turn = (
                found.directions[i],
                float(np.degrees(found.turns_of(i).max())),
            )
        cells |= {
            f"{name}_{axis}": _without_nan(float(x))
            for axis, x in zip(AXES, direction, strict=True)
        }
        cells[f"{name}_turn_deg"] = _without_nan(turn)
    return cells


def _antisymmetric_cells(estimate: ImpedanceEstimate) -> Cells:
    cells: Cells = {}
    if estimate.k == 2:
        part = antisymmetric_part(estimate)
        for symbol, value, sd in zip("MBK", part.value[:, 0], part.sd[:, 0], strict=True):
            cells |= {f"{symbol}_antisymmetric": float(value)}
            cells |= {f"sd_{symbol}_antisymmetric": float(sd)}
    return cells
