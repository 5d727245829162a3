"""How far segments are from what was expected, as the data say: is a prior trusted too far?

Least squares give the base parameters b with the errors of the data, ``C_d``; a prior of relative
sd s expects ``b ~ N(b_0, s^2 C_1)``. So ``b - b_0`` has the covariance ``C_d + s^2 C_1``, and its
likelihood tells s (empirical Bayes). A prior that is told narrower than the data show would pull
the parameters away from them inside intervals that are too short.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.linalg import eigh
from scipy.optimize import minimize_scalar

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.findings import Finding
from armimpedance.joint.body.base_parameters import BaseParameters
from armimpedance.joint.body.parameters import pseudo_inertia_basis, pseudo_inertias

#: Twice the log-likelihood beyond which the told sd is contradicted: by chance once in a thousand.
_CONTRADICTED: Final = 10.8
#: The largest relative sd that is looked for.
_WIDEST: Final = 10.0


@dataclass(frozen=True)
class Trust:
    """The relative sd of a prior that was told, and what the data say of it.

    Attributes
    ----------
    told : float
    likely : float
        The one that makes the data most likely.
    against : float
        Twice the log-likelihood by which it beats what was told; 0 where it is smaller.
    informed : float
        How many parameters tell it.
    """

    told: float
    likely: float
    against: float
    informed: float

    @property
    def used(self) -> float:
        """The sd to work with: never narrower than told, since a narrow one may be chance."""
        return max(self.told, self.likely)

    @property
    def finding(self) -> Finding:
        """Whether the table of masses and inertias is as near as was told."""
        told, likely = f"{100 * self.told:.0f} %", f"{100 * self.likely:.0f} %"
        least = self.told * np.exp(np.sqrt(_CONTRADICTED / (2 * max(self.informed, 1e-9))))
        smallest = f"{100 * min(least, _WIDEST):.0f} %"
        if self.against <= _CONTRADICTED:
            said = f"the segments lie within the {told} of the prior (most likely {likely})"
            return Finding("table", "ok", said, smallest=smallest)
        return Finding(
            "table",
            "warning",
            f"the person's segments deviate from the table by some {likely}, the prior was told "
            f"{told}: it was trusted to {likely} only, and intervals allow for that",
            smallest=smallest,
        )


def trust_in_prior(
    base: BaseParameters,
    prior: FloatArray,
    values: FloatArray,
    covariance: FloatArray,
    told: float,
) -> Trust:
    """Hold the sd that a prior was told against base parameters that do not know of it.

    Parameters
    ----------
    base : BaseParameters
    prior : (p_i,)
        Inertial parameters of all segments.
    values, covariance : (b,), (b, b)
        Base parameters of least squares and the covariance of their errors.
    told : float
        Relative sd of the prior's masses.

    Returns
    -------
    Trust
    """
    p = len(prior)
    # what belongs to joint terms too has no prior
    rows = ~base.mapping[:, p:].any(axis=1)
    B = base.mapping[rows][:, :p]
    C_1 = B @ unit_covariance(prior) @ B.T
    away = values[rows] - B @ prior
    C_d = covariance[np.ix_(rows, rows)]
    scale = np.sqrt(np.diag(C_d))
    C_d = C_d / np.outer(scale, scale)
    # C_1 v = l C_d v: in these directions (r,) the data's errors are 1 and the prior's s^2 l
    spread, directions = eigh(C_1 / np.outer(scale, scale), C_d)
    squares = (directions.T @ (away / scale)) ** 2

    def deviance(log_s: float) -> float:
        total = 1 + np.exp(2 * log_s) * np.maximum(spread, 0.0)
        return float((squares / total + np.log(total)).sum())

    best = minimize_scalar(deviance, bounds=(np.log(told) - 4, np.log(_WIDEST)), method="bounded")
    part = told**2 * spread / (1 + told**2 * spread)
    likely = float(np.exp(best.x))
    against = deviance(float(np.log(told))) - float(best.fun) if likely > told else 0.0
    return Trust(told, likely, against, float((part**2).sum()))


def unit_covariance(prior: FloatArray) -> FloatArray:
    """Covariance (p_i, p_i) of inertial parameters whose masses are known to their own size.

    The inverse curvature of the divergence, of which a mass that is e times too large takes
    ``e^2 / 2``, with the weight ``1 / 4`` that `consistent.fit_consistent` gives it.

    Raises
    ------
    InputError
        A prior that is no rigid body's.
    """
    P = pseudo_inertias(prior)
    try:
        inverse = np.linalg.inv(np.linalg.cholesky(P))
    except np.linalg.LinAlgError:
        problem = "a segment of the skeleton has an inertia that no rigid body has"
        expected = "each principal inertia positive, and less than the two others together"
        raise InputError(problem, expected=expected) from None
    # d(C^-1 P C^-T) for each of the ten parameters of segment s, (s, 10, 4, 4)
    moved = inverse[:, None] @ pseudo_inertia_basis() @ np.swapaxes(inverse, 1, 2)[:, None]
    # H_s (10, 10) = tr(P^-1 D_i P^-1 D_j)
    H = np.einsum("siab,sjab->sij", moved, moved)
    C = np.zeros((len(prior), len(prior)))
    for s, block in enumerate(np.linalg.inv(H)):
        C[10 * s : 10 * s + 10, 10 * s : 10 * s + 10] = 4 * block
    return C
