"""Passive samples from a recording of joint angle and torque (kind "joint")."""

from __future__ import annotations

from typing import Final, Literal

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError, NotIdentifiableError
from armimpedance.core.records import Recording
from armimpedance.joint.relaxed.equations import parallel_equations
from armimpedance.joint.relaxed.linear import solve_linear
from armimpedance.joint.relaxed.samples import PassiveSamples
from armimpedance.joint.relaxed.terms import Terms
from armimpedance.numerics.regression import Fit
from armimpedance.numerics.signals import lowpass, refuse_degrees, smoothed_derivatives

#: One-sided 95 % of the normal distribution.
_ONE_SIDED: Final = 1.645


def from_joint_recording(
    recording: Recording,
    *,
    cutoff_hz: float | None = 8.0,
    torque_sign: Literal[1, -1] | None = None,
) -> PassiveSamples:
    """Filter angle and torque of every trial alike; the torque column holds the passive torque.

    The passive torque is the left side of ``k (q - q_r) + h qd + f sign(qd)``: positive stiffness
    and viscosity for a passive joint. Laboratories store the limb's torque on the device too,
    which is the opposite. Without `torque_sign` the sign stays as it is, unless stiffness **and**
    the power that viscosity and friction take up are both negative beyond doubt (upper one-sided
    95 % limits below zero): no passive joint can do that, so the sign is turned, and a note says
    so.

    Parameters
    ----------
    recording : Recording
        A recording of kind "joint"; its joints are called ``q1``, ``q2``, ... in messages and
        results.
    cutoff_hz : float or None
        Cut-off of the zero-phase low-pass that angle and torque go through.
    torque_sign : 1, -1 or None
        Factor of the torque column.

    Returns
    -------
    PassiveSamples

    Raises
    ------
    InputError
        Another kind of recording, too few samples, a cut-off beyond the Nyquist frequency,
        angles that cannot be radians, another sign.
    """
    if recording.kind != "joint":
        raise InputError(f"a recording of kind {recording.kind!r}", expected="kind 'joint'")
    if torque_sign not in (None, 1, -1):
        raise InputError(f"torque sign {torque_sign}", expected="1, -1, or none")
    joints = tuple(f"q{j + 1}" for j in range(recording.axes))
    refuse_degrees(recording.position, joints)
    rate = recording.sample_rate_hz
    trials = [recording.samples_of(t) for t in range(recording.n_trials)]
    smooth = [smoothed_derivatives(recording.position[s], rate, cutoff_hz) for s in trials]
    q, qd, qdd = (np.concatenate([trial[d] for trial in smooth]) for d in range(3))
    torque = (torque_sign or 1) * recording.force
    filtered = [lowpass(torque[s], cutoff_hz, rate, axis=0) for s in trials]
    samples = PassiveSamples(
        sample_rate_hz=rate,
        offsets=recording.offsets,
        joints=joints,
        q=q,
        qd=qd,
        torque=np.concatenate(filtered),
        measured_q=recording.position,
        cutoff_hz=cutoff_hz,
        qdd=qdd,
        measured_torque=torque,
        trials=tuple(str(t) for t in recording.trials["trial"]),
    )
    if torque_sign is not None or not _impossible(samples):
        return samples
    return samples.with_torque_turned(
        "as read, the torque would be that of a joint with negative stiffness that drives the "
        "motion: its sign was turned (a torque sign of 1 keeps it)"
    )


def _impossible(samples: PassiveSamples) -> bool:
    """Whether every joint's stiffness and dissipation are negative beyond doubt."""
    return all(_negative(samples.only(j)) for j in range(len(samples.joints)))


def _negative(samples: PassiveSamples) -> bool:
    equations = parallel_equations(samples, Terms("free"))
    try:
        fit = solve_linear(equations, samples.sample_rate_hz).robust
    except (NotIdentifiableError, InputError):
        return False
    W, _ = equations.stacked()
    # mean power of h qd + f sign(qd): h mean(qd^2) + f mean(|qd|), W's columns k, h, f, offset
    power = np.array([0.0, np.mean(W[:, 1] ** 2), np.mean(W[:, 1] * W[:, 2]), 0.0])
    stiffness = np.array([1.0, 0.0, 0.0, 0.0])
    return _upper(fit, stiffness) < 0 and _upper(fit, power) < 0


def _upper(fit: Fit, weights: FloatArray) -> float:
    """Upper one-sided 95 % limit of a weighted sum of the parameters."""
    spread = float(weights @ fit.covariance @ weights)
    return float(weights @ fit.parameters) + _ONE_SIDED * float(np.sqrt(spread))
