"""What every stationary method returns, and the clusters that its covariance is made of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, Final

import numpy as np

from armimpedance.arrays import FloatArray
from armimpedance.elbow.result import NAMES
from armimpedance.errors import EstimationError
from armimpedance.regression import (
    Conditioning,
    TrialEquations,
    conditioning,
    leave_one_out_shift,
    refuse_rank_loss,
    solve_equations,
    split_blocks,
)

#: Rounds of instruments settle once no parameter moves by more than this part of itself ...
SETTLED: Final = 1e-6
#: ... or of its standard error, whichever is larger.
SETTLED_SD: Final = 1e-3

#: Residuals remember for some tenths of a second: blocks of this length are independent (s).
BLOCK_S: Final = 1.0


@dataclass(frozen=True)
class Estimate:
    """I, B, K of one method.

    Attributes
    ----------
    values : (3,)
    covariance, classical : (3, 3)
        Robust, clustered by blocks; and for independent residuals.
    dof : float
        Of the t distribution.
    n : int
        Rows.
    conditioning : Conditioning
        Of the regressors.
    details : mapping
    warnings : tuple of str
    moved : (T, 3), optional
        What each of T blocks moved; ``moved^T moved`` is the covariance.
    """

    values: FloatArray
    covariance: FloatArray
    classical: FloatArray
    dof: float
    n: int
    conditioning: Conditioning
    details: Mapping[str, Any] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    moved: FloatArray | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "details", MappingProxyType(dict(self.details)))
        if not (np.isfinite(self.values).all() and np.isfinite(self.covariance).all()):
            raise EstimationError("an estimate or its covariance is not finite")
        if not (np.asarray(self.values) > 0).all():
            shown = ", ".join(f"{n} {v:.3g}" for n, v in zip(NAMES, self.values, strict=True))
            raise EstimationError(
                f"{shown}: a joint has positive ones; does the torque have the wrong sign "
                "(force_by), or does the joint not move?"
            )


@dataclass(frozen=True)
class Rows:
    """Rows of one trial: ``y = X p + nuisance + e`` with instruments Z, in order of time.

    Attributes
    ----------
    X, Z : (S, p)
    y : (S,)
    seconds : float
        That the rows span.
    """

    X: FloatArray
    Z: FloatArray
    y: FloatArray
    seconds: float


@dataclass(frozen=True)
class Solved:
    """Parameters of pooled rows: robust and classical covariance, condition of the regressors.

    ``moved^T moved`` (p, T) (T, p) is the robust covariance: what each of T blocks moved.
    """

    parameters: FloatArray
    covariance: FloatArray
    classical: FloatArray
    dof: float
    n: int
    conditioning: Conditioning
    moved: FloatArray


def settled(solved: Solved, before: FloatArray) -> bool:
    """Whether a round of instruments moved I, B, K by less than matters."""
    sd = np.sqrt(np.diag(solved.covariance))
    allowed = np.maximum(SETTLED * np.abs(solved.parameters), SETTLED_SD * sd)
    return bool((np.abs(solved.parameters - before) <= allowed).all())


def estimate_of(solved: Solved) -> Estimate:
    """Where the parameters are I, B, K themselves.

    Raises
    ------
    EstimationError
        One is not positive, or nothing finite.
    """
    return Estimate(
        solved.parameters,
        solved.covariance,
        solved.classical,
        solved.dof,
        solved.n,
        solved.conditioning,
        moved=solved.moved,
    )


def without(nuisance: FloatArray, *columns: FloatArray) -> list[FloatArray]:
    """Columns (S, ...) less what the nuisance columns (S, k) explain of them."""
    Q = np.linalg.qr(nuisance)[0]
    return [np.asarray(c - Q @ (Q.T @ c)) for c in columns]


def ramp(rows: int) -> FloatArray:
    """Offset and slope, (rows, 2)."""
    return np.column_stack([np.ones(rows), np.linspace(-1, 1, rows)])


def solve_rows(trials: Sequence[Rows], names: tuple[str, ...]) -> Solved:
    """``sum Z^T (y - X p) = 0`` over all trials, covariance clustered by blocks (CR3).

    Least squares has ``Z = X``.

    Raises
    ------
    NotIdentifiableError
        X loses rank, or the instruments do not tell the parameters apart.
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
    equations = TrialEquations(np.stack(A), np.stack(b), names, ("",) * len(names))
    solution = solve_equations(equations, covariance="cr3")
    classical = _classical(trials, solution.parameters)
    moved = leave_one_out_shift(equations, solution.parameters)
    return Solved(
        solution.parameters,
        solution.covariance,
        classical,
        solution.dof,
        len(X),
        state,
        np.sqrt(1 - 1 / len(moved)) * moved,
    )


def blocks(rows: int, seconds: float) -> tuple[slice, ...]:
    """Blocks of a second or more, at least two."""
    return split_blocks(rows, min(int(np.ceil(rows * BLOCK_S / seconds)), rows // 2))


def _classical(trials: Sequence[Rows], parameters: FloatArray) -> FloatArray:
    """``s^2 (Z^T X)^-1 Z^T Z (X^T Z)^-1`` (p, p): residuals taken as independent."""
    n, p = sum(len(t.y) for t in trials), len(parameters)
    squares = sum(float(((t.y - t.X @ parameters) ** 2).sum()) for t in trials)
    scale = np.sqrt(sum((t.X**2).sum(axis=0) for t in trials))
    across = sum(t.Z.T @ t.X for t in trials) / scale
    own = sum(t.Z.T @ t.Z for t in trials)
    # D (p, p) = (Z^T X)^-1, columns of X scaled
    D = np.linalg.inv(across) / scale[:, None]
    return np.asarray(squares / (n - p) * D @ own @ D.T)
