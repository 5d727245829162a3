"""Physically consistent parameters: every segment's pseudo-inertia is positive definite.

Minimise over the base parameters b and the unidentifiable parameters n, ``phi = lift(b) + N n``,

    1/2 |z - T b|^2 + gamma sum_s [ tr(P0_s^-1 P_s) - log det P_s ]

with P_s the pseudo-inertia of segment s and P0_s that of a prior. The bracket is the divergence of
one distribution of mass from another: it does not depend on the frame in which a segment is
described, and keeps P_s strictly positive definite (T. Lee, P. M. Wensing and F. C. Park, IEEE
Trans Robotics 36 (2020) 348-364). gamma is the weight of the prior. For gamma towards zero this is
the semidefinite program without a prior, approached along its central path, within ``4 s gamma`` of
its minimum plus the prior's own effect. Newton's method works on triangular factors, not on normal
equations, so a very small gamma causes no loss of accuracy.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np
from scipy.linalg import eigh, solve_triangular
from scipy.optimize import minimize_scalar

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.errors import EstimationError, InputError, check_number
from armimpedance.core.findings import Finding
from armimpedance.joint.body.base_parameters import BaseParameters
from armimpedance.joint.body.equations import BodyEquations
from armimpedance.joint.body.regressor import pseudo_inertia_basis, pseudo_inertias

#: Without a prior: excess over the minimum that is allowed, as a share of the residual squares,
_GAP: Final = 1e-9
#: and as a share of all squares (for exact data).
_LEAST_GAP: Final = 1e-22
_SHRINK: Final = 0.5
_MOST_STEPS: Final = 200
#: Limits of Newton's step in the metric of the segments' cones: on the way, and at the end.
_NEAR: Final = 1e-2
_SETTLED: Final = 1e-14
_ROUNDING: Final = 1e-6
_HALVINGS: Final = 60
_LONGEST: Final = 1e3


@dataclass(frozen=True)
class ConsistentFit(FrozenRecord):
    """Physically consistent parameters of every segment.

    `phi` (p,): inertial parameters, then joint terms.
    `base` (b,): its base parameters.
    `covariance` (p, p) or None: covariance of phi, from the curvature of data and prior together
    (Laplace); None without a prior, since the data do not determine all directions.
    `smallest_eigenvalue` (s,): smallest eigenvalue of each segment's pseudo-inertia, in units of
    the prior's; positive.
    """

    phi: Annotated[FloatArray, "p"]
    base: Annotated[FloatArray, "b"]
    covariance: Annotated[FloatArray, "p p"] | None
    smallest_eigenvalue: Annotated[FloatArray, "s"]
    gamma: float


def fit_consistent(
    equations: BodyEquations,
    base: BaseParameters,
    weights: FloatArray,
    prior: FloatArray,
    *,
    prior_sd: float | None = None,
    inflation: float = 1.0,
    about: FloatArray | None = None,
) -> ConsistentFit:
    """Physically consistent fit, with a prior of a relative sd or without a prior.

    `weights` (R,): per row, one over the residual level, so that data and prior have the same
    units.
    `prior` (p_i,): inertial parameters of all segments, positive definite. Without `prior_sd` they
    only determine what the motion cannot show.
    `prior_sd`: relative standard deviation of the prior's masses: .3 for 30 %. In this divergence,
    a second moment of mass along one direction has sqrt(2) times that.
    `inflation`: variance of an estimate over that for independent samples.
    `about` (b,): base parameters to use instead of those of least squares, if these are biased.
    Raises InputError: a prior that no distribution of mass can have, another number of parameters,
    or an sd or an inflation that is not positive.
    Raises EstimationError: the iteration does not converge.
    """
    if np.shape(prior) != (equations.n_inertial,):
        raise InputError(f"a prior of {np.size(prior)}", expected=f"{equations.n_inertial} numbers")
    P0 = pseudo_inertias(prior)
    if not np.linalg.eigvalsh(P0).min() > 0:
        raise InputError("the prior has a pseudo-inertia that is not positive definite")
    check_number(inflation, f"inflation {inflation}", above=0)
    if prior_sd is not None:
        check_number(prior_sd, f"prior sd {prior_sd}", above=0)
    problem = _Problem(equations, base, weights, P0, about)
    start = base.of(np.append(prior, np.zeros(len(equations.columns) - len(prior))))
    b, n = start, problem.hidden(prior)
    # a relative error e of a mass costs gamma e^2 / 2 (2 e^2 if all of P is scaled)
    gamma_end = inflation / (4 * prior_sd**2) if prior_sd else problem.vanishing(prior)
    gamma = max(float(problem.misfit(b)), gamma_end)
    while True:
        b, n = _centre(problem, b, n, gamma, last=gamma <= gamma_end)
        if gamma <= gamma_end:
            break
        gamma = max(gamma * _SHRINK, gamma_end)
    phi = problem.phi(b, n)
    P = pseudo_inertias(phi[: problem.inertial])
    smallest = np.asarray(np.linalg.eigvalsh(_in_units_of(P0, P))[:, 0], dtype=np.float64)
    if not (smallest > 0).all() or not np.linalg.eigvalsh(P).min() > 0:
        raise EstimationError("a pseudo-inertia ends on the edge of what is possible")
    covariance = problem.covariance(b, n, gamma) * inflation if prior_sd else None
    return ConsistentFit(phi, base.of(phi), covariance, smallest, gamma)


class _Problem:
    """Triangular factor of the data and the segments' cones, in coordinates (b, n)."""

    def __init__(
        self,
        equations: BodyEquations,
        base: BaseParameters,
        weights: FloatArray,
        P0: FloatArray,
        about: FloatArray | None,
    ) -> None:
        p = len(equations.columns)
        stack = equations.stacked(weights)[:, np.append(base.leading, p)]
        r = np.asarray(np.linalg.qr(stack, mode="r"))
        self.T, self.z = r[:-1, :-1], r[:-1, -1]
        if about is not None:
            self.z = self.T @ about
        self.left = float(r[-1, -1] ** 2)
        self.base, self.inertial, self.p = base, equations.n_inertial, p
        self.N = base.null_space
        self.basis = pseudo_inertia_basis()
        self.P0, self.inverse = P0, np.linalg.inv(P0)
        self.lift = np.zeros((p, base.rank))
        self.lift[base.leading, np.arange(base.rank)] = 1.0

    def phi(self, b: FloatArray, n: FloatArray) -> FloatArray:
        return np.asarray(self.lift @ b + self.N @ n)

    def hidden(self, prior: FloatArray) -> FloatArray:
        """Values n of a prior: those of its columns that do not lead."""
        phi = np.append(prior, np.zeros(self.p - len(prior)))
        return np.asarray(phi[np.setdiff1d(np.arange(self.p), self.base.leading)])

    def misfit(self, b: FloatArray) -> float:
        e = self.z - self.T @ b
        return float(e @ e)

    def vanishing(self, prior: FloatArray) -> float:
        """Value of gamma that changes the minimum without a prior by `_GAP` only."""
        total = float(self.z @ self.z) + self.left
        return max(_GAP * self.left, _LEAST_GAP * total) / len(prior)

    def longest_descent(
        self, b: FloatArray, n: FloatArray, db: FloatArray, dn: FloatArray, gamma: float
    ) -> float:
        """Length of the step along (db, dn) to the lowest point on that line, inside the cones.

        Along a line the misfit is a parabola and ``log det(P + t D)`` a sum of ``log(1 + t l)``,
        so the slope has a closed form; it rises with t, and its zero is found by bisection.
        """
        P = pseudo_inertias(self.phi(b, n)[: self.inertial])
        D = pseudo_inertias(self.phi(db, dn)[: self.inertial])
        ratio = np.linalg.eigvalsh(_in_units_of(P, D)).ravel()
        moved, residual = self.T @ db, self.z - self.T @ b
        slope = float(gamma * np.einsum("sij,sji->", self.inverse, D) - residual @ moved)
        curve = float(moved @ moved)
        low, high = 0.0, min(1 / max(-float(ratio.min()), 1e-300), _LONGEST)
        for _ in range(_HALVINGS):
            t = (low + high) / 2
            rising = slope + curve * t - gamma * float((ratio / (1 + t * ratio)).sum()) > 0
            low, high = (low, t) if rising else (t, high)
        return low

    def cones(self, b: FloatArray, n: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Factors G (10 s, p) and g (10 s,): the divergence's Hessian is G^T G, its gradient G^T
        g."""
        P = pseudo_inertias(self.phi(b, n)[: self.inertial])
        C = np.linalg.cholesky(P)
        inv = np.linalg.inv(C)
        # d(C^-1 P C^-T) for each of the ten parameters of segment s, (s, 10, 4, 4)
        moved = inv[:, None] @ self.basis @ np.swapaxes(inv, 1, 2)[:, None]
        pull = np.swapaxes(C, 1, 2) @ self.inverse @ C - np.eye(4)
        s = len(P)
        G = np.zeros((s, 10, s, 10))
        G[np.arange(s), :, np.arange(s)] = np.swapaxes(_flat(moved), 1, 2)
        wide = np.zeros((10 * s, self.p))
        wide[:, : self.inertial] = G.reshape(10 * s, 10 * s)
        return wide, _flat(pull).reshape(-1)

    def step(
        self, b: FloatArray, n: FloatArray, gamma: float
    ) -> tuple[FloatArray, FloatArray, float]:
        """Newton's step and its squared length in the Hessian's metric."""
        G, g = self.cones(b, n)
        h = self.N.shape[1]
        Q, R = np.linalg.qr(G @ self.N, mode="complete")
        along, across = Q[:, :h], Q[:, h:]
        root, GS = np.sqrt(gamma), G @ self.lift
        # [T; sqrt(gamma) Q2^T G S] (2b, b) db = [z - T b; -sqrt(gamma) Q2^T g]
        stack = np.concatenate([self.T, root * (across.T @ GS)])
        right = np.concatenate([self.z - self.T @ b, -root * (across.T @ g)])
        scale = np.linalg.norm(stack, axis=0)
        q, r = np.linalg.qr(stack / scale)
        db = solve_triangular(r, q.T @ right) / scale
        # R1 (h, h) dn = -Q1^T (g + G S db)
        dn = solve_triangular(R[:h], -along.T @ (g + GS @ db)) if h else np.zeros(0)
        dphi = G @ (self.lift @ db + self.N @ dn)
        Tb = self.T @ db
        return db, dn, float(Tb @ Tb + gamma * (dphi @ dphi))

    def covariance(self, b: FloatArray, n: FloatArray, gamma: float) -> FloatArray:
        """Inverse of the curvature, transformed to phi (p, p)."""
        G, _ = self.cones(b, n)
        to_phi = np.concatenate([self.lift, self.N], axis=1)
        data = np.zeros((len(self.T), self.p))
        data[:, : self.base.rank] = self.T
        stack = np.concatenate([data, np.sqrt(gamma) * G @ to_phi])
        scale = np.linalg.norm(stack, axis=0)
        r = np.linalg.qr(stack / scale, mode="r")
        half = to_phi @ (solve_triangular(r, np.eye(self.p)) / scale[:, None])
        return np.asarray(half @ half.T)


def _centre(
    problem: _Problem, b: FloatArray, n: FloatArray, gamma: float, *, last: bool
) -> tuple[FloatArray, FloatArray]:
    """Newton's method at one gamma: approximate on the way, to convergence if `last`."""
    before = float("inf")
    for _ in range(_MOST_STEPS):
        db, dn, length = problem.step(b, n, gamma)
        short = length <= _NEAR * gamma
        size = problem.longest_descent(b, n, db, dn, gamma)
        size = min(size, 1.0) if short else size
        b, n = b + size * db, n + size * dn
        # at the last gamma: until the steps vanish, or rounding keeps them from shrinking
        stalled = length <= _ROUNDING * gamma and length >= before / 4
        if short and (not last or length <= _SETTLED * gamma or stalled):
            return b, n
        before = length
    raise EstimationError(f"the physically consistent fit does not settle in {_MOST_STEPS} steps")


def _in_units_of(P0: FloatArray, P: FloatArray) -> FloatArray:
    """Matrices ``C0^-1 P C0^-T`` (s, 4, 4): the identity if P is the prior."""
    inv = np.linalg.inv(np.linalg.cholesky(P0))
    moved = inv @ P @ np.swapaxes(inv, 1, 2)
    return np.asarray((moved + np.swapaxes(moved, 1, 2)) / 2)


def _flat(symmetric: FloatArray) -> FloatArray:
    """Symmetric (..., 4, 4) as (..., 10) with the same inner product."""
    i, j = np.triu_indices(4)
    return np.asarray(symmetric[..., i, j] * np.where(i == j, 1.0, np.sqrt(2)))


# Distance of the segments from the prior, estimated from the data: is the prior sd too small?
#
# Least squares give the base parameters b with the errors of the data, ``C_d``; a prior of relative
# sd s expects ``b ~ N(b_0, s^2 C_1)``. So ``b - b_0`` has the covariance ``C_d + s^2 C_1``, and s
# is estimated by its likelihood (empirical Bayes). If the stated prior sd were too small, the prior
# would pull the parameters away from the data, with intervals that are too short.

#: Limit of twice the log likelihood against the stated sd: chance exceeds it once in a thousand.
_CONTRADICTED: Final = 10.8
#: Largest relative sd in the search.
_WIDEST: Final = 10.0


@dataclass(frozen=True)
class Trust:
    """Stated relative sd of a prior, and its test by the data.

    `told`: the stated sd.
    `likely`: the sd of maximum likelihood.
    `against`: twice its gain of log likelihood over the stated sd; 0 if it is smaller.
    `informed`: effective number of parameters that determine it.
    """

    told: float
    likely: float
    against: float
    informed: float

    @property
    def used(self) -> float:
        """The sd to use: never below the stated one, since a small estimate may be chance."""
        return max(self.told, self.likely)

    @property
    def finding(self) -> Finding:
        """Finding on whether the table of masses and inertias is as accurate as stated."""
        stated, likely = f"{100 * self.told:.0f} %", f"{100 * self.likely:.0f} %"
        least = self.told * np.exp(np.sqrt(_CONTRADICTED / (2 * max(self.informed, 1e-9))))
        smallest = f"{100 * min(least, _WIDEST):.0f} %"
        if self.against <= _CONTRADICTED:
            message = f"the segments lie within the {stated} of the prior (most likely {likely})"
            return Finding("table", "ok", message, smallest=smallest)
        return Finding(
            "table",
            "warning",
            f"the person's segments deviate from the table by some {likely}, the prior was stated "
            f"{stated}: it was trusted to {likely} only, and intervals allow for that",
            smallest=smallest,
        )


def trust_in_prior(
    base: BaseParameters,
    prior: FloatArray,
    values: FloatArray,
    covariance: FloatArray,
    stated: float,
) -> Trust:
    """Test a prior's stated sd against base parameters estimated without the prior.

    `prior` (p_i,): inertial parameters of all segments.
    `values`, `covariance` (b,), (b, b): base parameters of least squares and the covariance of
    their errors.
    `stated`: relative sd of the prior's masses.
    """
    p = len(prior)
    # parameters that include joint terms have no prior
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

    best = minimize_scalar(deviance, bounds=(np.log(stated) - 4, np.log(_WIDEST)), method="bounded")
    part = stated**2 * spread / (1 + stated**2 * spread)
    likely = float(np.exp(best.x))
    against = deviance(float(np.log(stated))) - float(best.fun) if likely > stated else 0.0
    return Trust(stated, likely, against, float((part**2).sum()))


def unit_covariance(prior: FloatArray) -> FloatArray:
    """Covariance (p_i, p_i) of inertial parameters for a relative sd of 1 of the masses.

    It is the inverse curvature of the divergence, in which a relative error e of a mass costs
    ``e^2 / 2``, with the weight ``1 / 4`` as in `consistent.fit_consistent`.

    Raises InputError: a prior that is not a rigid body's.
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
