"""Postures and activations to predict at, and the table of what was predicted."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from armimpedance.conventions import element_names
from armimpedance.ellipses import NotPositiveDefiniteError, ellipse
from armimpedance.errors import InputError
from armimpedance.muscles.at_hand import HandPrediction
from armimpedance.muscles.prediction import JointPrediction
from armimpedance.outputs import staged_file
from armimpedance.records import FloatArray
from armimpedance.report.table_row import TableRow, table_rows

Cells = dict[str, Any]

#: (row-major elements) = (4, 3) (ss, se, ee)
_UNFOLD = np.array([[1, 0, 0], [0, 1, 0], [0, 1, 0], [0, 0, 1]], dtype=float)


def read_postures(path: str | Path) -> FloatArray:
    """Columns `q_shoulder_rad`, `q_elbow_rad` of a file, (P, 2).

    Raises
    ------
    InputError
        With file, row and column.
    """
    rows = table_rows(Path(path), "a table with q_shoulder_rad and q_elbow_rad")
    names = ("q_shoulder_rad", "q_elbow_rad")
    return np.array([[row.number(name) for name in names] for row in rows])


def read_activations(path: str | Path, muscles: int) -> FloatArray:
    """Columns `alpha_1 …` of a file, each 0..1, (P, muscles).

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


def write_predictions(predicted: JointPrediction | HandPrediction, path: str | Path) -> None:
    """Write one row per posture and activation, whole or not at all.

    Columns: `level`, the posture, `alpha_i` where the model has activations, `K_ij`, `B_ij` with
    `sd_` and 95 % limits `ci_low_`, `ci_high_`, the ellipses' `K_size, K_orientation_deg, K_shape`
    (of the hand: from the line shoulder to hand; of the joints: from the first axis) with limits,
    `extrapolated` (0 or 1) and `reason`. Where a matrix is not positive definite its ellipse stays
    empty.
    """
    joint = predicted.joint if isinstance(predicted, HandPrediction) else predicted
    rows = [
        {**_place(predicted, joint, p), **_matrices(predicted, p), **_trust(joint, p)}
        for p in range(len(joint.joint_angles))
    ]
    with staged_file(path) as staged, open(staged, "w", newline="", encoding="utf-8") as stream:
        table = csv.DictWriter(stream, list(rows[0]), lineterminator="\n")
        table.writeheader()
        table.writerows(rows)


def _place(predicted: JointPrediction | HandPrediction, joint: JointPrediction, p: int) -> Cells:
    hand = isinstance(predicted, HandPrediction)
    cells: Cells = {"level": "hand" if hand else "joint"}
    cells |= _named(("q_shoulder_rad", "q_elbow_rad"), joint.joint_angles[p])
    if isinstance(predicted, HandPrediction):
        cells |= _named(("hand_x_m", "hand_y_m"), predicted.hand_position[p])
    if joint.activation is not None:
        alpha = joint.activation[p]
        cells |= _named([f"alpha_{i}" for i in range(1, len(alpha) + 1)], alpha)
    return cells


def _matrices(predicted: JointPrediction | HandPrediction, p: int) -> Cells:
    cells: Cells = {}
    ellipses: Cells = {}
    reference = 0.0
    if isinstance(predicted, HandPrediction):
        reference = float(predicted.reference_angle_rad[p])
    for symbol, field in (("K", "stiffness"), ("B", "viscosity")):
        values = _UNFOLD @ getattr(predicted, field)[p]
        covariance = _UNFOLD @ getattr(predicted, f"{field}_covariance")[p] @ _UNFOLD.T
        half = _UNFOLD @ predicted.half_width(field)[p]
        names = element_names(symbol, 2)
        cells |= _named(names, values)
        cells |= _named([f"sd_{n}" for n in names], np.sqrt(np.maximum(np.diag(covariance), 0)))
        cells |= _named([f"ci_low_{n}" for n in names], values - half)
        cells |= _named([f"ci_high_{n}" for n in names], values + half)
        ellipses |= _ellipse(symbol, values, covariance, reference, predicted.dof)
    return {**cells, **ellipses}


def _ellipse(
    symbol: str, values: FloatArray, covariance: FloatArray, reference: float, dof: float
) -> Cells:
    names = [f"{symbol}_{name}" for name in ("size", "orientation_deg", "shape")]
    columns = [column for n in names for column in (n, f"ci_low_{n}", f"ci_high_{n}")]
    try:
        found = ellipse(
            values.reshape(2, 2), reference_angle_rad=reference, covariance=covariance, dof=dof
        )
    except NotPositiveDefiniteError:
        return dict.fromkeys(columns)
    middle = np.array([found.size, found.orientation_rad, found.shape])
    table = np.column_stack([middle, found.interval()])
    table[1] = np.degrees(table[1])
    return _named(columns, table.ravel())


def _trust(joint: JointPrediction, p: int) -> Cells:
    return {"extrapolated": int(joint.extrapolated[p]), "reason": joint.reasons[p]}


def _named(names: Sequence[str], values: FloatArray) -> Cells:
    return dict(zip(names, map(float, values), strict=True))


def joined(postures: FloatArray | None, activations: FloatArray | None) -> tuple[Any, Any]:
    """Postures and activations row by row; a single row goes with all rows of the other.

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
