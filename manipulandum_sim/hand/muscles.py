"""Six muscles: paths over the joints, and tension, stiffness and viscosity over activation.

The path length L(q) is the primitive: moment arms are its gradient and nothing else, so that what
the muscles take up as energy they give back.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.conventions import MUSCLE_SIGNS, NOMINAL_POSTURE_RAD

N_MUSCLES: Final = 6

#: Moment arms at the nominal posture (m), shoulder and elbow: Selen et al. 2009, Table 1.
MOMENT_ARMS_M: Final = (
    (0.0536, 0.0),
    (0.0536, 0.0),
    (0.0, 0.0316),
    (0.0, 0.0267),
    (0.0386, 0.0427),
    (0.0388, 0.0300),
)


@dataclass(frozen=True)
class MomentArmCourse:
    """Moment arms that change with posture: ``1 + ripple cos(q - peak)`` times a constant.

    Attributes
    ----------
    ripple, peak_rad : six pairs
        Of each muscle over shoulder and elbow.
    """

    ripple: tuple[tuple[float, float], ...]
    peak_rad: tuple[tuple[float, float], ...]


#: Over the elbow (40 to 130 deg) brachialis, triceps and biceps of OpenSim's arm26: K. R. S.
#: Holzbaur, W. M. Murray and S. L. Delp (2005), Ann Biomed Eng 33:829-840; model by Reinbolt, Seth,
#: Habib and Hamner, CC BY 3.0. There -dL/dq goes from .0126 to .0239 m (brachialis), .0316 to .0494
#: (biceps) and .0235 to .0194 (triceps); these curves are within 9, 4 and 5 % of theirs. Over the
#: shoulder the two-joint muscles lose two fifths from 10 to 90 deg, as the long head of the triceps
#: does there (.0375 to .0214 m; within 15 %). For one-joint muscles of the shoulder in a horizontal
#: plane the course is assumed. The spread of K_j over 20 postures is then (sum of squares, K_ss,
#: K_se, K_ee) 103, 18, 67 (N m/rad)^2; Tsuji (1997), Table 1, prints 109, 28, 50, of which a fit of
#: order 2 leaves 5, 10, 2.
MEASURED: Final = MomentArmCourse(
    ((0.2, 0.0), (0.2, 0.0), (0.0, 2.6), (0.0, 0.25), (0.75, 5.49), (0.75, 0.25)),
    ((1.1, 0.0), (1.1, 0.0), (0.0, 1.93), (0.0, -1.31), (0.1, 1.674), (0.1, -1.31)),
)
#: Moment arms that hardly change: K_j then differs between postures by chance alone, and a model
#: over posture has nothing to fit. A control.
ALIKE: Final = MomentArmCourse(
    ((0.2, 0.0), (0.2, 0.0), (0.0, 0.35), (0.0, 0.15), (0.25, 0.35), (0.2, 0.15)),
    ((0.5, 0.0), (1.4, 0.0), (0.0, 1.9), (0.0, 0.8), (0.6, 1.8), (1.4, 0.9)),
)
#: By the names that a subject's `moment_arms` may have.
COURSES: Final = {"measured": MEASURED, "alike": ALIKE}


@dataclass(frozen=True)
class MusclePaths(FrozenRecord):
    """Muscle lengths ``L_n = sum_i a_ni q_i + s_ni sin q_i + c_ni cos q_i``, lengthening positive.

    Attributes
    ----------
    slope, sine, cosine : (6, 2)
        Coefficients of each muscle over each joint (m).
    """

    slope: Annotated[FloatArray, "6 2"]
    sine: Annotated[FloatArray, "6 2"]
    cosine: Annotated[FloatArray, "6 2"]

    @cached_property
    def _weights(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Weights of the length over the basis (6, 6) and of both moment arms over sine, cosine."""
        joints = [np.stack([self.slope[:, j], self.sine[:, j], self.cosine[:, j]]) for j in (0, 1)]
        arms = [np.stack([-self.cosine[:, j], self.sine[:, j]], axis=1) for j in (0, 1)]
        return np.ascontiguousarray(np.concatenate(joints).T), arms[0], arms[1]

    def length(self, basis: FloatArray) -> FloatArray:
        """Lengths (6, ...) at a basis (6, ...)."""
        return _weighted(self._weights[0], basis)

    def moment_arms(self, basis: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Both columns of ``G = dL/dq``, (6, ...) each."""
        arms = []
        for joint in (0, 1):
            arm = _weighted(self._weights[1 + joint], basis[3 * joint + 1 : 3 * joint + 3])
            arm += self.slope[:, joint].reshape(N_MUSCLES, *[1] * (basis.ndim - 1))
            arms.append(arm)
        return arms[0], arms[1]


def _weighted(weights: FloatArray, basis: FloatArray) -> FloatArray:
    # Plain einsum adds element by element in one order; a matrix product of a linear-algebra
    # library may add in another one for another batch, and the same trial would change its bits.
    weighted: FloatArray = np.einsum("ij,j...->i...", weights, basis)
    return weighted


def joint_basis(q1: FloatArray, q2: FloatArray) -> FloatArray:
    """The functions of the joint angles in which the lengths of the paths are linear.

    Parameters
    ----------
    q1, q2 : (...)
        Shoulder and elbow, rad.

    Returns
    -------
    (6, ...)
        ``q1, sin q1, cos q1, q2, sin q2, cos q2``.
    """
    return np.stack([q1, np.sin(q1), np.cos(q1), q2, np.sin(q2), np.cos(q2)])


@dataclass(frozen=True)
class MuscleMechanics(FrozenRecord):
    """Tension, stiffness and viscosity of each muscle over activation 0..1.

    Attributes
    ----------
    rest_tension, max_tension : (6,)
        N; tension is ``rest + activation max``.
    rest_stiffness : (6,)
        N/m of the muscle at rest.
    stiffness_per_tension : float
        1/m: ``k = rest_stiffness + stiffness_per_tension activation max_tension``.
    rest_viscosity_s, active_viscosity_s : float
        ``b = rest_viscosity_s rest_stiffness + active_viscosity_s (k - rest_stiffness)``.
    """

    rest_tension: Annotated[FloatArray, "6"]
    max_tension: Annotated[FloatArray, "6"]
    rest_stiffness: Annotated[FloatArray, "6"]
    stiffness_per_tension: float = 75.0
    rest_viscosity_s: float = 0.07
    active_viscosity_s: float = 0.05

    def tension(self, activation: FloatArray) -> FloatArray:
        """N, (..., 6) of activations (..., 6)."""
        return self.rest_tension + activation * self.max_tension

    def stiffness(self, activation: FloatArray) -> FloatArray:
        """N/m, (..., 6)."""
        return self.rest_stiffness + self.stiffness_per_tension * activation * self.max_tension

    def viscosity(self, activation: FloatArray) -> FloatArray:
        """N s/m, (..., 6)."""
        active = self.stiffness(activation) - self.rest_stiffness
        return self.rest_viscosity_s * self.rest_stiffness + self.active_viscosity_s * active


def human_paths(course: MomentArmCourse = MEASURED) -> MusclePaths:
    """Paths whose moment arms at the nominal posture are the published ones."""
    arm, sign = np.array(MOMENT_ARMS_M), np.array(MUSCLE_SIGNS, dtype=float)
    ripple, peak = np.array(course.ripple), np.array(course.peak_rad)
    nominal = np.array(NOMINAL_POSTURE_RAD)
    slope = sign * arm / (1 + ripple * np.cos(nominal - peak))
    # the integral of 1 + ripple cos(q - peak) over q
    return MusclePaths(slope, slope * ripple * np.cos(peak), -slope * ripple * np.sin(peak))


def human_mechanics(strength: float = 1.0) -> MuscleMechanics:
    """Muscles of an adult arm, all forces multiplied by `strength`.

    Stiffness per tension and active viscosity: Selen et al. 2009 (75 /m, .05 s). Rest stiffness and
    viscosity: so that a relaxed arm has the joint stiffness of Shadmehr and Mussa-Ivaldi 1994,
    [[15, 6], [6, 16]] N m/rad, and half their viscosity, [[2.3, .9], [.9, 2.4]] N m s/rad: all of
    it would make more at the hand than the 2-18 N s/m that Fortineau 2023 found in 31 people.
    """
    return MuscleMechanics(
        rest_tension=strength * np.array([18.0, 18.0, 17.0, 24.0, 16.0, 16.0]),
        max_tension=strength * np.array([700.0, 700.0, 700.0, 700.0, 350.0, 400.0]),
        rest_stiffness=strength * np.array([1300.0, 1300.0, 5200.0, 5200.0, 2100.0, 2100.0]),
    )
