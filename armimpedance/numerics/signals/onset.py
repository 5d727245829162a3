"""When a returning disturbance starts and is back, from the position alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError

#: Noise at rest is judged from this much of a trial's start (s).
REST_S = 0.05
#: A trial moves if its peak is beyond this many times the largest excursion at rest.
MOVEMENT_FACTOR = 6.0
#: The disturbance has begun beyond this many times that excursion ...
LEVEL_FACTOR = 1.5
#: ... and beyond this part of the peak.
PEAK_FRACTION = 0.01
#: It is over within this part of the peak around where the trial ends: people drift meanwhile.
END_FRACTION = 0.03


@dataclass(frozen=True)
class Movement:
    """Onset and end of one disturbance on the trial's own clock (s)."""

    onset_s: float
    end_s: float


def detect_movement(position: FloatArray, time_s: FloatArray) -> Movement:
    """Find onset and end of a disturbance in one trial.

    The distance from rest crosses a level at t1 and eight times that level at t2. Smooth
    disturbances leave rest with the cube of time (bounded jerk), so that the onset is at
    ``2 t1 - t2``; the end likewise, backwards, from where the trial comes to rest.

    Parameters
    ----------
    position : (S, d)
    time_s : (S,)

    Raises
    ------
    InputError
        If the trial is too short, does not rest at its start, or nothing moves.
    """
    rest = int(np.searchsorted(time_s, time_s[0] + REST_S))
    if rest < 5 or len(time_s) < 3 * rest:
        raise InputError(
            f"trial of {len(time_s)} samples is too short to find its onset",
            expected=f"{REST_S * 1e3:.0f} ms of rest, then the disturbance",
        )
    start = position[:rest].mean(axis=0)
    distance = np.linalg.norm(position - start, axis=1)
    noise = float(distance[:rest].max())
    peak = float(distance.max())
    level = max(PEAK_FRACTION * peak, LEVEL_FACTOR * noise)
    if peak < MOVEMENT_FACTOR * noise or peak == 0.0:
        raise InputError(
            f"nothing moves: peak {peak:.3g}, at rest {noise:.3g} (SI)",
            expected="a disturbance well above the noise at rest",
        )
    beyond = np.flatnonzero(distance > level)
    far = np.flatnonzero(distance > min(8 * level, 0.9 * peak))
    onset = 2 * time_s[beyond[0]] - time_s[far[0]]
    left = np.linalg.norm(position - position[-rest:].mean(axis=0), axis=1)
    level = max(END_FRACTION * left.max(), LEVEL_FACTOR * float(left[-rest:].max()))
    beyond = np.flatnonzero(left > level)
    far = np.flatnonzero(left > min(8 * level, 0.9 * left.max()))
    end = 2 * time_s[beyond[-1]] - time_s[far[-1]]
    return Movement(float(max(onset, time_s[0])), float(min(end, time_s[-1])))
