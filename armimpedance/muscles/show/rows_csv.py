"""Joint-level rows and predictions as tables in CSV."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.described import Meaning
from armimpedance.core.errors import InputError
from armimpedance.hand.ellipses import (
    Ellipsoid,
    NotPositiveDefiniteError,
    ellipse,
    ellipsoid_of_matrix,
)
from armimpedance.hand.show import Cells, ellipse_cells, ellipsoid_cells, limits_of
from armimpedance.muscles.models import (
    HandPrediction,
    JointPrediction,
    JointRows,
    Predicted,
    angle_columns,
)
from armimpedance.show.files import Content, TableRow, of_one_cell, table_content, table_rows

_WHAT = "a table of joint-level rows (armimpedance map --to joint)"
_ACTIVATION = re.compile(r"alpha_(\d+)")


def read_joint_rows(paths: Sequence[str | Path]) -> JointRows:
    """Rows of one or more files, one after the other.

    Needed are `level` (joint), `q_shoulder_rad`, `q_elbow_rad`, `K_11 … K_22`, `B_11 … B_22`; of
    more joints `q_1_rad …` and all elements. An arm in space whose upper arm was kept from turning
    has four angles and the elements of three joints. Taken where every row has them: `sd_K_ij` and
    `sd_B_ij` (weights), `alpha_1 …` with `sd_alpha_1 …`, `torque_1_Nm …`; `muscles` names those of
    the activations.

    Parameters
    ----------
    paths : sequence of paths
        Files of joint-level rows, read one after the other.

    Returns
    -------
    JointRows
        The rows of all files.

    Raises
    ------
    InputError
        With file, row and column of what is missing or is not what it should be; also where some
        rows have standard errors or activations and others have none.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> from armimpedance.muscles.show import read_joint_rows
    >>> head = "level,q_shoulder_rad,q_elbow_rad,K_11,K_12,K_21,K_22,B_11,B_12,B_21,B_22"
    >>> with TemporaryDirectory() as folder:
    ...     file = Path(folder) / "joint.csv"
    ...     _ = file.write_text(f"{head}\\njoint,1.0,1.5,15,6,6,16,1,.4,.4,1\\n")
    ...     rows = read_joint_rows([file])
    >>> rows.stiffness.tolist()
    [[[15.0, 6.0], [6.0, 16.0]]]
    """
    rows = [row for path in paths for row in table_rows(Path(path), _WHAT)]
    for row in rows:
        if row.text("level") != "joint":
            expected = "joint; armimpedance map --to joint makes such rows"
            raise row.error(repr(row.text("level")), "level", expected)
    muscles = _muscles(rows)
    angles, moving = _joints(rows)
    r = len(moving)
    torque = [f"torque_{j}_Nm" for j in range(1, r + 1)]
    return JointRows(
        joint_angles=np.array([[row.angle(name) for name in angles] for row in rows]),
        stiffness=np.array([row.matrix("K", r) for row in rows]),
        viscosity=np.array([row.matrix("B", r) for row in rows]),
        stiffness_sd=_where_all(rows, "sd_K_11", lambda row: _sd(row, "sd_K", r)),
        viscosity_sd=_where_all(rows, "sd_B_11", lambda row: _sd(row, "sd_B", r)),
        activation=_where_all(rows, "alpha_1", lambda row: _activation(row, muscles)),
        activation_sd=_where_all(rows, "sd_alpha_1", lambda row: _activation_sd(row, muscles)),
        torque=_where_all(
            rows, "torque_1_Nm", lambda row: np.array([row.number(name) for name in torque])
        ),
        labels=tuple(_label(row) for row in rows),
        muscles=_names(rows),
        moving=moving,
        doubts=JointRows.doubts_in(
            warning for row in rows for warning in of_one_cell(row.cells.get("warnings"))
        ),
        **JointRows.shared_of([row.shared_errors(r) for row in rows], r),
    )


def _joints(rows: Sequence[TableRow]) -> tuple[tuple[str, ...], tuple[int, ...]]:
    """Columns of the angles, and which joints the matrices are of: the same in every row."""
    joints = [_joints_of(row) for row in rows]
    for row, one in zip(rows, joints, strict=True):
        if one != joints[0]:
            problem = f"{len(one[1])} of {len(one[0])} joints, while other rows have "
            first = f"{len(joints[0][1])} of {len(joints[0][0])}"
            raise row.error(problem + first, one[0][0], "the same joints in every row")
    return joints[0]


def _joints_of(row: TableRow) -> tuple[tuple[str, ...], tuple[int, ...]]:
    angles = posture_columns(row)
    n, measured = len(angles), 2
    while row.cells.get(f"K_{measured + 1}{measured + 1}"):
        measured += 1
    moving = JointRows.moving_of(n, measured)
    if moving is None:
        raise row.error(
            f"{measured} joints and {n} angles",
            f"K_{measured}{measured}",
            "as many, or three of an arm in space (four angles) whose elbow was held",
        )
    return angles, moving


def posture_columns(row: TableRow) -> tuple[str, ...]:
    """The columns of the joint angles: of shoulder and elbow, or ``q_1_rad`` and so on."""
    n = 0
    while row.cells.get(f"q_{n + 1}_rad"):
        n += 1
    return angle_columns(max(n, 2) if n else 2)


def _names(rows: Sequence[TableRow]) -> tuple[str, ...]:
    """The muscles' names, where the rows say them, the same in all."""
    texts = [row.cells.get("muscles", "") for row in rows]
    named = next((names for names in texts if names), "")
    for row, names in zip(rows, texts, strict=True):
        if names != named:
            raise InputError(
                f"{names or 'no names'}, while other rows have {named}",
                file=row.file,
                row=row.line,
                column="muscles",
                expected="the same in every row or none in any",
            )
    return of_one_cell(named)


def _label(row: TableRow) -> str:
    condition = row.cells.get("condition")
    return f"{row.file.name} row {row.line}" + (f" ({condition})" if condition else "")


def _muscles(rows: Sequence[TableRow]) -> int:
    """The highest numbered `alpha_i` of all rows."""
    muscles = 0
    for row in rows:
        for name, text in row.cells.items():
            match = _ACTIVATION.fullmatch(name)
            if not match or not text:
                continue
            if len(match[1]) > 2:
                raise row.error("so many muscles", name, "alpha_1 to alpha_99, without a gap")
            muscles = max(muscles, int(match[1]))
    return muscles


def _where_all(
    rows: Sequence[TableRow], column: str, read: Callable[[TableRow], FloatArray]
) -> FloatArray | None:
    """A column of all rows; None if no row has it."""
    having = [bool(row.cells.get(column)) for row in rows]
    if not any(having):
        return None
    if not all(having):
        without = rows[having.index(False)]
        raise InputError(
            "empty, while other rows have it",
            file=without.file,
            row=without.line,
            column=column,
            expected="it in every row or in none",
        )
    return np.array([read(row) for row in rows])


def _sd(row: TableRow, symbol: str, joints: int) -> FloatArray:
    sd = row.matrix(symbol, joints)
    for i, j in np.argwhere(sd <= 0):
        raise row.error(f"{sd[i, j]:g}", f"{symbol}_{i + 1}{j + 1}", "a standard error above 0")
    return sd


def _activation(row: TableRow, muscles: int) -> FloatArray:
    names = [f"alpha_{i}" for i in range(1, muscles + 1)]
    alpha = np.array([row.number(name) for name in names])
    for i in np.flatnonzero((alpha < 0) | (alpha > 1)):
        expected = "0 to 1 (1 is the maximum voluntary contraction)"
        raise row.error(f"{alpha[i]:g}", names[i], expected)
    return alpha


def _activation_sd(row: TableRow, muscles: int) -> FloatArray:
    return np.array([row.number(f"sd_alpha_{i}", low=0) for i in range(1, muscles + 1)])


# Postures and activations to predict at, and the table of what was predicted.

_MATRICES: Final = (("K", "stiffness"), ("B", "viscosity"))


def read_postures(path: str | Path) -> FloatArray:
    """Columns `q_shoulder_rad`, `q_elbow_rad` of a file, (P, 2); `q_1_rad` to `q_n_rad`, (P, n).

    Returns: (P, n): rad.
    Raises InputError: with file, row and column.
    """
    rows = table_rows(Path(path), "a table with q_shoulder_rad and q_elbow_rad")
    names = posture_columns(rows[0])
    return np.array([[row.angle(name) for name in names] for row in rows])


def read_activations(path: str | Path, muscles: int) -> FloatArray:
    """Columns `alpha_1 …` of a file, each 0..1, (P, muscles).

    `muscles`: number of muscles.
    Returns: (P, muscles).
    Raises InputError: with file, row and column.
    """
    rows = table_rows(Path(path), f"a table with alpha_1 … alpha_{muscles}")
    return np.array([[_activation_at(row, i) for i in range(1, muscles + 1)] for row in rows])


def _activation_at(row: TableRow, muscle: int) -> float:
    name = f"alpha_{muscle}"
    alpha = row.number(name)
    if not 0 <= alpha <= 1:
        raise row.error(f"{alpha:g}", name, "0 to 1 (1 is the maximum voluntary contraction)")
    return alpha


#: What the columns of a prediction are, beside those of an impedance.
PREDICTED: Final = {
    "extrapolated": Meaning("whether it lies outside of what was measured: 0 or 1"),
    "reason": Meaning("why it does"),
}


def predictions_content(predicted: JointPrediction | HandPrediction) -> Content:
    """The content of a file of predictions: one row per posture and activation.

    Columns: `level`, the posture, `alpha_i` where the model has activations, `K_ij`, `B_ij` with
    `sd_` and 95 % limits `ci_low_`, `ci_high_`, the ellipses' `K_size, K_orientation_deg, K_shape`
    (of the hand: from the line shoulder to hand; of the joints: from the first axis) with limits,
    `extrapolated` (0 or 1) and `reason`. Of three axes the ellipsoid: `K_axis_1` and so on with
    their directions, `K_size` the volume. Where a matrix is not positive definite its ellipse stays
    empty.
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
    return table_content(rows, keys=(*places, "extrapolated"), described=PREDICTED)


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
            ellipse_of_row = ellipse(A, reference_angle_rad=line, covariance=C, dof=predicted.dof)
            rows.append(ellipse_cells(symbol, limits_of(ellipse_of_row)))
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

    `postures` (P, 2) or None, `activations` (A, m) or None.
    Raises InputError: neither is one row, and they differ in number.
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
