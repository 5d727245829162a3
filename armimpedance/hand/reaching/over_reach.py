"""The course of K and B over a reach, from the pushes of all its phases.

Each phase gives K and B in the middle of its window, their slopes and their curvatures, as far as
its pushes determine them (`PhaseEvidence`). K and B are random courses with the covariance

    s^2 exp(-(t - t')^2 / (2 L^2)),

whose slopes and curvatures have the prior standard deviations of a single phase in `solve`: L and s
follow from them, and the course of one phase is the result of that phase. The courses are sums of
cosines with the random weights that this covariance implies (A. Solin and S. Sarkka, Hilbert space
methods for reduced-rank Gaussian process regression, Stat Comput 30 (2020) 419-446), so that all
phases are one linear problem:

    (sum_i T_i^T A_i T_i + P) u = sum_i T_i^T b_i + P u_0,   T_i (31, U).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.hand.reaching.equation import (
    CHANGE_S,
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
)
from armimpedance.hand.reaching.solve import (
    AT_REST,
    CHANGE_SD,
    CURVE_SD,
    REFLEX_SD,
    InertiaPrior,
    PhaseEvidence,
    PhaseSolution,
)

#: Length of the covariance (s) and its size, relative to K or B: a slope of `CHANGE_SD` in
#: `CHANGE_S` is s / L, a curvature of `CURVE_SD` in its square is sqrt(3) s / L^2 / 2.
LENGTH_S: Final = float(np.sqrt(3) * CHANGE_SD * CHANGE_S / (2 * CURVE_SD))
SIZE: Final = CHANGE_SD * LENGTH_S / CHANGE_S
#: Prior standard deviation of the mean, relative to its size: practically no prior.
MEAN_SIZE: Final = 10.0
#: The cosines extend this far beyond the phases, and up to this frequency, relative to L.
BEYOND: Final = 2.0
FASTEST: Final = 4.5
#: Elements of K and B.
_ELEMENTS: Final = 8


@dataclass(frozen=True)
class ReachCourse(FrozenRecord):
    """The unknowns at G times of the reach.

    `covariance` (G, 11, 11).
    `time_s` (G,): from the onset of the first phase's pushes.
    `theta` (G, 11): phi, K and B of the joints, in the order of `equation`.
    """

    time_s: Annotated[FloatArray, "G"]
    theta: Annotated[FloatArray, "G p"]
    covariance: Annotated[FloatArray, "G p p"]
    dof: float


def course_over(
    solutions: Sequence[PhaseSolution],
    without: Sequence[Sequence[PhaseEvidence]],
    at_s: FloatArray,
    moving: float,
    time_s: FloatArray,
    prior: InertiaPrior | None = None,
) -> ReachCourse:
    """Estimate the unknowns at given times from the phases' solutions.

    `time_s` (G,).
    `without`: evidence of the same phases with a group of trials left out in turn. Weights from few
    trials have errors, too; the intervals grow by the scatter of the groups beyond that of the
    scores.
    `at_s` (n,): middle of each phase's window.
    `moving`: as `Equations.moving`: an arm at rest has one K.
    `prior`: prior of the inertia.
    """
    basis = _Basis(float(at_s.min()), float(at_s.max()))
    maps = [_to_phase(basis, t) for t in at_s.tolist()]
    out = np.stack([_to_phase(basis, t)[REPORTED] for t in time_s.tolist()])

    def solved(parts: Sequence[PhaseEvidence]) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return A (U, U), P (U, U) and u (U,)."""
        P, right = _prior(basis, _sizes(parts), moving, prior)
        A = P + sum(T.T @ phase.information @ T for T, phase in zip(maps, parts, strict=True))
        right = right + sum(T.T @ phase.score for T, phase in zip(maps, parts, strict=True))
        return A, P, np.asarray(np.linalg.solve(A, right), dtype=float)

    A, P, u = solved([phase.evidence for phase in solutions])
    S = P + sum(T.T @ phase.scatter @ T for T, phase in zip(maps, solutions, strict=True))
    # the covariance of u is A^-1 S A^-T, (U, U)
    C = np.linalg.solve(A, np.linalg.solve(A, S).T).T
    covariance = np.einsum("gpu,uv,gqv->gpq", out, (C + C.T) / 2, out)
    left_out = np.stack([out @ solved(parts)[2] for parts in without])
    return ReachCourse(
        time_s,
        out @ u,
        covariance * _excess(left_out, covariance),
        float(sum(phase.dof for phase in solutions)),
    )


def _sizes(parts: Sequence[PhaseEvidence]) -> FloatArray:
    """Size (8,) of the elements of K, and of those of B."""
    square = np.mean([part.theta[3:11] ** 2 for part in parts], axis=0)
    return np.repeat(np.sqrt(square.reshape(2, 4).mean(axis=1)), 4)


def _excess(left_out: FloatArray, covariance: FloatArray) -> float:
    """Mean ratio of jackknife variances by groups (g, G, 11) to the variances; at least 1."""
    g = len(left_out)
    jackknife = (g - 1) / g * ((left_out - left_out.mean(axis=0)) ** 2).sum(axis=0)
    return max(1.0, float(np.mean(jackknife / np.einsum("gpp->gp", covariance))))


class _Basis:
    """Cosines on an interval around the phases, and their slopes and curvatures."""

    def __init__(self, first_s: float, last_s: float) -> None:
        self.start = first_s - BEYOND * LENGTH_S
        length = last_s - first_s + 2 * BEYOND * LENGTH_S
        self.count = int(np.ceil(FASTEST * length / (np.pi * LENGTH_S))) + 1
        self.omega = np.pi * np.arange(self.count) / length
        # spectral density sqrt(2 pi) L exp(-(L w)^2 / 2), over the interval's length
        density = np.sqrt(2 * np.pi) * LENGTH_S * np.exp(-((LENGTH_S * self.omega) ** 2) / 2)
        self.variance = SIZE**2 * density * np.where(np.arange(self.count) > 0, 2, 1) / length

    def rows(self, time_s: float) -> FloatArray:
        """Value, slope times `CHANGE_S` and half the curvature times its square, (3, count)."""
        phase = self.omega * (time_s - self.start)
        step = CHANGE_S * self.omega
        return np.stack([np.cos(phase), -step * np.sin(phase), -0.5 * step**2 * np.cos(phase)])


def _to_phase(basis: _Basis, time_s: float) -> FloatArray:
    """T (31, U): a phase's unknowns from phi, the weights of 8 courses, and the reflex.

    The reflex is the same for all phases, so that its error is common to them.
    """
    T = np.zeros((N_UNKNOWN, 3 + _ELEMENTS * basis.count + 4))
    T[INERTIAL, INERTIAL] = np.eye(3)
    for row, (stiffness, viscosity) in zip(
        basis.rows(time_s),
        (
            (STIFFNESS, VISCOSITY),
            (STIFFNESS_CHANGE, VISCOSITY_CHANGE),
            (STIFFNESS_CURVE, VISCOSITY_CURVE),
        ),
        strict=True,
    ):
        part = np.kron(np.eye(_ELEMENTS), row)
        T[stiffness, 3 : 3 + part.shape[1]] = part[:4]
        T[viscosity, 3 : 3 + part.shape[1]] = part[4:]
    T[REFLEX, -4:] = np.eye(4)
    return T


def _prior(
    basis: _Basis, sizes: FloatArray, moving: float, prior: InertiaPrior | None
) -> tuple[FloatArray, FloatArray]:
    """Precision (U, U), and precision times the prior mean (U,)."""
    share = max(moving, AT_REST) ** 2
    count = 3 + _ELEMENTS * basis.count + 4
    precision = np.zeros(count)
    variance = basis.variance * share
    variance[0] = MEAN_SIZE**2
    for k, size in enumerate(sizes):
        precision[3 + k * basis.count : 3 + (k + 1) * basis.count] = 1 / (size**2 * variance)
    precision[-4:] = 1 / (REFLEX_SD**2 * share * sizes[0] ** 2)
    P, right = np.diag(precision), np.zeros(count)
    if prior is not None:
        P[INERTIAL, INERTIAL] = np.linalg.inv(prior.covariance)
        right[INERTIAL] = P[INERTIAL, INERTIAL] @ prior.inertial
    return P, right
