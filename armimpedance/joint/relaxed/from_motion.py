"""Passive samples from the joint motion of a skeleton whose inertia is known.

Import this module only where a skeleton is used: it loads Pinocchio.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.motion import MotionRecording
from armimpedance.joint.relaxed.hinge import SUBSTEPS, HingeDynamics, hinge_coefficients
from armimpedance.joint.relaxed.samples import PassiveSamples
from armimpedance.joint.relaxed.stillness import as_still_as_shown
from armimpedance.limb.arm import skeleton_model
from armimpedance.numerics.signals import SPLINE_DEGREE, refuse_degrees, smoothed_derivatives


def from_motion(
    motion: MotionRecording,
    joints: Sequence[str],
    *,
    cutoff_hz: float | None = 8.0,
) -> PassiveSamples:
    """Smooth every trial for itself, and take the passive torque ``-H_j`` from the skeleton.

    All coordinates are measured, so all enter H (Venture elbow, eq. (6), Gamma = 0 and Q = 0).

    Parameters
    ----------
    motion : MotionRecording
        Recording whose skeleton has masses and inertias.
    joints : names of coordinates
    cutoff_hz : float or None
        Cut-off of the zero-phase low-pass; None for data without noise. The default keeps an
        elbow's swing of 1.5 Hz and takes most of the markers' noise off its acceleration; joints
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
    # the torque keeps the noise of what is held still: it cancels that of the angle; see stillness
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
            HingeDynamics(tuple(hinge_coefficients(model, j, *trial) for trial in fine))
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
    """H (N, n)."""
    import pinocchio as pin

    data = model.createData()
    rows = zip(q, qd, qdd, strict=True)
    return np.array([pin.rnea(model, data, *row).copy() for row in rows])


def _between_samples(smooth: FloatArray, rate_hz: float) -> tuple[FloatArray, ...]:
    """The smoothed motion (S, n) and its derivatives at ``2 SUBSTEPS`` points per sample."""
    from scipy.interpolate import make_interp_spline

    samples = np.arange(len(smooth)) / rate_hz
    points = np.arange(2 * SUBSTEPS * (len(smooth) - 1) + 1) / (2 * SUBSTEPS * rate_hz)
    spline = make_interp_spline(samples, smooth, k=SPLINE_DEGREE)
    return tuple(spline(points, nu=d) for d in range(3))
