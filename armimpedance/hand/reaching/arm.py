"""The two-link arm of a recording: its geometry, and its inertia as three numbers.

    M(q) qdd + h(q, qd) = Y(q, qd, qdd) (a, b, c),   (2,) = (2, 3) (3,)

with ``M11 = a + b + 2 c cos q2``, ``M12 = b + c cos q2``, ``M22 = b`` (kg m^2): Tsuji (1997),
eq. (14), of any two links whose masses nobody needs to know.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.errors import InputError
from armimpedance.core.records import Recording
from armimpedance.limb.arm import TwoLinkArm

#: Inertial parameters of two links: a, b, c.
N_INERTIAL: Final = 3


@dataclass(frozen=True)
class Geometry(FrozenRecord):
    """The arm's lengths as a chain, whose masses are of no meaning, and the shoulder's place."""

    arm: TwoLinkArm
    shoulder_m: Annotated[FloatArray, "2"]


def geometry_of(recording: Recording) -> Geometry:
    """The arm of a recording.

    Raises
    ------
    InputError
        The recording lacks a length or the shoulder's place, or is not of a hand in a plane.
    """
    who, shoulder = recording.subject, recording.shoulder_m
    if recording.kind != "hand" or recording.axes != 2:
        raise InputError(
            f"a recording of kind {recording.kind!r} with {recording.axes} axes",
            expected="a hand that moves in a plane",
        )
    upper, fore = who.upper_arm_m, who.forearm_hand_m
    if upper is None or fore is None or shoulder is None:
        known = {
            "subject.upper_arm_m": upper,
            "subject.forearm_hand_m": fore,
            "shoulder_m": shoulder,
        }
        missing = ", ".join(name for name, value in known.items() if value is None)
        raise InputError(
            f"the recording has no {missing}",
            expected="both lengths of the arm and the shoulder's place in recording.json: a hand "
            "that moves is seen from its joints",
        )
    return Geometry(TwoLinkArm(upper, fore, 1.0, 1.0, 0.1, 0.1, 0.1, 0.1), shoulder)


def inertial_rows(q: FloatArray, qd: FloatArray, qdd: FloatArray) -> FloatArray:
    """``Y(q, qd, qdd)``, (..., 2, 3), of angles, rates and accelerations (..., 2)."""
    cosine, sine = np.cos(q[..., 1]), np.sin(q[..., 1])
    w1, w2 = qd[..., 0], qd[..., 1]
    a1, a2 = qdd[..., 0], qdd[..., 1]
    Y = np.zeros((*cosine.shape, 2, N_INERTIAL))
    Y[..., 0, 0] = a1
    Y[..., 0, 1] = Y[..., 1, 1] = a1 + a2
    Y[..., 0, 2] = (2 * a1 + a2) * cosine - (2 * w1 * w2 + w2**2) * sine
    Y[..., 1, 2] = a1 * cosine + w1**2 * sine
    return Y


def inertia_rows(q: FloatArray) -> FloatArray:
    """``dM/d(a, b, c)``, (2, 2, 3), at angles (2,)."""
    cosine = np.cos(q[1])
    rows = np.zeros((2, 2, N_INERTIAL))
    rows[0, 0] = [1.0, 1.0, 2 * cosine]
    rows[0, 1] = rows[1, 0] = [0.0, 1.0, cosine]
    rows[1, 1] = [0.0, 1.0, 0.0]
    return rows


def inertial_gradients(
    q: FloatArray, qd: FloatArray, qdd: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """``d(Y phi)_i/dq_j`` and ``d(Y phi)_i/dqd_j`` by phi, (2, 2, 3) each, at one instant (2,)."""
    cosine, sine = np.cos(q[1]), np.sin(q[1])
    (w1, w2), (a1, a2) = qd, qdd
    by_angle, by_rate = np.zeros((2, 2, N_INERTIAL)), np.zeros((2, 2, N_INERTIAL))
    by_angle[0, 1, 2] = -(2 * a1 + a2) * sine - (2 * w1 * w2 + w2**2) * cosine
    by_angle[1, 1, 2] = -a1 * sine + w1**2 * cosine
    by_rate[0, 0, 2] = -2 * w2 * sine
    by_rate[0, 1, 2] = -2 * (w1 + w2) * sine
    by_rate[1, 0, 2] = 2 * w1 * sine
    return by_angle, by_rate
