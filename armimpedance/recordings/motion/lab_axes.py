"""Axes and units of a laboratory's files, turned into the world's frame in m."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError

#: Which of the file's axes point forward, to the left and up, for files whose z points up.
Z_UP: Final = ("x", "y", "z")
#: OpenSim's frame: x forward, y up, z to the right.
Y_UP: Final = ("x", "-z", "y")

#: Units of length in such files, in m.
_METRES: Final = {
    "m": 1.0, "meter": 1.0, "metre": 1.0, "meters": 1.0, "metres": 1.0, "mete": 1.0,
    "cm": 0.01, "mm": 0.001, "in": 0.0254, "inch": 0.0254, "inches": 0.0254,
}  # fmt: skip


def lab_rotation(axes: Sequence[str]) -> FloatArray:
    """Rotation (3, 3) from the file's frame to the world's (x forward, y left, z up).

    Parameters
    ----------
    axes : three of "x", "-x", "y", "-y", "z", "-z"
        The file's axes that point forward, to the left and up.

    Raises
    ------
    InputError
        They are no right-handed frame.
    """
    rows = np.zeros((3, 3))
    expected = "the file's axes that point forward, left and up, such as x,-z,y"
    shown = ",".join(axes)
    if len(axes) != 3 or any(a.removeprefix("-") not in ("x", "y", "z") for a in axes):
        raise InputError(f"axes {shown}", expected=expected)
    for i, axis in enumerate(axes):
        rows[i, "xyz".index(axis.removeprefix("-"))] = -1.0 if axis.startswith("-") else 1.0
    if np.linalg.det(rows) < 0.5:
        raise InputError(f"axes {shown} are no right-handed frame", expected=expected)
    return rows


def metres_per(unit: str, file: object) -> float:
    """How long a file's unit of length is, in m.

    Raises
    ------
    InputError
        The unit is not known.
    """
    scale = _METRES.get(unit.strip().lower())
    if scale is None:
        raise InputError(f"unit of length {unit!r}", file=file, expected="m, cm, mm or inches")
    return scale
