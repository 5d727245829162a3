"""Samples in which the axis moves: those that count for a contribution.

The friction of gears that stand still is anything up to its static value, to either side: what a
person does meanwhile cannot be told from it. On the elevation axis that is as much as the arm
weighs. So the sums of a movement leave out the samples in which its axis is slower than what the
friction's model holds from; a constant share is the same with them and without.
"""

from __future__ import annotations

from typing import Final

from armimpedance.core.arrays import BoolArray, FloatArray

#: Multiple of the speed over which the Coulomb friction builds up, `Loads.rise_rad_s`.
SLIDING: Final = 5.0
#: But an axis that is faster than this moves, rad/s (2.9 degrees per second).
SURELY_RAD_S: Final = 0.05


def slides(velocity: FloatArray, rise_rad_s: float) -> BoolArray:
    """Whether an axis moves, of the velocity's shape.

    Parameters
    ----------
    velocity : (...)
        rad/s.
    rise_rad_s : float
        v_s of its friction.

    Returns
    -------
    (...) bool
    """
    return abs(velocity) >= least_speed(rise_rad_s)


def least_speed(rise_rad_s: float) -> float:
    """The speed from which on an axis moves, rad/s."""
    return min(SLIDING * rise_rad_s, SURELY_RAD_S)
