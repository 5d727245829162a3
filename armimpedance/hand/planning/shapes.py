"""The shapes of disturbances: displacement, velocity and acceleration over the time from 0 to 1."""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.method_table import RecordTable
from armimpedance.hand.planning.profile import Shape, designed_shape


def _half_sine(s: FloatArray) -> FloatArray:
    w = np.pi
    return np.stack([np.sin(w * s), w * np.cos(w * s), -(w**2) * np.sin(w * s)])


def _raised_cosine(s: FloatArray) -> FloatArray:
    w = 2 * np.pi
    return np.stack([1 - np.cos(w * s), w * np.sin(w * s), w**2 * np.cos(w * s)]) / 2


_ENTRIES: Final = (
    # a push forwards and one backwards, alike
    designed_shape("biphasic", [0.0, -1.0]),
    # Found by `design` at 5 mm, 0.3 s, at most 5.3 m/s^2, nominal noise, an arm at rest: the fewest
    # trials for K (degree 5, goal K alone).
    designed_shape("designed", (0.0, -9.625238, 0.0, -6.828925, 0.0, -2.989463)),
    Shape("half_sine", _half_sine, "starts with a step of velocity, which no robot makes"),
    # the bump of least jerk
    designed_shape("minimum_jerk", [1.0]),
    Shape(
        "raised_cosine",
        _raised_cosine,
        "position and acceleration are proportional up to an offset: only the rest before and "
        "after tells K from M",
    ),
    # Found by `design` at 5 mm, 0.3 s, at most 5.3 m/s^2: K and the answer to what was 40 to 70 ms
    # earlier, the delay not known (degree 9).
    designed_shape(
        "reflex_separating",
        (
            *(0.056824, -8.970596, 2.063219, -7.981409, 6.097356),
            *(-6.788630, 5.362087, -3.584803, 1.616960, -1.455224),
        ),
    ),
)

#: The shapes by their names.
SHAPES: Final = RecordTable({shape.name: shape for shape in _ENTRIES}, "shape")
