"""The shapes of disturbances: displacement, velocity and acceleration over the time from 0 to 1.

Each is built when it is looked up, so that a help text that lists them loads nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Final

from armimpedance.core.method_table import EntryTable

if TYPE_CHECKING:
    from armimpedance.core.arrays import FloatArray
    from armimpedance.hand.planning.profile import Shape, ShapeFunction


def _half_sine(s: FloatArray) -> FloatArray:
    import numpy as np

    w = np.pi
    return np.stack([np.sin(w * s), w * np.cos(w * s), -(w**2) * np.sin(w * s)])


def _raised_cosine(s: FloatArray) -> FloatArray:
    import numpy as np

    w = 2 * np.pi
    return np.stack([1 - np.cos(w * s), w * np.sin(w * s), w**2 * np.cos(w * s)]) / 2


#: Name -> coefficients of `profile.designed_shape`.
_POLYNOMIALS: Final[Mapping[str, tuple[float, ...]]] = {
    # a push forwards and an equal one backwards
    "biphasic": (0.0, -1.0),
    # Found by `design` at 5 mm, 0.3 s, at most 5.3 m/s^2, nominal noise, an arm at rest: the fewest
    # trials for K (degree 5, goal K alone).
    "designed": (0.0, -9.625238, 0.0, -6.828925, 0.0, -2.989463),
    # the minimum-jerk bump
    "minimum_jerk": (1.0,),
    # Found by `design` at 5 mm, 0.3 s, at most 5.3 m/s^2: K and the response to the displacement 40
    # to 70 ms earlier, with unknown delay (degree 9).
    "reflex_separating": (
        *(0.056824, -8.970596, 2.063219, -7.981409, 6.097356),
        *(-6.788630, 5.362087, -3.584803, 1.616960, -1.455224),
    ),
}

#: Name -> course, and the reason why it is not recommended.
_OTHERS: Final[Mapping[str, tuple[ShapeFunction, str]]] = {
    "half_sine": (_half_sine, "starts with a step of velocity, which no robot makes"),
    "raised_cosine": (
        _raised_cosine,
        "position and acceleration are proportional up to an offset: only the rest before and "
        "after tells K from M",
    ),
}


class ShapeTable(EntryTable["Shape"]):
    """Table of the shapes, each built when it is looked up."""

    def _listed(self) -> Iterable[str]:
        return (*_POLYNOMIALS, *_OTHERS)

    def __getitem__(self, name: str) -> Shape:
        from armimpedance.hand.planning.profile import Shape, designed_shape

        if name not in self._loaded:
            shape = (
                designed_shape(name, _POLYNOMIALS[name])
                if name in _POLYNOMIALS
                else Shape(name, *_OTHERS[name])
            )
            self._loaded[name] = shape
        return self._loaded[name]


#: The shapes by their names.
SHAPES: Final = ShapeTable("shape")
