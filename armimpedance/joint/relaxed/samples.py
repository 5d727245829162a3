"""Samples of passive joints: motion and passive torque, both after the same filter.

The passive torque is the right-hand side of Venture's equation (6),
``k (q - q_r) + h qd + f sign(qd)``; torque that resists the motion is positive. For a relaxed limb
it is -H, minus the torque of inertia, Coriolis and gravity.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord, IntArray
from armimpedance.core.errors import InputError, RecordError
from armimpedance.core.motion import MotionRecording
from armimpedance.core.trials import check_rate, trial_slices
from armimpedance.joint.relaxed.hinge import (
    SUBSTEPS,
    HingeDynamics,
    harmonics_at,
    hinge_coefficients,
    weight_harmonics,
)
from armimpedance.limb.arm import skeleton_model
from armimpedance.numerics.signals import (
    SPLINE_DEGREE,
    lowpass,
    refuse_degrees,
    smoothed_derivatives,
)


@dataclass(frozen=True)
class PassiveSamples(FrozenRecord):
    """Motion and passive torque of j joints, N samples of all trials one after another.

    Attributes
    ----------
    sample_rate_hz : float
    offsets : (T + 1,) int
        Samples of trial t: ``offsets[t]:offsets[t + 1]``.
    joints : tuple of j str
    q, qd : (N, j)
        rad and rad/s, after the filter.
    torque : (N, j)
        Passive torque, N m, after the filter.
    measured_q : (N, j)
        Angles before the filter, rad.
    cutoff_hz : float or None
        Cut-off of the zero-phase second-order Butterworth low-pass of q and of the torque or its
        components; None: no filter.
    qdd : (N, j) or None
        rad/s^2, after the filter; None if it was not computed.
    measured_torque : (N, j) or None
        Torque before the filter, N m, if it is measured and not computed from the motion.
    hinges : tuple of j HingeDynamics or None
        Dynamics of each joint, with the other coordinates as measured, if a skeleton is known.
    trials : tuple of T str
        Names of the trials, for messages.
    notes : tuple of str
        Notes for a reader of the result.
    """

    sample_rate_hz: float
    offsets: Annotated[IntArray, "T+1"]
    joints: Annotated[tuple[str, ...], "j"]
    q: Annotated[FloatArray, "N j"]
    qd: Annotated[FloatArray, "N j"]
    torque: Annotated[FloatArray, "N j"]
    measured_q: Annotated[FloatArray, "N j"]
    cutoff_hz: float | None = None
    qdd: Annotated[FloatArray, "N j"] | None = None
    measured_torque: Annotated[FloatArray, "N j"] | None = None
    hinges: tuple[HingeDynamics, ...] | None = None
    trials: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        check_rate(self.sample_rate_hz)
        if len(self.offsets) < 2 or self.offsets[0] != 0 or (np.diff(self.offsets) <= 0).any():
            raise RecordError("a trial has no samples", expected="rising offsets from 0")
        if self.offsets[-1] != len(self.q):
            raise RecordError(f"{len(self.q)} samples", expected=f"{self.offsets[-1]}")
        trials = self.trials or tuple(str(t + 1) for t in range(self.n_trials))
        object.__setattr__(self, "trials", trials)
        if len(trials) != self.n_trials or len(self.hinges or self.joints) != len(self.joints):
            raise RecordError("names of trials or dynamics of joints that do not match the samples")

    @property
    def n_trials(self) -> int:
        """Number of trials T."""
        return len(self.offsets) - 1

    def slices(self) -> list[slice]:
        """Slices of the samples of each trial."""
        return trial_slices(self.offsets)

    def joint(self, name: str) -> int:
        """Column of the joint with this name.

        Raises
        ------
        InputError
            There is no such joint.
        """
        if name not in self.joints:
            raise InputError(f"no joint {name!r}", expected=f"one of {', '.join(self.joints)}")
        return self.joints.index(name)

    def only(self, joint: int) -> PassiveSamples:
        """Samples of one joint, numbered from 0."""
        column = slice(joint, joint + 1)
        hinges = self.hinges and self.hinges[column]
        return replace(
            self, joints=self.joints[column], hinges=hinges, **self._signals(np.s_[:, column])
        )

    def select(self, rows: list[int]) -> PassiveSamples:
        """Samples of these trials only (rows from 0)."""
        kept = [self.slices()[r] for r in rows]
        index = np.concatenate([np.arange(s.start, s.stop) for s in kept])
        hinges = self.hinges and tuple(h.select(rows) for h in self.hinges)
        return replace(
            self,
            offsets=np.concatenate([[0], np.cumsum([s.stop - s.start for s in kept])]),
            hinges=hinges,
            trials=tuple(self.trials[r] for r in rows),
            **self._signals(index),
        )

    def _signals(self, at: Any) -> dict[str, Any]:
        """Parts of all signals (N, j), selected by `at`."""
        names = ("q", "qd", "torque", "measured_q", "qdd", "measured_torque")
        signals = {name: getattr(self, name) for name in names}
        return {name: None if x is None else x[at] for name, x in signals.items()}

    def in_thirds(self) -> PassiveSamples:
        """Cut a single trial into three consecutive ones.

        Raises
        ------
        InputError
            Several trials.
        """
        if self.n_trials != 1:
            raise InputError(f"{self.n_trials} trials to cut into thirds", expected="one")
        count = int(self.offsets[-1])
        edges = [0, count // 3, 2 * count // 3, count]
        names = tuple(f"third {i} of trial {self.trials[0]}" for i in (1, 2, 3))
        hinges = self.hinges and tuple(h.cut(edges) for h in self.hinges)
        return replace(self, offsets=np.array(edges), hinges=hinges, trials=names)

    def pointing(self, up: str) -> PassiveSamples:
        """Samples of a single joint of a skeleton as if another axis (``x``, ``-x``, ...) pointed
        up.

        Raises
        ------
        InputError
            No skeleton.
        """
        if self.hinges is None:
            raise InputError("no skeleton", expected="samples from a motion recording")
        hinge = self.hinges[0].pointing(up)
        per = 2 * SUBSTEPS
        pairs = zip(hinge.coefficients, self.hinges[0].coefficients, strict=True)
        more = np.concatenate([(new - old)[::per, 2:] for new, old in pairs])
        weight = (more * harmonics_at(self.q[:, 0])).sum(axis=-1)
        return replace(self, hinges=(hinge,), torque=self.torque - weight[:, None])

    def with_torque_turned(self, sentence: str) -> PassiveSamples:
        """Return a copy with the torque of opposite sign, and a note on it."""
        turned = None if self.measured_torque is None else -self.measured_torque
        notes = (*self.notes, sentence)
        return replace(self, torque=-self.torque, measured_torque=turned, notes=notes)


# Coordinates that do not move visibly are replaced by their mean.
#
# In a simulation, noise of the other coordinates drives the joint, also at its resonance, where no
# filter can separate noise from motion. If a limb that is held moves by less than its markers'
# noise, its mean is a better estimate (generalised cross-validation: P. Craven, G. Wahba, Numer.
# Math. 31 (1979) 377-403).


def as_still_as_shown(
    coordinates: FloatArray, sample_rate_hz: float, cutoff_hz: float | None
) -> FloatArray:
    """Return one trial's coordinates (S, n) after the low-pass, or their mean if it predicts
    better.

    Motion of less than about three quarters of its noise is treated as none.

    `coordinates` (S, n).
    `cutoff_hz`: of the zero-phase second-order Butterworth low-pass; None: the coordinates have no
    noise and are not changed.
    """
    if cutoff_hz is None:
        return coordinates
    S = len(coordinates)
    still = np.repeat(coordinates.mean(axis=0, keepdims=True), S, axis=0)
    smooth = lowpass(coordinates, cutoff_hz, sample_rate_hz, axis=0)
    moves = _score(coordinates, smooth, _freedom(S, cutoff_hz, sample_rate_hz))
    return np.where(_score(coordinates, still, 1.0) <= moves, still, smooth)


def _score(signal: FloatArray, smooth: FloatArray, freedom: float) -> FloatArray:
    """Mean square error (n,) with which the smooth curve (S, n) predicts samples not used for
    it."""
    residual = ((signal - smooth) ** 2).mean(axis=0)
    return np.asarray(residual / (1 - freedom / len(signal)) ** 2)


def _freedom(samples: int, cutoff_hz: float, rate_hz: float) -> float:
    """Trace of the low-pass: its mean gain ``1 / (1 + r^4)``, r the ratio of warped frequencies."""
    frequency = (np.arange(512) + 0.5) / 1024
    ratio = np.tan(np.pi * frequency) / np.tan(np.pi * cutoff_hz / rate_hz)
    return samples * float(np.mean(1 / (1 + ratio**4)))


# Passive samples from the joint motion of a skeleton with known inertia.
#
# Import this module only if a skeleton is used: it loads Pinocchio.


def from_motion(
    motion: MotionRecording,
    joints: Sequence[str],
    *,
    cutoff_hz: float | None = 8.0,
) -> PassiveSamples:
    """Filter every trial separately, and take the passive torque ``-H_j`` from the skeleton.

    All coordinates are measured, so all enter H (Venture elbow, eq. (6), Gamma = 0 and Q = 0).

    Parameters
    ----------
    motion : MotionRecording
        Recording whose skeleton has masses and inertias.
    joints : names of coordinates
    cutoff_hz : float or None
        Cut-off of the zero-phase low-pass; None for data without noise. The default passes an
        elbow's swing of 1.5 Hz and removes most of the markers' noise from its acceleration; joints
        that swing at 5 Hz need 15.

    Returns
    -------
    PassiveSamples

    Raises
    ------
    InputError
        Unknown joints, a skeleton without mass, too few samples, a cut-off beyond the Nyquist
        frequency, angles that cannot be radians.
    """
    names = motion.skeleton.coordinates
    chosen = _columns(joints, names, motion.skeleton.root_coordinates)
    if motion.skeleton.mass_kg <= 0:
        raise InputError("a skeleton without mass", expected="masses and inertias in skeleton.json")
    refuse_degrees(motion.coordinates[:, chosen], tuple(joints))
    model = skeleton_model(motion.skeleton)
    trials = [motion.coordinates[motion.samples_of(t)] for t in range(motion.n_trials)]
    smooth = [smoothed_derivatives(q, motion.sample_rate_hz, cutoff_hz) for q in trials]
    q, qd, qdd = (np.concatenate([trial[d] for trial in smooth]) for d in range(3))
    torque = -_inverse_dynamics(model, q, qd, qdd)
    # the torque keeps the noise of still coordinates, because it cancels that of the angle
    still = [as_still_as_shown(q, motion.sample_rate_hz, cutoff_hz) for q in trials]
    fine = [_between_samples(q, motion.sample_rate_hz) for q in still]
    return PassiveSamples(
        sample_rate_hz=motion.sample_rate_hz,
        offsets=motion.offsets,
        joints=tuple(joints),
        q=q[:, chosen],
        qd=qd[:, chosen],
        torque=torque[:, chosen],
        measured_q=motion.coordinates[:, chosen],
        cutoff_hz=cutoff_hz,
        qdd=qdd[:, chosen],
        hinges=tuple(
            HingeDynamics(
                tuple(hinge_coefficients(model, j, *trial) for trial in fine),
                tuple(weight_harmonics(model, j, q) for q in still),
            )
            for j in chosen
        ),
        trials=tuple(str(t) for t in motion.trials["trial"]),
    )


def _columns(joints: Sequence[str], names: tuple[str, ...], root: tuple[str, ...]) -> list[int]:
    turning = [name for name in names if name not in root]
    if not joints or len(set(joints)) != len(joints):
        raise InputError(f"joints {', '.join(joints)}", expected="one or more, none twice")
    for name in joints:
        if name not in turning:
            raise InputError(f"no joint {name!r}", expected=f"one of {', '.join(turning)}")
    return [names.index(name) for name in joints]


def _inverse_dynamics(model: Any, q: FloatArray, qd: FloatArray, qdd: FloatArray) -> FloatArray:
    """Joint torques H (N, n) by inverse dynamics."""
    import pinocchio as pin

    data = model.createData()
    rows = zip(q, qd, qdd, strict=True)
    return np.array([pin.rnea(model, data, *row).copy() for row in rows])


def _between_samples(smooth: FloatArray, rate_hz: float) -> tuple[FloatArray, ...]:
    """Smoothed motion (S, n) and its derivatives at ``2 SUBSTEPS`` points per sample."""
    from scipy.interpolate import make_interp_spline

    samples = np.arange(len(smooth)) / rate_hz
    points = np.arange(2 * SUBSTEPS * (len(smooth) - 1) + 1) / (2 * SUBSTEPS * rate_hz)
    spline = make_interp_spline(samples, smooth, k=SPLINE_DEGREE)
    return tuple(spline(points, nu=d) for d in range(3))
