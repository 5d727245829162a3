"""Intervals of an ellipse from resampled matrices instead of derivatives.

The bootstrap's standard error with a t quantile, on the scales of the delta method: log of the
size, log of the shape, and the orientation as an angle of an axis, which wraps at half a turn.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import stdtrit

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import EstimationError, InputError, check_level
from armimpedance.hand.ellipses.geometry import Ellipse

#: Largest share of resamples without an ellipse: with more, the others are not representative.
MOST_LOST = 0.1


@dataclass(frozen=True)
class ResampledEllipse:
    """Spread of an ellipse over resamples.

    `correlation_of_axes`: mean resultant length of the resampled axes, 1 if they all agree, 0 if
    any direction is as likely as any other.
    `lost`: share of the resamples that were not positive definite.
    `dof`: degrees of freedom of the t distribution.
    """

    of: Ellipse
    sd_log_size: float
    sd_orientation_rad: float
    sd_log_shape: float
    correlation_of_axes: float
    lost: float
    dof: float

    def interval(self, level: float = 0.95) -> FloatArray:
        """Limits (low, high) of size, orientation (rad) and shape, (3, 2).

        Raises InputError: the level is not between 0 and 1.
        """
        check_level(level)
        t = float(stdtrit(self.dof, (1 + level) / 2))
        sides = np.array([-t, t])
        turn = np.clip(self.of.orientation_rad + sides * self.sd_orientation_rad, -np.pi, np.pi)
        shape = np.minimum(self.of.shape * np.exp(sides * self.sd_log_shape), 1.0)
        if t * self.sd_orientation_rad > np.pi / 2:
            turn = np.array([-np.pi / 2, np.pi / 2])
        return np.array([self.of.size * np.exp(sides * self.sd_log_size), turn, shape])


def resampled_ellipse(of: Ellipse, matrices: ArrayLike, dof: float) -> ResampledEllipse:
    """Spread of `of` over resampled matrices.

    Parameters
    ----------
    of : Ellipse
        Ellipse of the matrix from all data.
    matrices : (R, 2, 2)
        Resamples of its matrix.
    dof : float

    Returns
    -------
    ResampledEllipse
        The ellipse with the spread of its size, orientation (rad) and shape.

    Raises
    ------
    EstimationError
        More than a tenth of the resamples has no ellipse.
    InputError
        Not (R, 2, 2), or fewer than ten.
    """
    A = np.asarray(matrices, dtype=np.float64)
    if A.ndim != 3 or A.shape[1:] != (2, 2) or len(A) < 10:
        raise InputError(f"resamples of shape {A.shape}", expected="(R, 2, 2), R >= 10")
    mean = (A[:, 0, 0] + A[:, 1, 1]) / 2
    x, y = (A[:, 0, 0] - A[:, 1, 1]) / 2, (A[:, 0, 1] + A[:, 1, 0]) / 2
    radius = np.hypot(x, y)
    valid = mean > radius
    lost = 1 - float(valid.mean())
    if lost > MOST_LOST:
        raise EstimationError(f"{100 * lost:.0f} % of the resamples have no ellipse")
    large, small = (mean + radius)[valid], (mean - radius)[valid]
    twice = np.exp(1j * (np.arctan2(y, x)[valid] - 2 * of.axis_angle_rad))
    return ResampledEllipse(
        of=of,
        sd_log_size=float(np.std(np.log(large * small), ddof=1)),
        sd_orientation_rad=float(np.sqrt(np.mean((np.angle(twice) / 2) ** 2))),
        sd_log_shape=float(np.std(np.log(small / large), ddof=1)),
        correlation_of_axes=float(abs(twice.mean())),
        lost=lost,
        dof=dof,
    )
