"""The smooth step that references of the therapy robot are made of: minimum jerk, and ramps."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from armimpedance.core.arrays import FloatArray


class Step(NamedTuple):
    """``10 x^3 - 15 x^4 + 6 x^5`` from 0 to 1, held at either end; arrays of x's shape.

    As a place it is a movement of minimum jerk, as a speed a smooth ramp with `integral` as its
    way.
    """

    integral: FloatArray
    value: FloatArray
    slope: FloatArray
    curvature: FloatArray


def smooth_step(x: FloatArray) -> Step:
    """The step at phases x, any shape."""
    y = np.clip(x, 0.0, 1.0)
    return Step(
        integral=y**4 * (2.5 + y * (y - 3)) + np.maximum(x - 1, 0.0),
        value=y * y * y * (10 + y * (6 * y - 15)),
        slope=30 * (y * (1 - y)) ** 2,
        curvature=60 * y * (1 - y) * (1 - 2 * y),
    )
