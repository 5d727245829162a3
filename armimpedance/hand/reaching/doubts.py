"""What the data of one phase say against the model, and what it costs.

Two things are asked. Is anything left of the response to the pushes, once M, B and K have
described it? A reflex, a slack muscle or a wrong geometry leaves something; the intervals are then
widened. And is the inertia that was told the one that the pushes show? If not, it is not used.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.hand.reaching.equation import INERTIAL, N_UNKNOWN, STIFFNESS, Equations
from armimpedance.hand.reaching.solve import Known, Solution, solve

#: A doubt is told where chance alone would make it this seldom.
SELDOM: Final = 0.01


@dataclass(frozen=True)
class Doubted:
    """A solution with what speaks against it counted in."""

    solution: Solution
    warnings: tuple[str, ...]
    provenance: tuple[str, ...]


def doubts_of(equations: Equations, solution: Solution, known: Known | None) -> Doubted:
    """Ask both questions.

    Parameters
    ----------
    equations : Equations
    solution : Solution
        With the inertia as it is known, if it is.
    known : Known or None
    """
    warnings: list[str] = []
    provenance = ["inertia fitted to the pushes" if known is None else "inertia as told"]
    if known is not None:
        free = solve(equations)
        told = _against(free, known)
        provenance.append(_sensitivity(solution, free))
        if told < SELDOM:
            warnings.append(
                "the inertia that was told is not the one that the pushes show "
                f"(p = {told:.1g}): the pushes' own is used"
            )
            solution = free
    widened, excess, p = _widened(equations, solution)
    if p < SELDOM:
        warnings.append(
            f"M, B and K leave a response to the pushes (p = {p:.1g}), such as a reflex's: "
            f"intervals are {excess:.2g} times as wide"
        )
        solution = widened
    return Doubted(solution, tuple(warnings), tuple(provenance))


def _against(free: Solution, known: Known) -> float:
    """How often chance alone puts the two inertias this far apart."""
    from scipy.stats import f

    difference = free.theta[INERTIAL] - known.inertial
    C = free.covariance[INERTIAL, INERTIAL] + known.covariance
    # Hotelling: T^2 = d^T C^-1 d, (3,) (3, 3) (3,)
    squared = float(difference @ np.linalg.solve(C, difference))
    return float(f.sf(squared / 3, 3, free.dof))


def _sensitivity(with_it: Solution, free: Solution) -> str:
    K, own = with_it.theta[STIFFNESS], free.theta[STIFFNESS]
    percent = 100 * np.linalg.norm(K - own) / np.linalg.norm(K)
    return f"with the pushes' own inertia K would be {percent:.2g} % of itself elsewhere"


def _widened(equations: Equations, solution: Solution) -> tuple[Solution, float, float]:
    """The solution with intervals for what is left of the response; the factor, and p of none.

    The residuals' part that is linear in the d instruments, (d, R), whitened by W, is chi-square
    with ``d R - p`` degrees of freedom where the model holds; with W from few trials, near F.
    """
    from scipy.stats import f

    left = equations.along_direction(solution.residual)
    squared = float(np.sum((left @ solution.weight) * left))
    rows = solution.residual.shape[1]
    count = equations.instruments.shape[1]
    dof = count * rows - N_UNKNOWN
    trials = equations.trials - equations.nuisance.shape[1] - count
    # Hotelling's correction for a covariance of `rows` rows from few trials
    rest = max(trials - rows + 1, 4)
    ratio = squared / dof * rest / trials
    p = float(f.sf(ratio, dof, rest))
    excess = float(np.sqrt(max(squared / dof, 1.0)))
    covariance: FloatArray = solution.covariance * excess**2
    scatter: FloatArray = solution.scatter * excess**2
    return replace(solution, covariance=covariance, scatter=scatter), excess, p
