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
from armimpedance.hand.reaching.arm import Geometry, geometry_of, inertial_rows
from armimpedance.limb.arm import TwoLinkArm
from armimpedance.numerics.signals import lowpass

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

    Attributes
    ----------
    sample_rate_hz : float
    channels : (N, 22)
        Hand from the shoulder (m), its velocity and acceleration, the limb's own force (N), joint
        angles (rad), rates and accelerations, the rows of ``Y`` (`arm.inertial_rows`), and the
        torque ``J^T F`` of the hand's force.
    offsets : (T + 1,) int
    start_s : (T,)
        Time of each trial's first sample on its own clock.
    trial : (T,) int
    arm : TwoLinkArm
        Lengths of the arm.
    shoulder_m : (2,)
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

    Raises
    ------
    InputError
        The arm's lengths or the shoulder's place are not known, a hand is out of the arm's reach,
        a trial is shorter than three samples, or the sample rate is below 200 Hz.
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


def _of_trial(recording: Recording, geometry: Geometry, at: slice) -> FloatArray:
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
