"""One matrix over posture as a sum of squares: positive semidefinite by construction.

``K(u) = B(u)^T Q B(u)`` with ``Q >= 0`` is what muscles of nonnegative stiffness with polynomial
moment arms make, ``K_j = G^T K_m G`` (Tsuji (1997), eqs. (33)-(37)). The roughness of the moment
arms is charged, ``cost tr(D Q)`` (`gram.roughness`); how much is chosen by what the
expected error of prediction is for each cost (C. L. Mallows, Technometrics 15 (1973), 661):

    misfit + 2 sigma^2 spent

with sigma^2 the mean square of the residuals of the roughest fit that is still charged, in units
of the standard errors where these are given, and then no less than 1.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.progress import Progress, Steps
from armimpedance.muscles.models.fitted_model import correlation
from armimpedance.muscles.models.posture.certificate import exponents, term_names
from armimpedance.muscles.models.posture.data import FittedMatrix, PostureData
from armimpedance.muscles.models.posture.program import GramProgram, GramSolution, Tangent, tangent
from armimpedance.numerics.regression import Conditioning, conditioning, refuse_rank_loss

# Whether postures can tell the terms of a polynomial apart.


def checked_rank(X: FloatArray, names: tuple[str, ...], order: int) -> Conditioning:
    """Condition of a regressor X (P, p), refused where postures cannot tell its columns apart.

    Raises NotIdentifiableError: names the terms.
    Raises InputError: fewer postures than terms.
    """
    p, count = len(X), len(names)
    if p < count:
        # order L has (2 L + 1) (L + 1) coefficients
        fits = max(
            (lower for lower in range(order) if (2 * lower + 1) * (lower + 1) <= p), default=0
        )
        raise InputError(
            f"{p} postures for the {count} coefficients of order {order}: rank {p} at most for the "
            f"terms {', '.join(names)}",
            expected=f"{count} different postures or more, or order {fits}",
        )
    state = conditioning(np.asarray(np.linalg.qr(X, mode="r")), p)
    refuse_rank_loss(state, names)
    return state


#: What roughness may cost, in residual variances per unit of stiffness over residual sd.
PENALTIES = (0.0, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0)

#: Shuffles whose R is averaged: each is a new solution of the program.
_SHUFFLES = 20

#: Standard errors further apart than this: the solver would not see the largest ones' rows.
_WEIGHT_RANGE = 1e4

#: Residuals below this part of the values are rounding, not noise.
_NO_NOISE = 1e-9


@dataclass(frozen=True)
class PenaltyChoice:
    """A cost of roughness with its solution.

    `penalty`: one of `PENALTIES`.
    `cost`: the penalty as the program applies it. It is divided by a typical standard error, or
    multiplied by the residuals' standard deviation where no standard error is given. A penalty then
    means the same for all data.
    """

    penalty: float
    cost: float
    solution: GramSolution
    tangent: Tangent


def sos_fit(structure: str) -> Callable[..., FittedMatrix]:
    """The fit with a structure of `gram.STRUCTURES`: a `PostureMethod.fit`."""
    return partial(_fit, structure)


def _fit(
    structure: str,
    data: PostureData,
    order: int,
    rng: np.random.Generator,
    progress: Progress,
    judged: bool = True,
) -> FittedMatrix:
    """Sum of squares with the cost of roughness that promises the best prediction.

    Raises NotIdentifiableError: the postures cannot tell all terms; names them.
    Raises InputError: too few postures.
    Raises EstimationError: the solver did not end with an optimal solution.
    """
    program = GramProgram.of(structure, order, data.scaled)
    state = _checked_rank(program, data, order)
    _check_weights(data)
    work = Steps(progress, 1 + judged * (data.n_rows + _SHUFFLES))
    chosen = choose(program, data)
    work.step()
    covariance, dof = posterior(chosen.tangent, data)
    return FittedMatrix(
        symbol=data.symbol,
        powers=program.powers,
        coefficients=chosen.solution.coefficients,
        covariance=covariance,
        dof=dof,
        held_out=_held_out(program, data, chosen.cost, work) if judged else None,
        null_r=(_null_r(program, data, chosen.cost, rng, work) if judged else np.full(4, np.nan)),
        spent=tuple(float(n) for n in chosen.tangent.spent),  # type: ignore[arg-type]
        cond_scaled=state.cond_scaled,
        rank=state.rank,
        structure=structure,
        penalty=chosen.penalty,
        grams=program.grams(chosen.solution),
    )


def _check_weights(data: PostureData) -> None:
    low, high = float(data.weights.min()), float(data.weights.max())
    if high > _WEIGHT_RANGE * low:
        raise InputError(
            f"standard errors of {data.symbol} from {1 / high:.2g} to {1 / low:.2g}",
            expected=f"less than a factor of {_WEIGHT_RANGE:.0f} between them",
        )


def choose(program: GramProgram, data: PostureData) -> PenaltyChoice:
    """The penalty of `PENALTIES` whose expected error of prediction is least.

    Raises EstimationError: the solver did not end with an optimal solution.
    """
    free = _solved(program, data, 0.0, 0.0)
    if data.sd is None:
        unit = _noise(free.tangent, data)
    else:
        unit = float(np.sqrt((data.weights**2).mean()))
    charged = [_solved(program, data, penalty, penalty * unit) for penalty in PENALTIES[1:]]
    variance = _variance(charged[0].tangent, data)
    if data.sd is not None:
        variance = max(variance, 1.0)
    return min(
        (free, *charged),
        key=lambda c: float(c.tangent.misfit.sum() + 2 * variance * c.tangent.spent.sum()),
    )


def _solved(program: GramProgram, data: PostureData, penalty: float, cost: float) -> PenaltyChoice:
    solution = program.solve(data.values, data.weights, cost)
    made = tangent(program, solution, data.values, data.weights, cost)
    return PenaltyChoice(penalty, cost, solution, made)


def _variance(made: Tangent, data: PostureData) -> float:
    """Mean square of all residuals, over the numbers that are left to judge by."""
    return float(made.misfit.sum()) / max(data.values.size - float(made.spent.sum()), 1.0)


def _noise(made: Tangent, data: PostureData) -> float:
    """Standard deviation of the residuals of a fit, at least that of rounding."""
    least = _NO_NOISE * float(np.sqrt((data.values**2).mean()))
    return max(float(np.sqrt(_variance(made, data))), least)


def _checked_rank(program: GramProgram, data: PostureData, order: int) -> Conditioning:
    """Worst condition of ss, se, ee, each over the terms that the structure has in it."""
    used, names = program.used, np.array(term_names(exponents(2 * order)))
    states = [checked_rank(program.X[:, u], tuple(names[u].tolist()), order) for u in used]
    most = int(used.sum(axis=1).max())
    if data.sd is None and data.n_rows <= most:
        raise InputError(
            f"{data.n_rows} postures for {most} coefficients of order {order}: none to spare to "
            "judge errors by",
            expected=f"{most + 1} postures or more, or standard errors",
        )
    return max(states, key=lambda s: (s.rank, s.cond_scaled))


def posterior(made: Tangent, data: PostureData) -> tuple[FloatArray, float]:
    """Posterior covariance with each element's own residual variance, and degrees of freedom.

    With standard errors an element's variance is scaled only where its residuals are larger than
    they say.
    """
    spare = np.maximum(data.n_rows - made.spent, 1.0)
    excess = made.misfit / spare
    if data.sd is None:
        dof = float(spare.min())
    else:
        dof = float(spare.min()) if (excess > 1).any() else float("inf")
        excess = np.maximum(excess, 1.0)
    terms = len(made.covariance) // 3
    scale = np.repeat(np.sqrt(excess), terms)
    return made.covariance * np.outer(scale, scale), dof


def _held_out(program: GramProgram, data: PostureData, cost: float, work: Steps) -> FloatArray:
    """Predictions (P, 3) of each posture by a fit without it, at the same cost."""
    predicted = np.empty_like(data.values)
    for row in range(data.n_rows):
        weights = data.weights.copy()
        weights[row] = 0.0
        solution = program.solve(data.values, weights, cost)
        predicted[row] = program.X[row] @ solution.coefficients
        work.step()
    return predicted


def _null_r(
    program: GramProgram, data: PostureData, cost: float, rng: np.random.Generator, work: Steps
) -> FloatArray:
    """Mean R (4,) of ss, se, es, ee over shuffles of the rows, at the same cost."""
    correlations = np.zeros((_SHUFFLES, 4))
    for n in range(_SHUFFLES):
        mixed = data.shuffled(rng.permutation(data.n_rows))
        fitted = program.X @ program.solve(mixed.values, mixed.weights, cost).coefficients
        measured = mixed.measured.reshape(-1, 4)
        correlations[n] = [
            correlation(measured[:, i], fitted[:, j]) for i, j in enumerate((0, 1, 1, 2))
        ]
        work.step()
    return np.asarray(correlations.mean(axis=0))
