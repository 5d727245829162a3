"""Directions on a sphere, plus and minus of each."""

from __future__ import annotations

from itertools import product
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError

#: How many of a cube's three coordinates a direction has -> a family of its directions.
_FAMILIES: Final = {6: (1,), 8: (3,), 12: (2,), 14: (1, 3), 18: (1, 2), 26: (1, 2, 3)}
#: The sets of directions that can be asked for.
COUNTS: Final = tuple(_FAMILIES)


def sphere_directions(count: int) -> FloatArray:
    """Unit vectors (count, 3): a cube's faces (6), corners (8), edges (12), or several of them.

    Each direction's opposite is among them; the order is that of azimuth within elevation.

    Raises
    ------
    InputError
        No such set of directions.
    """
    if count not in _FAMILIES:
        known = ", ".join(map(str, COUNTS))
        raise InputError(f"{count} directions on a sphere", expected=f"one of {known}")
    cube = np.array(list(product((-1.0, 0.0, 1.0), repeat=3)))
    chosen = cube[np.isin(np.abs(cube).sum(axis=1), _FAMILIES[count])]
    units = chosen / np.linalg.norm(chosen, axis=1, keepdims=True)
    azimuth, elevation = angles_deg(units)
    return np.asarray(units[np.lexsort((azimuth, elevation))])


def angles_deg(units: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Azimuth, counter-clockwise from x in [0, 360), and elevation above the x-y plane, each (D,).

    A vertical direction has the azimuth 0.
    """
    level = np.hypot(units[:, 0], units[:, 1])
    turned = np.degrees(np.arctan2(units[:, 1], units[:, 0]))
    azimuth = np.where(level > 1e-9, np.round(turned, 6) % 360.0, 0.0)
    return azimuth, np.asarray(np.round(np.degrees(np.arctan2(units[:, 2], level)), 6))
