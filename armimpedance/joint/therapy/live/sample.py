"""What a running robot is told of each sample."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Reading:
    """A value in per cent that can be told or not.

    Attributes
    ----------
    percent, sd : float
        The value and its standard error; NaN where there is no denominator.
    valid : bool
        Whether it can be told.
    """

    percent: float
    sd: float
    valid: bool


@dataclass(frozen=True, slots=True)
class LiveSample:
    """What is known of the sample half a kernel ago; per cent as in `Contribution`.

    Attributes
    ----------
    time_s : float
        Time of that sample.
    q_rad, user_Nm, arm_Nm : float
        Angle of the moving axis, and torques about it.
    counts : bool
        Whether the axis moves.
    of_sample : Reading
        (3).
    in_movement : bool
        Whether it lies in the movement; before a movement the movement's values are NaN.
    ratio, projection, share : Reading
        Of the movement so far. The share, beside the robot's inertia, is what a display shows.
    running : Reading
        The projection in the running window.
    """

    time_s: float
    q_rad: float
    user_Nm: float
    arm_Nm: float
    counts: bool
    of_sample: Reading
    in_movement: bool
    ratio: Reading
    projection: Reading
    share: Reading
    running: Reading
