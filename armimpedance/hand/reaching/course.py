"""Every sample of the reaches, at the hand and at the joints, through one and the same low-pass.

The dynamics of the links are not linear, so they are formed from the measured motion first; then
all terms of the joint equation go through one linear filter, which leaves the equation as it is.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord, IntArray
from armimpedance.core.errors import InputError
from armimpedance.core.records import Recording
from armimpedance.core.trials import trial_slices
from armimpedance.limb.arm import TwoLinkArm
from armimpedance.numerics.signals import lowpass

# The two-link arm of a recording: its geometry, and its inertia as three numbers.
#
#     M(q) qdd + h(q, qd) = Y(q, qd, qdd) (a, b, c),   (2,) = (2, 3) (3,)
#
# with ``M11 = a + b + 2 c cos q2``, ``M12 = b + c cos q2``, ``M22 = b`` (kg m^2): Tsuji (1997),
# eq. (14), of any two links whose masses nobody needs to know.

#: Inertial parameters of two links: a, b, c.
N_INERTIAL: Final = 3


@dataclass(frozen=True)
class ArmGeometry(FrozenRecord):
    """The arm's lengths as a chain, whose masses are of no meaning, and the shoulder's place."""

    arm: TwoLinkArm
    shoulder_m: Annotated[FloatArray, "2"]


def geometry_of(recording: Recording) -> ArmGeometry:
    """The arm of a recording.

    Raises InputError: the recording lacks a length or the shoulder's place, or is not of a hand in
    a plane.
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
    return ArmGeometry(TwoLinkArm(upper, fore, 1.0, 1.0, 0.1, 0.1, 0.1, 0.1), shoulder)


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


#: What the low-pass lets through: a push of 60 ms has hardly anything above.
CUTOFF_HZ: Final = 30.0
#: Slower records do not hold the accelerations of a push.
LEAST_RATE_HZ: Final = 200.0
#: Names and widths of the channels, in their order.
CHANNELS: Final = {
    "hand": 2,
    "velocity": 2,
    "acceleration": 2,
    "force": 2,
    "angle": 2,
    "rate": 2,
    "joint_acceleration": 2,
    "inertial": 6,
    "torque": 2,
}


@dataclass(frozen=True)
class Courses(FrozenRecord):
    """All channels of all trials, smoothed.

    `offsets` (T + 1,) int, `trial` (T,) int, `shoulder_m` (2,).
    `channels` (N, 22): hand from the shoulder (m), its velocity and acceleration, the limb's own
    force (N), joint angles (rad), rates and accelerations, the rows of ``Y`` (`arm.inertial_rows`),
    and the torque ``J^T F`` of the hand's force.
    `start_s` (T,): time of each trial's first sample on its own clock.
    `arm`: lengths of the arm.
    """

    sample_rate_hz: float
    channels: Annotated[FloatArray, "N c"]
    offsets: Annotated[IntArray, "T+1"]
    start_s: Annotated[FloatArray, "T"]
    trial: Annotated[IntArray, "T"]
    arm: TwoLinkArm
    shoulder_m: Annotated[FloatArray, "2"]

    def of_trial(self, row: int, name: str) -> FloatArray:
        """One channel of one trial, (S, width)."""
        return self.channels[self.offsets[row] : self.offsets[row + 1], channel(name)]


def channel(name: str) -> slice:
    """Columns of a channel."""
    names = list(CHANNELS)
    start = sum(CHANNELS[n] for n in names[: names.index(name)])
    return slice(start, start + CHANNELS[name])


def courses_of(recording: Recording) -> Courses:
    """The courses of all trials of a recording.

    Raises InputError: the arm's lengths or the shoulder's place are not known, a hand is out of the
    arm's reach, a trial is shorter than three samples, or the sample rate is below 200 Hz.
    """
    geometry = geometry_of(recording)
    rate = recording.sample_rate_hz
    if rate < LEAST_RATE_HZ:
        raise InputError(
            f"samples at {rate:g} Hz", expected=f"{LEAST_RATE_HZ:g} Hz or more for a moving hand"
        )
    slices = trial_slices(recording.offsets)
    parts = [_of_trial(recording, geometry, at) for at in slices]
    return Courses(
        sample_rate_hz=rate,
        channels=np.concatenate(parts),
        offsets=recording.offsets,
        start_s=np.array([recording.time_s[at.start] for at in slices]),
        trial=recording.trials["trial"].to_numpy(np.int64),
        arm=geometry.arm,
        shoulder_m=geometry.shoulder_m,
    )


def _of_trial(recording: Recording, geometry: ArmGeometry, at: slice) -> FloatArray:
    """Channels (S, 22) of one trial."""
    rate, arm = recording.sample_rate_hz, geometry.arm
    if at.stop - at.start < 3:
        raise InputError(f"a trial of {at.stop - at.start} samples", expected="3 or more")
    p = recording.position[at] - geometry.shoulder_m
    v = np.gradient(p, 1 / rate, axis=0)
    a = np.zeros_like(p)
    a[1:-1] = (p[2:] - 2 * p[1:-1] + p[:-2]) * rate**2
    # force by the limb: the sensor's, and what moves the mass between sensor and hand
    F = recording.force[at] + recording.handle_mass_kg * a
    q = arm.joint_angles(p)
    J = arm.jacobian(q)
    qd = np.linalg.solve(J, v[..., None])[..., 0]
    # a = J qdd + Jdot qd, (2,) = (2, 2) (2,) + (2,)
    turning = np.einsum("sij,sj->si", arm.jacobian_rate(q, qd), qd)
    qdd = np.linalg.solve(J, (a - turning)[..., None])[..., 0]
    torque = np.einsum("sij,si->sj", J, F)
    Y = inertial_rows(q, qd, qdd).reshape(len(p), -1)
    every = np.concatenate([p, v, a, F, q, qd, qdd, Y, torque], axis=1)
    return lowpass(every, CUTOFF_HZ, rate, axis=0)
