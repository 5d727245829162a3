"""Channels of the reaches, at the hand and at the joints, after one common low-pass.

The dynamics of the links are non-linear, so they are computed from the measured motion first. Then
all terms of the joint equation pass the same linear filter, which leaves the equation unchanged.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray, FrozenRecord, IntArray
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
# eq. (14), for any two links; their masses are not needed.

#: Inertial parameters of two links: a, b, c.
N_INERTIAL: Final = 3


@dataclass(frozen=True)
class ArmGeometry(FrozenRecord):
    """Lengths of the arm (its masses are placeholders), and place of the shoulder."""

    arm: TwoLinkArm
    shoulder_m: Annotated[FloatArray, "2"]


def geometry_of(recording: Recording) -> ArmGeometry:
    """Geometry of the arm of a recording.

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
        needed = {
            "subject.upper_arm_m": upper,
            "subject.forearm_hand_m": fore,
            "shoulder_m": shoulder,
        }
        missing = ", ".join(name for name, value in needed.items() if value is None)
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
    """Coefficients of phi in ``d(Y phi)_i/dq_j`` and ``d(Y phi)_i/dqd_j``, (2, 2, 3) each.

    `q`, `qd`, `qdd` (2,): one instant.
    """
    cosine, sine = np.cos(q[1]), np.sin(q[1])
    (w1, w2), (a1, a2) = qd, qdd
    by_angle, by_rate = np.zeros((2, 2, N_INERTIAL)), np.zeros((2, 2, N_INERTIAL))
    by_angle[0, 1, 2] = -(2 * a1 + a2) * sine - (2 * w1 * w2 + w2**2) * cosine
    by_angle[1, 1, 2] = -a1 * sine + w1**2 * cosine
    by_rate[0, 0, 2] = -2 * w2 * sine
    by_rate[0, 1, 2] = -2 * (w1 + w2) * sine
    by_rate[1, 0, 2] = 2 * w1 * sine
    return by_angle, by_rate


#: Cutoff of the low-pass: a push of 60 ms has hardly anything above.
CUTOFF_HZ: Final = 30.0
#: Lowest sample rate: slower records do not resolve the accelerations of a push.
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
    """Low-pass filtered channels of all trials.

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
    """Compute the channels of all trials of a recording.

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
    # force by the limb: the sensor's, and that which accelerates the mass between sensor and hand
    F = recording.force[at] + recording.handle_mass_kg * a
    q = arm.joint_angles(p)
    J = arm.jacobian(q)
    qd = np.linalg.solve(J, v[..., None])[..., 0]
    # a = J qdd + Jdot qd, (2,) = (2, 2) (2,) + (2,)
    turning = np.einsum("sij,sj->si", arm.jacobian_rate(q, qd), qd)
    qdd = np.linalg.solve(J, (a - turning)[..., None])[..., 0]
    torque = np.einsum("sij,si->sj", J, F)
    Y = inertial_rows(q, qd, qdd).reshape(len(p), -1)
    channels = np.concatenate([p, v, a, F, q, qd, qdd, Y, torque], axis=1)
    return lowpass(channels, CUTOFF_HZ, rate, axis=0)


# Pushed trials, with onset and direction of the push, and free trials.

#: Columns of the trial table, and their content.
COLUMNS: Final = {
    "phase": "a name for when the push comes, empty in a trial that nobody pushed",
    "push_deg": "its direction, empty in a trial that nobody pushed, and where the samples' "
    "columns command_x and command_y hold what the robot was told",
    "push_onset_s": "its onset on the trial's clock, empty in a trial that nobody pushed",
}
#: Optional columns of the samples: commands of a robot that pushes throughout, in any unit.
COMMAND: Final = ("command_x", "command_y")
#: Optional column: the end of the push.
END: Final = "push_end_s"
#: Assumed duration of a push without a stated end (s).
USUAL_PUSH_S: Final = 0.12


@dataclass(frozen=True)
class Pushes(FrozenRecord):
    """Pushes of T trials.

    `phase`: "" for a free trial.
    `direction` (T, 2): unit vectors; 0 for a free trial.
    `onset_s` (T,): 0 for a free trial.
    `duration_s`: of the longest push.
    `command` (N, 2) or None: the robot's command at each sample, if it pushed throughout.
    """

    phase: tuple[str, ...]
    direction: Annotated[FloatArray, "T 2"]
    onset_s: Annotated[FloatArray, "T"]
    duration_s: float
    command: Annotated[FloatArray, "N 2"] | None = None

    def throughout(self, phase: str) -> bool:
        """True if this phase's pushes are random courses, which have no direction."""
        return not self.direction[self.rows(phase)].any()

    @property
    def pushed(self) -> BoolArray:
        """True for pushed trials (T,)."""
        return np.array([bool(name) for name in self.phase])

    @property
    def phases(self) -> tuple[str, ...]:
        """Names of the phases, in the order of their mean onset."""
        names = [name for name in dict.fromkeys(self.phase) if name]
        return tuple(sorted(names, key=lambda name: float(self.onset_s[self.rows(name)].mean())))

    def rows(self, phase: str) -> BoolArray:
        """True for trials (T,) that were pushed at this phase."""
        return np.array([name == phase for name in self.phase])


def pushes_of(recording: Recording) -> Pushes:
    """Read the pushes from the trial table.

    Raises InputError: a column is missing, a pushed trial lacks its direction or onset, an onset
    lies outside of its trial, or no trial was pushed.
    """
    table = recording.trials
    command = _command(recording)
    for name, holds in COLUMNS.items():
        if name not in table and (name != "push_deg" or command is None):
            raise InputError(
                "no such column in the trial table", column=name, expected=f"a column with {holds}"
            )
    phase = tuple("" if _is_empty(value) else str(value) for value in table["phase"])
    pushed = np.array([bool(name) for name in phase])
    if not pushed.any():
        raise InputError("no trial was pushed", column="phase", expected=COLUMNS["phase"])
    onset = _numbers(recording, "push_onset_s", pushed)
    random = pushed & ~_has_direction(recording, command)
    angle = np.zeros(len(pushed))
    if (pushed & ~random).any():
        angle = np.nan_to_num(_numbers(recording, "push_deg", pushed & ~random))
    _check_onsets(recording, onset, pushed)
    radians = np.radians(np.where(pushed, angle, 0.0))
    direction = np.stack([np.cos(radians), np.sin(radians)], axis=1) * (pushed & ~random)[:, None]
    duration = USUAL_PUSH_S
    if END in table:
        lasting = _numbers(recording, END, pushed)[pushed] - onset[pushed]
        if not (lasting > 0).all():
            raise InputError("a push ends before it begins", column=END, expected="its end")
        duration = float(lasting.max())
    return Pushes(phase, direction, np.where(pushed, onset, 0.0), duration, command)


def _has_direction(recording: Recording, command: FloatArray | None) -> BoolArray:
    """True for trials (T,) whose push has a stated direction, which only commands can replace."""
    table = recording.trials
    if command is None:
        return np.ones(len(table), dtype=bool)
    if "push_deg" not in table:
        return np.zeros(len(table), dtype=bool)
    return np.array([not _is_empty(value) for value in table["push_deg"]])


def _command(recording: Recording) -> FloatArray | None:
    """Commands of the robot (N, 2): columns `COMMAND` of the samples, or None without them."""
    if not all(name in recording.extra for name in COMMAND):
        return None
    return np.nan_to_num(np.stack([recording.extra[name] for name in COMMAND], axis=1))


def _is_empty(value: object) -> bool:
    return value is None or value != value or str(value).strip() in ("", "none")


def _numbers(recording: Recording, column: str, pushed: BoolArray) -> FloatArray:
    try:
        values = recording.trials[column].to_numpy(dtype=float)
    except (TypeError, ValueError):
        raise InputError("not all numbers", column=column, expected=COLUMNS.get(column)) from None
    missing = pushed & ~np.isfinite(values)
    if missing.any():
        trial = recording.trials["trial"].iloc[int(np.flatnonzero(missing)[0])]
        raise InputError(
            f"trial {trial} was pushed and has no number", column=column, expected="a number"
        )
    return np.asarray(values)


def _check_onsets(recording: Recording, onset: FloatArray, pushed: BoolArray) -> None:
    first = recording.time_s[recording.offsets[:-1]]
    last = recording.time_s[recording.offsets[1:] - 1]
    outside = pushed & ((onset < first) | (onset > last))
    if outside.any():
        row = int(np.flatnonzero(outside)[0])
        raise InputError(
            f"trial {recording.trials['trial'].iloc[row]}: a push at {onset[row]:g} s",
            column="push_onset_s",
            expected=f"a time from {first[row]:g} to {last[row]:g} s",
        )
