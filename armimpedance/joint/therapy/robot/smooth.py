"""Angles, their derivatives and motor torques of every trial after one and the same kernel.

The kernel is a symmetric spline of finite support: what it gives for a sample needs half its width
before and after it, no more. So a robot that runs it live gets the very same numbers, half a width
late, and no trial has filter transients; half a width at either end of a trial has no result.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.errors import InputError
from armimpedance.core.records import Recording
from armimpedance.numerics.signals import Kernels, spline_kernels

#: Support of the kernel, s: its -3 dB lie at about 9 Hz, arm movements of therapy below 1 Hz.
WIDTH_S: Final = 0.1


@dataclass(frozen=True)
class SmoothTrial(FrozenRecord):
    """One trial after the kernel; S samples, n axes.

    Attributes
    ----------
    row : int
        Row of the recording's trial table, from 0.
    time_s : (S,)
    q, qd, qdd, motor : (S, n)
        rad, rad/s, rad/s^2, N m; motor torques are positive where they accelerate their axis.
    """

    row: int
    time_s: Annotated[FloatArray, "S"]
    q: Annotated[FloatArray, "S n"]
    qd: Annotated[FloatArray, "S n"]
    qdd: Annotated[FloatArray, "S n"]
    motor: Annotated[FloatArray, "S n"]

    def between(self, first_s: float, last_s: float) -> SmoothTrial:
        """The samples from `first_s` to `last_s`, both included, on the trial's clock."""
        kept = (self.time_s >= first_s - 1e-9) & (self.time_s <= last_s + 1e-9)
        parts = (getattr(self, name)[kept] for name in ("time_s", "q", "qd", "qdd", "motor"))
        return SmoothTrial(self.row, *parts)


def no_step() -> None:
    """Nobody wants to know how far the work is."""


def kernels_for(sample_rate_hz: float, width_s: float = WIDTH_S) -> Kernels:
    """The kernels of one sample rate.

    Raises
    ------
    InputError
        The width holds too few samples.
    """
    if not sample_rate_hz * width_s >= 12:
        raise InputError(
            f"samples at {sample_rate_hz:g} Hz", expected=f"{12 / width_s:g} Hz or more"
        )
    return spline_kernels(width_s, sample_rate_hz)


def smooth_trials(recording: Recording, width_s: float = WIDTH_S) -> tuple[SmoothTrial, ...]:
    """All trials after the kernel.

    Parameters
    ----------
    recording : Recording
        Of kind "joint", with commanded torques. A `Recording` holds torques by the limb on the
        device; the motors' are the opposite.
    width_s : float
        Support of the kernel, s.

    Returns
    -------
    tuple of SmoothTrial

    Raises
    ------
    InputError
        A trial that is shorter than the kernel.
    """
    kernels = kernels_for(recording.sample_rate_hz, width_s)
    return tuple(_smooth(recording, row, kernels) for row in range(recording.n_trials))


def _smooth(recording: Recording, row: int, kernels: Kernels) -> SmoothTrial:
    samples, half = recording.samples_of(row), kernels.half
    q, motor = recording.position[samples], -recording.force[samples]
    if len(q) < 2 * half + 2:
        raise InputError(
            f"trial {recording.trials['trial'].iloc[row]} has {len(q)} samples",
            expected=f"{2 * half + 2} or more",
        )
    time = recording.time_s[samples][half : len(q) - half]
    weights = np.stack([kernels.smooth, kernels.first, kernels.second])
    # window w (S, n, 2 h + 1), weights (3, 2 h + 1): (q, qd, qdd) = weights w
    windows = np.lib.stride_tricks.sliding_window_view(q, 2 * half + 1, axis=0)
    q_s, qd, qdd = np.einsum("snw,dw->dsn", windows, weights, optimize=True)
    torques = np.lib.stride_tricks.sliding_window_view(motor, 2 * half + 1, axis=0)
    return SmoothTrial(row, time, q_s, qd, qdd, torques @ kernels.smooth)
