"""What a running robot is told of each sample."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class LiveSample:
    """What is known of the sample half a kernel ago; per cent as in `Contribution`.

    Attributes
    ----------
    time_s : float
        Of that sample.
    q_rad, user_Nm, arm_Nm : float
        Of the moving axis.
    counts : bool
        Whether the axis moves.
    percent, sd, valid : float, float, bool
        (3).
    in_movement : bool
        Whether it lies in the movement; before a movement the movement's values are NaN.
    ratio_percent, ratio_sd, ratio_valid : float, float, bool
        (4) of the movement so far.
    projection_percent, projection_sd, projection_valid : float, float, bool
        Of the movement so far.
    share_percent, share_sd, share_valid : float, float, bool
        Share beside the robot's inertia, of the movement so far; what a display shows.
    running_percent, running_sd, running_valid : float, float, bool
        Projection in the running window.
    """

    time_s: float
    q_rad: float
    user_Nm: float
    arm_Nm: float
    counts: bool
    percent: float
    sd: float
    valid: bool
    in_movement: bool
    ratio_percent: float
    ratio_sd: float
    ratio_valid: bool
    projection_percent: float
    projection_sd: float
    projection_valid: bool
    share_percent: float
    share_sd: float
    share_valid: bool
    running_percent: float
    running_sd: float
    running_valid: bool
