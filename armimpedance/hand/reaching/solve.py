"""Generalised least squares with instruments, weights from the trials' own scatter.

The undisturbed course of a trial is known to some millimetres only, and its error is on both sides
of the equation; least squares would make K too small by 10 to 50 %. The part of each term that is
linear in the push's direction is free of this error, and is the instrument Z:

    theta = (sum_n Z_n^T W X_n + P)^-1 (P theta_0 - sum_n Z_n^T W y_n)

with W the inverse of the rows' covariance over trials, P the precision of the prior.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.errors import NotIdentifiableError
from armimpedance.hand.reaching.equation import (
    INERTIAL,
    N_UNKNOWN,
    REFLEX,
    REPORTED,
    STIFFNESS,
    STIFFNESS_CHANGE,
    STIFFNESS_CURVE,
    VISCOSITY,
    VISCOSITY_CHANGE,
    VISCOSITY_CURVE,
    ReachEquations,
)

#: Weight of the diagonal in the shrunk covariance of the rows: with 80 trials and 20 to 26 rows, .1
#: gave the smallest errors among .02, .1, .3 and .6.
SHRINKAGE: Final = 0.1
#: Share of the mean response to the pushes that no model of this kind describes.
FLOOR: Final = 0.03
#: Prior standard deviations, relative to K and B: of their change over `CHANGE_S`, of their
#: curvature over its square, and of a reflex. K that triples over a reach of .7 s changes by .3 and
#: bends by .1.
CHANGE_SD: Final = 0.5
CURVE_SD: Final = 0.15
REFLEX_SD: Final = 0.15
#: Factor of these standard deviations for an arm at rest.
AT_REST: Final = 1e-3
PRIORS: Final = (
    (STIFFNESS_CHANGE, STIFFNESS, CHANGE_SD),
    (VISCOSITY_CHANGE, VISCOSITY, CHANGE_SD),
    (STIFFNESS_CURVE, STIFFNESS, CURVE_SD),
    (VISCOSITY_CURVE, VISCOSITY, CURVE_SD),
    (REFLEX, STIFFNESS, REFLEX_SD),
)
#: Weights and unknowns are estimated in turn until the unknowns change by less than this share of
#: their error.
SETTLED: Final = 0.01
ROUNDS: Final = 30
#: Largest correction for the trials' own noise in the instruments, as a share of the information of
#: the pushes, in any combination of the unknowns.
LARGEST_CORRECTION: Final = 0.5
#: Largest scaled condition of the normal equations that counts as identifiable.
SINGULAR: Final = 1e8


@dataclass(frozen=True)
class InertiaPrior(FrozenRecord):
    """Prior of the inertia: three parameters and their covariance."""

    inertial: Annotated[FloatArray, "3"]
    covariance: Annotated[FloatArray, "3 3"]


@dataclass(frozen=True)
class PhaseEvidence(FrozenRecord):
    """Evidence of the pushes of one phase, without the prior.

    `theta` (31,): the unknowns, with the prior.
    `information`, `score` (31, 31), (31,): ``information theta = score`` without the prior.
    """

    theta: Annotated[FloatArray, "p"]
    information: Annotated[FloatArray, "p p"]
    score: Annotated[FloatArray, "p"]


@dataclass(frozen=True)
class PhaseSolution(FrozenRecord):
    """Estimated unknowns of one phase.

    `theta` (31,).
    `covariance` (31, 31): from the scatter of trials (jackknife).
    `residual` (n, R): ``y + X theta``.
    `weight` (R, R): inverse covariance of a trial's rows.
    `condition`: of the scaled normal equations.
    `scatter` (31, 31): covariance of the evidence's score, from the scatter of trials.
    """

    theta: Annotated[FloatArray, "p"]
    covariance: Annotated[FloatArray, "p p"]
    dof: float
    residual: Annotated[FloatArray, "n R"]
    weight: Annotated[FloatArray, "R R"]
    condition: float
    evidence: PhaseEvidence
    scatter: Annotated[FloatArray, "p p"]


def solve(equations: ReachEquations, prior: InertiaPrior | None = None) -> PhaseSolution:
    """Solve the equations of one phase.

    Raises NotIdentifiableError: the pushes do not determine the unknowns.
    """
    W, P, ZW = _weighted(equations, prior)
    evidence, A = _evidence(equations, ZW, P, prior)
    residual = equations.y + np.einsum("nrp,p->nr", equations.X, evidence.theta)
    trials, dof = _jackknife(equations, ZW, residual, A)
    back = np.linalg.inv(A)
    return PhaseSolution(
        theta=evidence.theta,
        # the prior contributes A^-1 P A^-T
        covariance=trials + back @ P @ back.T,
        dof=dof,
        residual=residual,
        weight=W,
        condition=_condition(A),
        evidence=evidence,
        scatter=A @ trials @ A.T,
    )


def evidence_of(equations: ReachEquations, prior: InertiaPrior | None = None) -> PhaseEvidence:
    """Evidence as in `solve`, without the covariance.

    Raises NotIdentifiableError: the pushes do not determine the unknowns.
    """
    _, P, ZW = _weighted(equations, prior)
    return _evidence(equations, ZW, P, prior)[0]


def further(
    equations: ReachEquations, solution: PhaseSolution
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Estimate the unknowns (31,), k further ones and the covariance of these, with given weights.

    `equations`: with 31 + k columns.
    Raises NotIdentifiableError: the pushes do not determine them.
    """
    k = equations.X.shape[-1] - N_UNKNOWN
    P = np.pad(precision_of(equations, solution.theta, None), (0, k))
    ZW = _times(_instruments(equations, solution.weight, P), solution.weight)
    # A (31 + k, 31 + k) theta = -Z^T W y
    A = _summed(ZW, equations.X) + P
    _condition(A)
    theta = -np.linalg.solve(A, np.einsum("nps,ns->p", ZW, equations.y))
    residual = equations.y + np.einsum("nrp,p->nr", equations.X, theta)
    covariance = _jackknife(equations, ZW, residual, A)[0]
    return theta[:N_UNKNOWN], theta[N_UNKNOWN:], covariance[N_UNKNOWN:, N_UNKNOWN:]


def _weighted(
    equations: ReachEquations, prior: InertiaPrior | None
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Weight (R, R), precision (p, p), and the instruments times the weight (n, p, R)."""
    W, P = _settled(equations, prior)
    Z = _instruments(equations, W, P)
    return W, P, _times(Z, W)


def _evidence(
    equations: ReachEquations, ZW: FloatArray, P: FloatArray, prior: InertiaPrior | None
) -> tuple[PhaseEvidence, FloatArray]:
    A, theta = _solved(equations, ZW, P, prior)
    return PhaseEvidence(theta, A - P, -np.einsum("nps,ns->p", ZW, equations.y)), A


def _settled(
    equations: ReachEquations, prior: InertiaPrior | None
) -> tuple[FloatArray, FloatArray]:
    """Weight (R, R) and precision (p, p), iterated with the unknowns, from which they follow."""
    Z = equations.along_direction(equations.X)
    theta, P, near = np.zeros(N_UNKNOWN), precision_of(equations, np.zeros(N_UNKNOWN), prior), False
    for _ in range(ROUNDS):
        W = weight_of(equations, theta)
        if not near:
            P = precision_of(equations, theta, prior)
        A, updated = _solved(equations, _times(Z, W), P, prior)
        step = np.abs(updated - theta) / np.sqrt(np.abs(np.diag(np.linalg.inv(A))))
        theta = updated
        if near and step.max() < SETTLED:
            break
        near = near or bool(step.max() < 1.0)
    return W, P


def _solved(
    equations: ReachEquations, ZW: FloatArray, P: FloatArray, prior: InertiaPrior | None
) -> tuple[FloatArray, FloatArray]:
    """The normal matrix A (p, p) and the unknowns (p,)."""
    # A (p, p) theta (p,) = P theta_0 - Z^T W y
    A = _summed(ZW, equations.X) + P
    _condition(A)
    right = P @ _before(prior) - np.einsum("nps,ns->p", ZW, equations.y)
    return A, np.linalg.solve(A, right)


def _times(Z: FloatArray, W: FloatArray) -> FloatArray:
    """``Z_n^T W``, (n, p, R), of Z (n, R, p)."""
    return np.swapaxes(Z, 1, 2) @ W


def _summed(ZW: FloatArray, X: FloatArray) -> FloatArray:
    """``sum_n ZW_n X_n``, (p, q), of (n, p, R) and (n, R, q)."""
    return np.tensordot(ZW, X, axes=((0, 2), (0, 1)))


def _instruments(equations: ReachEquations, W: FloatArray, P: FloatArray) -> FloatArray:
    """Z (n, R, p): ``H X - c (1 - H) X``, H onto what is linear in the d instruments.

    H keeps a share d / (n - g) of each trial's own noise, which would bias K towards least squares.
    Subtracting c = d / (n - g - d) of the orthogonal part corrects that (Nagar's unbiased member of
    the k-class). The correction is reduced if it would remove most of the information.
    """
    common = equations.along_direction(equations.X)
    own = equations.X - common
    count = equations.instruments.shape[1]
    dof = equations.trials - equations.nuisance.shape[1] - count
    information = _summed(_times(common, W), common) + P
    noise = count / dof * _summed(_times(own, W), own)
    largest = float(np.abs(np.linalg.eigvals(np.linalg.solve(information, noise))).max())
    return np.asarray(common - min(1.0, LARGEST_CORRECTION / largest) * count / dof * own)


def weight_of(equations: ReachEquations, theta: FloatArray) -> FloatArray:
    """Inverse covariance (R, R) of w, from the part that neither history nor direction explains."""
    w = equations.y + np.einsum("nrp,p->nr", equations.X, theta)
    w = w - equations.along_direction(w)
    dof = equations.trials - equations.nuisance.shape[1] - equations.instruments.shape[1]
    C = w.T @ w / dof
    C = (1 - SHRINKAGE) * C + SHRINKAGE * np.diag(np.diag(C))
    response = equations.along_direction(equations.y)[equations.pushed]
    C += FLOOR**2 * float((response**2).mean()) * np.eye(len(C))
    return np.asarray(np.linalg.inv(C))


def precision_of(
    equations: ReachEquations, theta: FloatArray, prior: InertiaPrior | None
) -> FloatArray:
    """Prior precision (31, 31) of the inertia, if there is a prior, and of changes of K and B."""
    P = np.zeros((N_UNKNOWN, N_UNKNOWN))
    if prior is not None:
        P[INERTIAL, INERTIAL] = np.linalg.inv(prior.covariance)
    if not theta.any():
        # the first round: K and B alone
        rest = slice(REPORTED.stop, N_UNKNOWN)
        P[rest, rest] = 1e6 * np.eye(N_UNKNOWN - REPORTED.stop)
        return P
    for part, of, share in PRIORS:
        size = share * max(equations.moving, AT_REST) * float(np.sqrt((theta[of] ** 2).mean()))
        P[part, part] = np.eye(4) / size**2
    return P


def _before(prior: InertiaPrior | None) -> FloatArray:
    theta = np.zeros(N_UNKNOWN)
    if prior is not None:
        theta[INERTIAL] = prior.inertial
    return theta


def _condition(A: FloatArray) -> float:
    size = np.sqrt(np.abs(np.diag(A)))
    if not (size > 0).all():
        raise NotIdentifiableError("the pushes do not move the hand")
    condition = float(np.linalg.cond(A / np.outer(size, size)))
    if condition > SINGULAR:
        raise NotIdentifiableError(
            f"inertia, viscosity and stiffness cannot be told apart (condition {condition:.1g}): "
            "push the hand to all sides, and back"
        )
    return condition


def _jackknife(
    equations: ReachEquations, ZW: FloatArray, residual: FloatArray, A: FloatArray
) -> tuple[FloatArray, float]:
    """Covariance (p, p) from leaving out each pushed trial in turn, and its degrees of freedom.

    ``theta_(n) - theta = (A - A_n)^-1 Z_n^T W r_n``: the influence of trial n, larger than its
    score by its own leverage (CR3).
    """
    pushed = equations.pushed
    scores = np.einsum("npr,nr->np", ZW, residual)
    own = ZW[pushed] @ equations.X[pushed]
    shifts = np.linalg.solve(A - own, scores[pushed, :, None])[..., 0]
    others = scores[~pushed] @ np.linalg.inv(A).T
    C = shifts.T @ shifts + others.T @ others
    return C, max(float(pushed.sum()) - REPORTED.stop / 2, 2.0)
