"""Condition, rank and null space of a regressor, in terms of the names of its columns.

All follow from the triangle R (p, p) of W = Q R, whose columns are scaled to unit length first: a
unit of measurement must not decide what can be identified.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import NotIdentifiableError
from armimpedance.numerics.regression.factors import TrialFactors

#: A column belongs to a direction if its scaled weight is above this share of the largest.
_TAKES_PART = 0.05


@dataclass(frozen=True)
class NullDirection:
    """A combination of the columns that the data do not determine: ``W @ weights = 0``.

    `regressors`: the columns in it, the largest weight first.
    `weights` (p,): for the unscaled columns (SI); the largest scaled weight is 1.
    `sentence`: message for a user.
    """

    regressors: tuple[str, ...]
    weights: FloatArray
    sentence: str


@dataclass(frozen=True)
class Conditioning:
    """Singular values and directions of R (p, p) with unit columns.

    Attributes
    ----------
    scale : (p,)
        Lengths of the columns; 1 for a column of zeros.
    singular_values : (p,)
    directions : (p, p)
        Rows: right singular vectors of the scaled R.
    cond_raw, cond_scaled : float
    tolerance : float
        Singular values below this share of the largest count as zero.
    zero : (p,) bool
        Columns of zeros.
    """

    scale: FloatArray
    singular_values: FloatArray
    directions: FloatArray
    cond_raw: float
    cond_scaled: float
    tolerance: float
    zero: np.ndarray

    @property
    def rank(self) -> int:
        """Numerical rank."""
        floor = self.tolerance * self.singular_values[0]
        return int((self.singular_values > floor).sum())


def conditioning(triangle: FloatArray, n_rows: int) -> Conditioning:
    """Condition numbers and rank of W from its triangle R (p, p).

    The rank tolerance is ``10 p sqrt(n_rows) eps``: well above the rounding of an orthogonal
    factorisation of that many rows, far below the 1e-10 of the hardest certified polynomial.

    Parameters
    ----------
    triangle : (p, p)
        R of W = Q R.
    n_rows : int
        Rows of W.

    Returns
    -------
    Conditioning
        Singular values of W with columns of unit length, condition numbers, and the rank tolerance.
    """
    lengths = np.linalg.norm(triangle, axis=0)
    scale = np.where(lengths > 0, lengths, 1.0)
    _, s, directions = np.linalg.svd(triangle / scale)
    raw = np.asarray(np.linalg.svd(triangle, compute_uv=False))
    p = len(triangle)
    return Conditioning(
        scale=scale,
        singular_values=s,
        directions=directions,
        cond_raw=_ratio(raw),
        cond_scaled=_ratio(s),
        tolerance=10.0 * p * np.sqrt(max(n_rows, p)) * np.finfo(np.float64).eps,
        zero=lengths == 0,
    )


def null_space(factors: TrialFactors) -> tuple[NullDirection, ...]:
    """Combinations of named columns that the data do not determine; empty at full rank.

    Columns of zeros come first, one direction each; the others are combined so that each
    direction has a column of its own.
    """
    p = factors.n_regressors
    triangle = np.asarray(np.linalg.qr(factors.r[:, :, :p].reshape(-1, p), mode="r"))
    return null_directions(conditioning(triangle, int(factors.rows.sum())), factors.regressors)


def null_directions(state: Conditioning, names: tuple[str, ...]) -> tuple[NullDirection, ...]:
    """The directions of `null_space`, from a `Conditioning`."""
    directions = []
    for j in np.flatnonzero(state.zero):
        weights = np.zeros(len(names))
        weights[j] = 1.0
        directions.append(NullDirection((names[j],), weights, f"the column {names[j]} is zero"))
    null = state.directions[state.rank :].copy()
    null[:, state.zero] = 0.0
    for row in _simple_basis(null, len(null) - len(directions)):
        involved = _involved(row, names)
        weights = row / state.scale
        text = f"the columns {', '.join(involved)} are linearly dependent"
        directions.append(NullDirection(involved, weights / np.abs(row).max(), text))
    return tuple(directions)


def refuse_rank_loss(state: Conditioning, names: tuple[str, ...]) -> None:
    """Raise `NotIdentifiableError` naming the columns if the rank is not full.

    Parameters
    ----------
    state : Conditioning
    names : tuple of p str
    """
    if state.rank == len(names):
        return
    directions = null_directions(state, names)
    zero = [name for name, is_zero in zip(names, state.zero, strict=True) if is_zero]
    sentences = [d.sentence for d in directions if d.regressors[0] not in zero]
    if zero:
        is_or_are = "column {} is" if len(zero) == 1 else "columns {} are"
        sentences.insert(0, f"the {is_or_are.format(', '.join(zero))} zero")
    involved = {name for d in directions for name in d.regressors}
    raise NotIdentifiableError(
        f"not identifiable (rank {state.rank} of {len(names)}): {'; '.join(sentences)}",
        parameters=tuple(name for name in names if name in involved),
    )


def conditioning_warnings(
    state: Conditioning, names: tuple[str, ...], warn_cond: float
) -> tuple[str, ...]:
    """One sentence per direction that is nearly lost: scaled condition above `warn_cond`."""
    weak = state.singular_values < state.singular_values[0] / warn_cond
    return tuple(
        f"nearly dependent columns: {', '.join(_involved(row, names))} "
        f"(scaled condition number {state.singular_values[0] / s:.1e})"
        for s, row in zip(state.singular_values[weak], state.directions[weak], strict=True)
    )


def _ratio(singular_values: FloatArray) -> float:
    smallest = singular_values[-1]
    return float(singular_values[0] / smallest) if smallest > 0 else float("inf")


def _involved(direction: FloatArray, names: tuple[str, ...]) -> tuple[str, ...]:
    size = np.abs(direction)
    order = np.argsort(-size, kind="stable")
    return tuple(names[j] for j in order if size[j] > _TAKES_PART * size.max())


def _simple_basis(null: FloatArray, size: int) -> FloatArray:
    """Basis (size, p) of the rows of `null` that contains an identity, by pivoted elimination."""
    rows, remaining = null.copy(), list(range(len(null)))
    done: list[int] = []
    for _ in range(size):
        i, j = max(
            ((a, int(np.abs(rows[a]).argmax())) for a in remaining),
            key=lambda at: float(abs(rows[at[0], at[1]])),
        )
        rows[i] /= rows[i, j]
        others = [a for a in range(len(rows)) if a != i]
        rows[others] -= np.outer(rows[others, j], rows[i])
        remaining.remove(i)
        done.append(i)
    return rows[done]


# All clusters in the basis in which the pooled regressors are orthonormal.
#
# In that basis the pooled Gram matrix is the identity, so that Gram matrices of single clusters
# lose no accuracy, whatever the condition of the raw columns. Clusters are left out, weighted and
# summed there, and one triangular solve transforms the result back to SI.

#: Least share of the information about any direction that must remain without a cluster.
LEAST_INFORMATION = 1e-10


@dataclass(frozen=True)
class Pooled:
    """The least-squares solution over all clusters, and each cluster's contribution.

    `triangle` (p, p): R of the stacked W = Z R.
    `coefficients` (p, q): theta, SI.
    `residual_triangle` (q, q): triangle of the residuals E = Y - W Theta: ``E^T E`` is its cross
    product.
    `total_squares` (q,): sums of squares of Y: about the mean if the model has an intercept, else
    about zero.
    `gram` (T, p, p): ``Z_t^T Z_t``; they sum to the identity.
    `score` (T, p, q): ``Z_t^T E_t``; they sum to zero.
    """

    triangle: FloatArray
    coefficients: FloatArray
    residual_triangle: FloatArray
    total_squares: FloatArray
    gram: FloatArray
    score: FloatArray
    state: Conditioning

    def to_si(self, orthonormal: FloatArray) -> FloatArray:
        """Transform (p, n) from the orthonormal basis to SI: solve ``R x = z``."""
        scale = self.state.scale[:, None]
        # (R / scale) (p, p) (scale x) (p, n) = z (p, n)
        scaled = solve_triangular(self.triangle / self.state.scale, orthonormal, check_finite=False)
        return np.asarray(scaled / scale)


def pool(factors: TrialFactors) -> Pooled:
    """Solve over all clusters and express each in the pooled orthonormal basis.

    The solution is cached in the factors, which cannot change: fit, leave-one-out and bootstrap of
    the same clusters share it.

    Parameters
    ----------
    factors : TrialFactors

    Returns
    -------
    Pooled
        The coefficients of all clusters, and each cluster in the pooled orthonormal basis.

    Raises
    ------
    NotIdentifiableError
        The columns of W lose rank; names the regressors.
    """
    pooled: Pooled | None = getattr(factors, "_pooled", None)
    if pooled is None:
        pooled = _pool(factors)
        object.__setattr__(factors, "_pooled", pooled)
    return pooled


def _pool(factors: TrialFactors) -> Pooled:
    p, k = factors.n_regressors, factors.r.shape[1]
    stack = factors.r.reshape(-1, k)
    # [W Y] (T k, p + q) = [Z U] (T k, p + q) [[R, Z^T Y], [0, R_E]]
    basis, r = np.linalg.qr(stack)
    triangle, cross, residual = r[:p, :p], r[:p, p:], r[p:, p:]
    state = conditioning(triangle, int(factors.rows.sum()))
    refuse_rank_loss(state, factors.regressors)
    Z = basis[:, :p].reshape(-1, k, p)
    E = (basis[:, p:] @ residual).reshape(-1, k, k - p)
    Zt = Z.transpose(0, 2, 1)
    scaled = solve_triangular(triangle / state.scale, cross, check_finite=False)
    return Pooled(
        triangle=triangle,
        coefficients=scaled / state.scale[:, None],
        residual_triangle=residual,
        total_squares=_total_squares(factors, stack),
        gram=Zt @ Z,
        score=Zt @ E,
        state=state,
    )


def leave_out_scores(pooled: Pooled) -> FloatArray:
    """Change of the solution by each cluster, ``(I - G_t)^-1 s_t`` (T, p, q).

    Raises NotIdentifiableError: only one cluster informs some direction.
    """
    p = len(pooled.triangle)
    rest = np.eye(p) - pooled.gram
    # (I - G_t) (p, p) d_t (p, q) = s_t (p, q), for all t
    moved, pivot = solve_positive(np.moveaxis(rest, 0, -1), np.moveaxis(pooled.score, 0, -1))
    if (pivot < LEAST_INFORMATION).any():
        alone = int(np.argmin(pivot))
        raise NotIdentifiableError(
            f"without cluster {alone} (counted from 0) the others do not identify the parameters"
        )
    return np.moveaxis(moved, -1, 0)


def solve_positive(A: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Solve many small positive definite systems at once by Cholesky elimination.

    The systems are along the **last** axis, so that each step is one long vector operation: for
    1,000 systems of 6 unknowns several times faster than one library call per system.

    `A` (p, p, n), `b` (p, q, n).
    Returns: `x` (p, q, n): meaningless where the pivot is not positive, but finite.
    `pivot` (n,): smallest pivot of each elimination; zero at rank loss.
    """
    p = len(A)
    A, x = A.copy(), b.copy()
    smallest = np.full(A.shape[2], np.inf)
    for j in range(p):
        smallest = np.minimum(smallest, A[j, j])
        pivot = np.where(A[j, j] > 0, A[j, j], 1.0)
        x[j] /= pivot
        A[j, j + 1 :] /= pivot
        below = A[j + 1 :, j]
        A[j + 1 :, j + 1 :] -= below[:, None] * A[j, None, j + 1 :]
        x[j + 1 :] -= below[:, None] * x[j]
    for j in range(p - 2, -1, -1):
        x[j] -= (A[j, j + 1 :, None] * x[j + 1 :]).sum(axis=0)
    return x, smallest


def _total_squares(factors: TrialFactors, stack: FloatArray) -> FloatArray:
    Y = stack[:, factors.n_regressors :]
    if factors.intercept is not None:
        constant = stack[:, factors.regressors.index(factors.intercept)]
        # in the factor this column no longer holds ones, but it spans the same direction
        Y = Y - np.outer(constant, constant @ Y) / (constant @ constant)
    return np.asarray((Y**2).sum(axis=0))
