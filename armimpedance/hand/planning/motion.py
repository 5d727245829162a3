"""A planned motion in the modes of its window: the rows of the impedance equation before any data.

The hand follows a command along u as ``sum_a u_a x^(a)``, x^(a) being its motion for a command
along axis a of d. Over equally spaced directions ``sum_u u u^T = (directions / d) I``: the mean
information of a trial is the d-th part of that of one trial along each axis.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.hand.planning.profile import Profile
from armimpedance.hand.planning.servo import follow
from armimpedance.hand.planning.setting import Setting
from armimpedance.numerics.signals import Modes, delayed


@dataclass(frozen=True)
class PlannedMotion:
    """What the hand will do, and how noise will weigh on it.

    Attributes
    ----------
    setting : Setting
    profile : Profile
    """

    setting: Setting
    profile: Profile

    @cached_property
    def displacement(self) -> FloatArray:
        """Displacement of the hand for a command along each axis, (d, d, S)."""
        setting, profile = self.setting, self.profile
        course = profile.at(setting.lags(profile.duration_s))
        return follow(setting.servo, setting.arm.parameters, course, setting.sample_rate_hz)

    @cached_property
    def weight(self) -> FloatArray:
        """Inverse covariance of the noise in the equation's rows, (d n, d n)."""
        V = np.linalg.inv(self.setting.covariance(self.displacement, self.profile.duration_s))
        return np.asarray((V + V.T) / 2)

    def rows(self, delays_s: Sequence[float] = ()) -> FloatArray:
        """Rows of the equation for a command along each axis, (d, d n, (3 + delays) d^2)."""
        modes = self.setting.modes(self.profile.duration_s)
        moved = modal_motion(self.displacement, modes, self.setting.sample_rate_hz, delays_s)
        return equation_rows(moved)


def modal_motion(
    displacement: FloatArray, modes: Modes, sample_rate_hz: float, delays_s: Sequence[float] = ()
) -> FloatArray:
    """x'', x', x, then x at each delay, in modes.

    Parameters
    ----------
    displacement : (..., S)
        At rest before the window.

    Returns
    -------
    (3 + len(delays_s), ..., n)
    """
    derivatives = [displacement @ part.T for part in (modes.second, modes.first, modes.smooth)]
    late = [delayed(displacement, delay * sample_rate_hz) @ modes.smooth.T for delay in delays_s]
    return np.stack([*derivatives, *late])


def equation_rows(motion: FloatArray) -> FloatArray:
    """Rows of ``G theta``, theta = M, B, K, ... row by row.

    Parameters
    ----------
    motion : (r, ..., d, n)

    Returns
    -------
    (..., d n, r d^2)
    """
    r, *others, d, n = motion.shape
    moved = np.moveaxis(motion, 0, -3)
    rows = np.zeros((*others, d, n, r, d, d))
    for i in range(d):
        # row (i, n), column (m, i, k)
        rows[..., i, :, :, i, :] = np.moveaxis(moved, -1, -3)
    return rows.reshape(*others, d * n, r * d * d)


def information(rows: FloatArray, weight: FloatArray) -> FloatArray:
    """Mean information of a trial (p, p) about p parameters.

    Parameters
    ----------
    rows : (d, d n, p)
        For a command along each axis.
    weight : (d n, d n)
        Inverse covariance of the noise.
    """
    # I (p, p) = 1/d sum_a G_a^T (p, dn) V (dn, dn) G_a (dn, p)
    total = (rows.transpose(0, 2, 1) @ weight @ rows).sum(axis=0) / len(rows)
    return np.asarray((total + total.T) / 2)
