"""Units of forces and moments as C3D files write them, in SI."""

from __future__ import annotations

import re
from typing import Final

#: Units of force, in N.
_NEWTONS: Final = {
    "n": 1.0, "nt": 1.0, "newton": 1.0, "newtons": 1.0, "kn": 1e3,
    "kgf": 9.80665, "kp": 9.80665, "lbf": 4.4482216152605, "lb": 4.4482216152605,
    "lbs": 4.4482216152605,
}  # fmt: skip
#: Units of length, in m, as they stand in a moment's unit or a point's.
_METRES: Final = {
    "m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254, "inch": 0.0254, "inches": 0.0254,
    "ft": 0.3048,
}  # fmt: skip


def force_unit(unit: str) -> float | None:
    """A unit of force in N; None where it is none."""
    return _NEWTONS.get(unit.strip().lower())


def length_unit(unit: str) -> float | None:
    """A unit of length in m; None where it is none."""
    return _METRES.get(unit.strip().lower())


def moment_unit(unit: str) -> float | None:
    """A unit of moment, such as Nmm, N.m, N*mm or ntmm, in N m; None where it is none."""
    plain = re.sub(r"[\s.*·\-_]", "", unit.lower())
    for force in sorted(_NEWTONS, key=len, reverse=True):
        length = _METRES.get(plain.removeprefix(force))
        if plain.startswith(force) and length is not None:
            return _NEWTONS[force] * length
    return None
