"""One matrix over posture as a sum of squares: positive semidefinite by construction.

``K(u) = B(u)^T Q B(u)`` with ``Q >= 0`` is what muscles of nonnegative stiffness with polynomial
moment arms make, ``K_j = G^T K_m G`` (Tsuji (1997), eqs. (33)-(37)). The roughness of the moment
arms is charged, ``cost tr(D Q)`` (`posture_gram.roughness`); how much is chosen by what the
expected error of prediction is for each cost (C. L. Mallows, Technometrics 15 (1973), 661):

    misfit + 2 sigma^2 spent

with sigma^2 the mean square of the residuals of the roughest fit that is still charged, in units
of the standard errors where these are given, and then no less than 1.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from armimpedance.errors import InputError
from armimpedance.muscles.posture_certificate import coefficient_map
from armimpedance.muscles.posture_data import PostureData
from armimpedance.muscles.posture_fitted import FittedMatrix, Progress
from armimpedance.muscles.posture_gram import STRUCTURES
from armimpedance.muscles.posture_polynomial import checked_rank
from armimpedance.muscles.posture_program import GramProgram, GramSolution
from armimpedance.muscles.posture_tangent import Tangent, tangent
from armimpedance.muscles.posture_terms import exponents, term_names
from armimpedance.muscles.quality import correlation
from armimpedance.records import FloatArray
from armimpedance.regression.diagnose import Conditioning

#: What roughness may cost, in residual variances per unit of stiffness over residual sd.
PENALTIES = (0.0, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0)

#: Shuffles whose R is averaged: each is a new solution of the program.
_SHUFFLES = 20

#: Residuals below this part of the values are rounding, not noise.
_NO_NOISE = 1e-9


def sos_fit(
    structure: str,
) -> Callable[[PostureData, int, np.random.Generator, Progress], FittedMatrix]:
    """The fit with a structure of `STRUCTURES`."""

    def fit(
        data: PostureData, order: int, rng: np.random.Generator, progress: Progress
    ) -> FittedMatrix:
        """Sum of squares with the cost of roughness that promises the best prediction.

        Raises
        ------
        NotIdentifiableError
            The postures cannot tell all terms; names them.
        InputError
            Too few postures.
        EstimationError
            The solver did not end with an optimal solution.
        """
        return _fit(structure, data, order, rng, progress)

    return fit


@dataclass(frozen=True)
class _Candidate:
    """A cost of roughness with its solution."""

    penalty: float
    solution: GramSolution
    tangent: Tangent


def _fit(
    structure: str, data: PostureData, order: int, rng: np.random.Generator, progress: Progress
) -> FittedMatrix:
    powers = exponents(2 * order)
    program = GramProgram(STRUCTURES[structure](order), data.scaled, powers)
    state = _checked_rank(program, data, order)
    work = _Work(progress, len(PENALTIES) + data.n_rows + _SHUFFLES)
    unit = 1.0 if data.sd is not None else _noise(program, data)
    chosen = _choose(program, data, unit, work)
    covariance, dof = _covariance(chosen.tangent, data)
    return FittedMatrix(
        symbol=data.symbol,
        powers=powers,
        coefficients=chosen.solution.coefficients,
        covariance=covariance,
        dof=dof,
        held_out=_held_out(program, data, chosen.penalty * unit, work),
        null_r=_null_r(program, data, chosen.penalty * unit, rng, work),
        spent=tuple(float(n) for n in chosen.tangent.spent),  # type: ignore[arg-type]
        cond_scaled=state.cond_scaled,
        rank=state.rank,
        structure=structure,
        penalty=chosen.penalty,
        grams=program.grams(chosen.solution),
    )


class _Work:
    """Counts solutions for whoever wants to see progress."""

    def __init__(self, progress: Progress, total: int) -> None:
        self._progress, self._total, self._done = progress, total, 0

    def step(self) -> None:
        self._done += 1
        self._progress(self._done, self._total)


def _checked_rank(program: GramProgram, data: PostureData, order: int) -> Conditioning:
    """Worst condition of ss, se, ee, each over the terms that the structure has in it."""
    powers = exponents(2 * order)
    used = np.zeros((3, len(powers)), dtype=bool)
    for shape in program.shapes:
        used |= (coefficient_map(shape, powers) != 0).any(axis=(2, 3))
    names = np.array(term_names(powers))
    states = [checked_rank(program.X[:, u], tuple(names[u].tolist()), order) for u in used]
    most = int(used.sum(axis=1).max())
    if data.sd is None and data.n_rows <= most:
        raise InputError(
            f"{data.n_rows} postures for {most} coefficients of order {order}: none to spare to "
            "judge errors by",
            expected=f"{most + 1} postures or more, or standard errors",
        )
    return max(states, key=lambda s: (s.rank, s.cond_scaled))


def _noise(program: GramProgram, data: PostureData) -> float:
    """Standard deviation of residuals where none is given: of the fit without any cost."""
    free = program.solve(data.values, data.weights, 0.0)
    made = tangent(program, free, data.values, data.weights, 0.0)
    spare = max(data.values.size - float(made.spent.sum()), 1.0)
    least = _NO_NOISE * float(np.sqrt((data.values**2).mean()))
    return max(float(np.sqrt(made.misfit.sum() / spare)), least)


def _choose(program: GramProgram, data: PostureData, unit: float, work: _Work) -> _Candidate:
    candidates = []
    for penalty in PENALTIES:
        solution = program.solve(data.values, data.weights, penalty * unit)
        made = tangent(program, solution, data.values, data.weights, penalty * unit)
        candidates.append(_Candidate(penalty, solution, made))
        work.step()
    charged = candidates[1].tangent
    spare = max(data.values.size - float(charged.spent.sum()), 1.0)
    variance = float(charged.misfit.sum()) / spare
    if data.sd is not None:
        variance = max(variance, 1.0)
    return min(
        candidates,
        key=lambda c: float(c.tangent.misfit.sum() + 2 * variance * c.tangent.spent.sum()),
    )


def _covariance(made: Tangent, data: PostureData) -> tuple[FloatArray, float]:
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


def _held_out(program: GramProgram, data: PostureData, cost: float, work: _Work) -> FloatArray:
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
    program: GramProgram, data: PostureData, cost: float, rng: np.random.Generator, work: _Work
) -> FloatArray:
    """Mean R (4,) of ss, se, es, ee over shuffles of the rows, at the same cost."""
    found = np.zeros((_SHUFFLES, 4))
    for n in range(_SHUFFLES):
        mixed = data.shuffled(rng.permutation(data.n_rows))
        fitted = program.X @ program.solve(mixed.values, mixed.weights, cost).coefficients
        measured = mixed.measured.reshape(-1, 4)
        found[n] = [correlation(measured[:, i], fitted[:, j]) for i, j in enumerate((0, 1, 1, 2))]
        work.step()
    return np.asarray(found.mean(axis=0))
