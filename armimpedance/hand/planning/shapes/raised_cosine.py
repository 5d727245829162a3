"""One period of a cosine, raised to start at zero."""

from __future__ import annotations

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.hand.planning.profile import Shape


def _raised_cosine(s: FloatArray) -> FloatArray:
    w = 2 * np.pi
    return np.stack([1 - np.cos(w * s), w * np.sin(w * s), w**2 * np.cos(w * s)]) / 2


SHAPE = Shape(
    "raised_cosine",
    _raised_cosine,
    "position and acceleration are proportional up to an offset: only the rest before and "
    "after tells K from M",
)
