"""Result of every stationary method: I, B, K of one joint, all positive."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.errors import EstimationError
from armimpedance.joint.elbow.elbow_result import NAMES
from armimpedance.numerics.regression import (
    Conditioning,
    Parameters,
    TrialEquations,
    conditioning,
    leave_one_out_shift,
    refuse_rank_loss,
    solve_equations,
    split_blocks,
)

# Linear equations in time order: nuisance terms removed, solved with instruments, in blocks.

#: Length of blocks that are independent (s): residuals are correlated over some tenths of a second.
BLOCK_S: Final = 1.0


@dataclass(frozen=True)
class Rows:
    """Equations of one trial: ``y = X p + e`` with instruments Z, in order of time.

    `X`, `Z` (S, p), `y` (S,).
    `seconds`: duration of the rows.
    """

    X: FloatArray
    Z: FloatArray
    y: FloatArray
    seconds: float


@dataclass(frozen=True, eq=False)
class Solved(FrozenRecord):
    """Parameters estimated from the rows of all trials.

    `parameters`: their covariance is clustered by blocks; the plain one takes residuals as
    independent.
    `n`: number of rows.
    `conditioning`: condition numbers of the regressors X.
    `moved` (T, p) or None: influence of each of T blocks on the parameters; ``moved^T moved`` is
    the covariance.
    """

    parameters: Parameters
    n: int
    conditioning: Conditioning
    moved: Annotated[FloatArray, "t p"] | None = None

    def transformed(
        self, values: FloatArray, D: FloatArray, names: tuple[str, ...], units: tuple[str, ...]
    ) -> Solved:
        """Other parameters (m,), by the delta method; D (m, p) is their derivative by the present
        ones.

        Raises EstimationError: a parameter or its covariance is not finite.
        """
        own, moved = self.parameters, self.moved
        plain = own.covariance if own.plain_covariance is None else own.plain_covariance
        # C (m, m) = D (m, p) C (p, p) D^T
        covariances = D @ own.covariance @ D.T, D @ plain @ D.T
        parameters = _finite(names, units, values, *covariances, own.dof)
        return replace(self, parameters=parameters, moved=None if moved is None else moved @ D.T)


def without(nuisance: FloatArray, *columns: FloatArray) -> list[FloatArray]:
    """Columns (S, ...) without the part that the nuisance columns (S, k) explain."""
    Q = np.linalg.qr(nuisance)[0]
    return [np.asarray(c - Q @ (Q.T @ c)) for c in columns]


def ramp(rows: int) -> FloatArray:
    """Regressors of offset and slope, (rows, 2)."""
    return np.column_stack([np.ones(rows), np.linspace(-1, 1, rows)])


def solve_rows(
    trials: Sequence[Rows], names: tuple[str, ...], units: tuple[str, ...] | None = None
) -> Solved:
    """Solve ``sum Z^T (y - X p) = 0`` over all trials, covariance clustered by blocks (CR3).

    With ``Z = X`` this is least squares.

    Raises NotIdentifiableError: X loses rank, or the instruments do not separate the parameters.
    Raises EstimationError: a parameter or its covariance is not finite.
    """
    X = np.concatenate([t.X for t in trials])
    state = conditioning(np.asarray(np.linalg.qr(X, mode="r")), len(X))
    refuse_rank_loss(state, names)
    A, b = [], []
    for trial in trials:
        for block in blocks(len(trial.y), trial.seconds):
            # A_t (p, p) = Z^T (p, S) X (S, p), b_t (p,) = Z^T (p, S) y (S,)
            A.append(trial.Z[block].T @ trial.X[block])
            b.append(trial.Z[block].T @ trial.y[block])
    units = ("",) * len(names) if units is None else units
    equations = TrialEquations(np.stack(A), np.stack(b), names, units)
    solution = solve_equations(equations, covariance="cr3")
    classical = _classical(trials, solution.parameters)
    moved = leave_one_out_shift(equations, solution.parameters)
    return Solved(
        _finite(names, units, solution.parameters, solution.covariance, classical, solution.dof),
        len(X),
        state,
        np.sqrt(1 - 1 / len(moved)) * moved,
    )


def blocks(rows: int, seconds: float) -> tuple[slice, ...]:
    """Split rows into blocks of a second or more, at least two."""
    return split_blocks(rows, min(int(np.ceil(rows * BLOCK_S / seconds)), rows // 2))


def _classical(trials: Sequence[Rows], parameters: FloatArray) -> FloatArray:
    """Covariance ``s^2 (Z^T X)^-1 Z^T Z (X^T Z)^-1`` (p, p) for independent residuals."""
    n, p = sum(len(t.y) for t in trials), len(parameters)
    squares = sum(float(((t.y - t.X @ parameters) ** 2).sum()) for t in trials)
    scale = np.sqrt(sum((t.X**2).sum(axis=0) for t in trials))
    across = sum(t.Z.T @ t.X for t in trials) / scale
    own = sum(t.Z.T @ t.Z for t in trials)
    # D (p, p) = (Z^T X)^-1, columns of X scaled
    D = np.linalg.inv(across) / scale[:, None]
    return np.asarray(squares / (n - p) * D @ own @ D.T)


def _finite(
    names: tuple[str, ...],
    units: tuple[str, ...],
    values: FloatArray,
    covariance: FloatArray,
    plain: FloatArray,
    dof: float,
) -> Parameters:
    """Return parameters with their clustered (CR3) and plain covariance, all finite.

    Raises EstimationError: a number is not finite.
    """
    if not all(np.isfinite(numbers).all() for numbers in (values, covariance, plain)):
        raise EstimationError("an estimate or its covariance is not finite")
    return Parameters(names, units, values, covariance, "cr3", dof, plain)


@dataclass(frozen=True, eq=False)
class Estimate(Solved):
    """I, B, K of one method.

    `parameters`, `n`, `conditioning`, `moved`: as in `Solved`; the parameters are I, B and K.
    `warnings`, `notes`: sentences for the user; notes are on effects that the intervals include.
    Raises EstimationError: one of the three is not positive.
    """

    details: Mapping[str, Any] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        values = self.parameters.values
        if not (values > 0).all():
            shown = ", ".join(f"{n} {v:.3g}" for n, v in zip(NAMES, values, strict=True))
            raise EstimationError(
                f"{shown}: a joint has positive ones; does the torque have the wrong sign "
                "(force_by), or does the joint not move?"
            )

    def widened(
        self,
        by: FloatArray,
        warnings: tuple[str, ...] = (),
        notes: tuple[str, ...] = (),
        **details: Any,
    ) -> Estimate:
        """Return the estimate with covariance increased by a possible error `by` (3,), and more
        sentences.
        """
        # A possible error d (3,) adds d d^T to the covariance C (3, 3)
        covariance = self.parameters.covariance + np.outer(by, by)
        return replace(
            self,
            parameters=replace(self.parameters, covariance=covariance),
            warnings=(*self.warnings, *warnings),
            notes=(*self.notes, *notes),
            details={**self.details, **details},
            moved=None,
        )


def estimate_of(solved: Solved, **details: Any) -> Estimate:
    """Return the estimate if the solved parameters are I, B, K themselves.

    Raises EstimationError: one is not positive.
    """
    return Estimate(solved.parameters, solved.n, solved.conditioning, solved.moved, details)
