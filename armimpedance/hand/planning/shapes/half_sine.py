"""Half a period of a sine."""

from __future__ import annotations

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.hand.planning.profile import Shape


def _half_sine(s: FloatArray) -> FloatArray:
    w = np.pi
    return np.stack([np.sin(w * s), w * np.cos(w * s), -(w**2) * np.sin(w * s)])


SHAPE = Shape("half_sine", _half_sine, "starts with a step of velocity, which no robot makes")
