"""Joint-level rows from tables: RESULTS.csv of `map --to joint`, or a script's own."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from armimpedance.arrays import FloatArray
from armimpedance.errors import InputError
from armimpedance.files.table_row import TableRow, table_rows
from armimpedance.muscles import JointRows

_WHAT = "a table of joint-level rows (armimpedance map --to joint)"
_ACTIVATION = re.compile(r"alpha_(\d+)")


def read_joint_rows(paths: Sequence[str | Path]) -> JointRows:
    """Rows of one or more files, one after the other.

    Needed are `level` (joint), `q_shoulder_rad`, `q_elbow_rad`, `K_11 … K_22`, `B_11 … B_22`.
    Taken where every row has them: `sd_K_ij` and `sd_B_ij` (weights), `alpha_1 …` with
    `sd_alpha_1 …`, `torque_1_Nm` and `torque_2_Nm`; `muscles` names those of the activations.

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
    >>> from armimpedance.files import read_joint_rows
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
        if row.cells.get("K_33"):
            raise row.error(
                "three joints", "K_33", "two: shoulder and elbow; of more, Python makes JointRows"
            )
    muscles = _muscles(rows)
    angles = ("q_shoulder_rad", "q_elbow_rad")
    torque = ("torque_1_Nm", "torque_2_Nm")
    return JointRows(
        joint_angles=np.array([[row.angle(name) for name in angles] for row in rows]),
        stiffness=np.array([row.matrix("K", 2) for row in rows]),
        viscosity=np.array([row.matrix("B", 2) for row in rows]),
        stiffness_sd=_where_all(rows, "sd_K_11", lambda row: _sd(row, "sd_K")),
        viscosity_sd=_where_all(rows, "sd_B_11", lambda row: _sd(row, "sd_B")),
        activation=_where_all(rows, "alpha_1", lambda row: _activation(row, muscles)),
        activation_sd=_where_all(rows, "sd_alpha_1", lambda row: _activation_sd(row, muscles)),
        torque=_where_all(
            rows, "torque_1_Nm", lambda row: np.array([row.number(name) for name in torque])
        ),
        labels=tuple(_label(row) for row in rows),
        muscles=_names(rows),
    )


def _names(rows: Sequence[TableRow]) -> tuple[str, ...]:
    """The muscles' names, where the rows say them, the same in all."""
    said = [row.cells.get("muscles", "") for row in rows]
    named = next((names for names in said if names), "")
    for row, names in zip(rows, said, strict=True):
        if names != named:
            raise InputError(
                f"{names or 'no names'}, while other rows have {named}",
                file=row.file,
                row=row.line,
                column="muscles",
                expected="the same in every row or none in any",
            )
    return tuple(named.split("; ")) if named else ()


def _label(row: TableRow) -> str:
    condition = row.cells.get("condition")
    return f"{row.file.name} row {row.line}" + (f" ({condition})" if condition else "")


def _muscles(rows: Sequence[TableRow]) -> int:
    """The highest numbered `alpha_i` of all rows."""
    muscles = 0
    for row in rows:
        for name, text in row.cells.items():
            found = _ACTIVATION.fullmatch(name)
            if not found or not text:
                continue
            if len(found[1]) > 2:
                raise row.error("so many muscles", name, "alpha_1 to alpha_99, without a gap")
            muscles = max(muscles, int(found[1]))
    return muscles


def _where_all(
    rows: Sequence[TableRow], column: str, read: Callable[[TableRow], FloatArray]
) -> FloatArray | None:
    """What every row has; None where none has it."""
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


def _sd(row: TableRow, symbol: str) -> FloatArray:
    sd = row.matrix(symbol, 2)
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
