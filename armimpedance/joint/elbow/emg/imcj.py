"""Index of muscle co-contraction around the joint (IMCJ), from EMG and isometric torques.

In isometric contraction ``torque = a_0 + sum_i a_i s_i`` with amplitudes s_i; then

    IMCJ = sum_i |a_i| s_i,

the sum of the absolute torques of agonists and antagonists, as defined by Osu and Gomi (1999) and
Osu et al. (2004). Ruiz (2011), section 6.2, cites that definition and prints the sum without the
absolute values; with an extensor's a_i < 0 this would be the net torque, near zero in
co-contraction. Two muscles give two terms; four (a mono- and a bi-articular flexor and extensor)
give four.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.errors import InputError
from armimpedance.core.records import Recording
from armimpedance.joint.elbow.emg.law import fit_law
from armimpedance.joint.elbow.emg.law_result import LinearLaw
from armimpedance.joint.elbow.emg.roles import Action, Role, roles_of
from armimpedance.numerics.signals import segment_amplitude

#: Largest standard deviation of the angle in an isometric trial (rad).
STILL_RAD: Final = 0.02


@dataclass(frozen=True, eq=False)
class ImcjCalibration(FrozenRecord):
    """Torque of each muscle at an activation of 1.

    `roles` (m,) tuple of Role.
    `law`: ``torque = a_0 + sum a_i s_i``, N m, flexion positive.
    """

    law: LinearLaw
    roles: tuple[Role, ...]
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()

    @property
    def muscles(self) -> tuple[str, ...]:
        """Names of the muscles, in the order of the amplitudes."""
        return self.law.muscles

    @property
    def gains(self) -> FloatArray:
        """Absolute coefficients ``|a_i|`` (m,), N m."""
        return np.abs(self.law.slopes)


def calibrate_imcj(
    recording: Recording,
    *,
    roles: Mapping[str, Action] | None = None,
    joint: int = 1,
    flexion_positive: bool = True,
) -> ImcjCalibration:
    """Fit a_i to isometric trials: one mean torque and one set of RMS amplitudes per trial.

    The torque of the limb on the device is that of the muscles and a constant (gravity), which a_0
    describes. Errors of the amplitudes are accounted for.

    Parameters
    ----------
    recording : Recording
        Kind "joint", interaction torque, isometric trials at several levels of flexion, extension
        and, at best, co-contraction; raw EMG with its maximum contraction.
    roles : mapping of muscle to "flexor" or "extensor", optional
        For muscles that are not in `roles.ROLES`.
    joint : int
        Axis of the recording, counted from 1.
    flexion_positive : bool
        True if flexion is positive in the recording's angle and torque.

    Returns
    -------
    ImcjCalibration

    Raises
    ------
    InputError
        Another kind of recording, a joint that moves, EMG that cannot be used, unknown roles, too
        few trials.
    NotIdentifiableError
        Muscles whose effects these trials cannot separate.
    """
    stated = roles_of(recording.muscles, roles)
    torque = _isometric_torque(recording, joint) * (1 if flexion_positive else -1)
    levels = segment_amplitude(recording)
    law = fit_law(
        "torque",
        torque,
        np.zeros(len(torque)),
        levels.amplitude,
        levels.sd,
        muscles=recording.muscles,
    )
    warnings = (*levels.warnings, *law.warnings, *_wrong_signs(law, stated))
    return ImcjCalibration(law, stated, levels.notes, warnings)


def imcj(
    calibration: ImcjCalibration, amplitude: ArrayLike, amplitude_sd: ArrayLike = 0.0
) -> tuple[FloatArray, FloatArray]:
    """Return the index and its standard error, N m, for amplitudes (..., m).

    ``sd^2 = s^T C s + sum_i (a_i sd_i)^2`` to first order, C the covariance of the a_i.

    Parameters
    ----------
    calibration : ImcjCalibration
    amplitude : (..., m)
        Shares of the maximum contraction, in the order of `calibration.muscles`.
    amplitude_sd : broadcasts to (..., m)
        Standard errors, independent of one another.

    Returns
    -------
    index, sd : (...)
        N m.

    Raises
    ------
    InputError
        The number of amplitudes differs from that of the muscles.
    """
    s = np.asarray(amplitude, dtype=np.float64)
    m = len(calibration.muscles)
    if s.shape[-1:] != (m,):
        raise InputError(f"amplitudes of shape {s.shape}", expected=f"(..., {m})")
    law = calibration.law
    a = law.slopes
    signed = s * np.sign(a)
    # variance (...,) = signed (..., m) C (m, m) signed^T + sum (a sd)^2
    variance = np.einsum("...i,ij,...j->...", signed, law.covariance[1:, 1:], signed)
    errors = np.broadcast_to(np.asarray(amplitude_sd, dtype=np.float64), s.shape)
    variance = variance + ((a * errors) ** 2).sum(axis=-1)
    return np.asarray(s @ np.abs(a)), np.sqrt(variance)


def _isometric_torque(recording: Recording, joint: int) -> FloatArray:
    """Mean torque of the limb on the device in each trial (T,), N m."""
    if recording.kind != "joint":
        raise InputError(f"a recording of kind {recording.kind!r}", expected="kind 'joint'")
    if recording.torque != "interaction":
        raise InputError(
            f"torque {recording.torque or 'of unknown kind'}",
            column="torque",
            expected="interaction: the motor's command does not show what a locked joint bears",
        )
    if not 1 <= joint <= recording.axes:
        raise InputError(f"no joint {joint}", expected=f"1 to {recording.axes}")
    torque = np.zeros(recording.n_trials)
    for t in range(recording.n_trials):
        part = recording.samples_of(t)
        moved = float(recording.position[part, joint - 1].std())
        if moved > STILL_RAD:
            raise InputError(
                f"trial {recording.trials['trial'].iloc[t]}: the joint moves by {moved:.3f} rad "
                "(standard deviation)",
                expected=f"an isometric trial, below {STILL_RAD:g} rad",
            )
        torque[t] = recording.force[part, joint - 1].mean()
    return torque


def _wrong_signs(law: LinearLaw, roles: tuple[Role, ...]) -> list[str]:
    """Warnings on muscles whose torque has the sign of their antagonists'."""
    a, names = law.slopes, law.muscles
    wrong = [i for i, role in enumerate(roles) if a[i] * role.sign < 0]
    if len(wrong) == len(names):
        return [
            "every muscle pulls the wrong way: is extension positive here, or the torque that "
            "of the device on the limb?"
        ]
    warnings = []
    for i in wrong:
        term = law.parameters[i + 1]
        low, high = term.ci95
        sure = "surely so" if low * high > 0 else "perhaps by its errors"
        warnings.append(
            f"{names[i]}, {'an' if roles[i].action == 'extensor' else 'a'} {roles[i].action}, has "
            f"{term.name} = {a[i]:.3g} N m ({low:.3g} to {high:.3g}; {sure}): crosstalk of a "
            "neighbour, muscles that vary together, or channels that were exchanged"
        )
    return warnings
