"""Postures and activations to predict at, and the table of what was predicted."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.hand.ellipses import (
    Ellipsoid,
    NotPositiveDefiniteError,
    ellipse,
    ellipsoid_of_matrix,
)
from armimpedance.hand.show import Cells, ellipse_cells, ellipsoid_cells, limits_of
from armimpedance.muscles.models import HandPrediction, JointPrediction, Predicted
from armimpedance.muscles.show.rows_csv import posture_columns
from armimpedance.show.files import Content, TableRow, table_content, table_rows

_MATRICES: Final = (("K", "stiffness"), ("B", "viscosity"))


def read_postures(path: str | Path) -> FloatArray:
    """Columns `q_shoulder_rad`, `q_elbow_rad` of a file, (P, 2); `q_1_rad` to `q_n_rad`, (P, n).

    Parameters
    ----------
    path : path

    Returns
    -------
    (P, n)
        rad.

    Raises
    ------
    InputError
        With file, row and column.
    """
    rows = table_rows(Path(path), "a table with q_shoulder_rad and q_elbow_rad")
    names = posture_columns(rows[0])
    return np.array([[row.angle(name) for name in names] for row in rows])


def read_activations(path: str | Path, muscles: int) -> FloatArray:
    """Columns `alpha_1 …` of a file, each 0..1, (P, muscles).

    Parameters
    ----------
    path : path
    muscles : int
        Number of muscles.

    Returns
    -------
    (P, muscles)

    Raises
    ------
    InputError
        With file, row and column.
    """
    rows = table_rows(Path(path), f"a table with alpha_1 … alpha_{muscles}")
    return np.array([[_activation(row, i) for i in range(1, muscles + 1)] for row in rows])


def _activation(row: TableRow, muscle: int) -> float:
    name = f"alpha_{muscle}"
    alpha = row.number(name)
    if not 0 <= alpha <= 1:
        raise row.error(f"{alpha:g}", name, "0 to 1 (1 is the maximum voluntary contraction)")
    return alpha


def predictions_content(predicted: JointPrediction | HandPrediction) -> Content:
    """What a file holds of predictions: one row per posture and activation.

    Columns: `level`, the posture, `alpha_i` where the model has activations, `K_ij`, `B_ij` with
    `sd_` and 95 % limits `ci_low_`, `ci_high_`, the ellipses' `K_size, K_orientation_deg, K_shape`
    (of the hand: from the line shoulder to hand; of the joints: from the first axis) with limits,
    `extrapolated` (0 or 1) and `reason`. Of three axes the ellipsoid: `K_axis_1` and so on with
    their directions, `K_size` the volume. Where a matrix is not positive definite its ellipse stays
    empty.

    Parameters
    ----------
    predicted : JointPrediction or HandPrediction

    Returns
    -------
    Content
    """
    parts = (
        predicted.place,
        *(predicted.matrix_rows(symbol) for symbol, _ in _MATRICES),
        *(_ellipse_rows(predicted, symbol, field) for symbol, field in _MATRICES),
        predicted.flags,
    )
    rows: list[Cells] = []
    for own in zip(*parts, strict=True):
        rows.append({name: cell for part in own for name, cell in part.items()})
    places = dict.fromkeys(name for place in predicted.place for name in place)
    return table_content(rows, keys=(*places, "extrapolated"))


def _ellipse_rows(predicted: Predicted, symbol: str, field: str) -> list[Cells]:
    """Ellipses of one matrix with their limits, one mapping per row; empty where there is none."""
    matrices = getattr(predicted, f"{field}_matrices")
    reference = np.zeros(len(matrices))
    if isinstance(predicted, HandPrediction):
        reference = predicted.reference_angle_rad
    covariance = predicted.element_covariance(field)
    k = matrices.shape[-1]
    if k == 3:
        return [
            ellipse_cells(symbol, {}) | ellipsoid_cells(symbol, _ellipsoid(A, C, predicted.dof))
            for A, C in zip(matrices, covariance, strict=True)
        ]
    if k != 2:
        return [ellipse_cells(symbol, {}) for _ in matrices]
    rows = []
    for A, C, line in zip(matrices, covariance, reference, strict=True):
        try:
            found = ellipse(A, reference_angle_rad=line, covariance=C, dof=predicted.dof)
            rows.append(ellipse_cells(symbol, limits_of(found)))
        except NotPositiveDefiniteError:
            rows.append(ellipse_cells(symbol, {}))
    return rows


def _ellipsoid(A: FloatArray, covariance: FloatArray, dof: float) -> Ellipsoid | None:
    try:
        return ellipsoid_of_matrix(A, covariance, dof)
    except NotPositiveDefiniteError:
        return None


def joined(postures: FloatArray | None, activations: FloatArray | None) -> tuple[Any, Any]:
    """Postures and activations row by row; a single row goes with all rows of the other.

    Parameters
    ----------
    postures : (P, 2) or None
    activations : (A, m) or None

    Returns
    -------
    postures, activations : arrays of as many rows, or None as given

    Raises
    ------
    InputError
        Neither is one row, and they differ in number.
    """
    if postures is None or activations is None:
        return postures, activations
    p, a = len(postures), len(activations)
    if p != a and 1 not in (p, a):
        raise InputError(
            f"{p} postures and {a} activations",
            expected="as many of one as of the other, or a single row of one",
        )
    rows = max(p, a)
    return (
        np.broadcast_to(postures, (rows, postures.shape[1])),
        np.broadcast_to(activations, (rows, activations.shape[1])),
    )
