"""Units as files and mappings write them, and how values come to SI without losing a bit in SI."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import Final, Literal

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError

Dimension = Literal["time", "length", "angle", "force", "torque", "emg", "any"]


@dataclass(frozen=True)
class Unit:
    """A unit of measurement.

    Attributes
    ----------
    symbol : str
    dimension : str
    multiply, divide : float
        A value in SI is ``value * multiply / divide``; a factor of 1 leaves every bit as it is.
        Two numbers, because 1/1000 has no double: 12 mm are 12/1000 m, the double next to it.
    """

    symbol: str
    dimension: Dimension
    multiply: float = 1.0
    divide: float = 1.0

    def to_si(self, values: FloatArray) -> FloatArray:
        """The values in SI, (N,)."""
        if self.multiply != 1.0:
            values = values * self.multiply
        return values / self.divide if self.divide != 1.0 else values

    @property
    def is_si(self) -> bool:
        """Whether values in it stand as they are."""
        return self.multiply == self.divide == 1.0


_GRAVITY: Final = 9.80665

#: All units that a mapping can name. "%MVC" and "normalised" are parts of a maximal contraction.
UNITS: Final = {
    unit.symbol: unit
    for unit in (
        Unit("s", "time"),
        Unit("ms", "time", divide=1e3),
        Unit("us", "time", divide=1e6),
        Unit("ns", "time", divide=1e9),
        Unit("min", "time", multiply=60.0),
        Unit("m", "length"),
        Unit("dm", "length", divide=10.0),
        Unit("cm", "length", divide=100.0),
        Unit("mm", "length", divide=1e3),
        Unit("um", "length", divide=1e6),
        Unit("in", "length", multiply=254.0, divide=1e4),
        Unit("rad", "angle"),
        Unit("mrad", "angle", divide=1e3),
        Unit("deg", "angle", multiply=pi, divide=180.0),
        Unit("rev", "angle", multiply=2.0 * pi),
        Unit("N", "force"),
        Unit("mN", "force", divide=1e3),
        Unit("kN", "force", multiply=1e3),
        Unit("kgf", "force", multiply=_GRAVITY),
        Unit("gf", "force", multiply=_GRAVITY, divide=1e3),
        Unit("lbf", "force", multiply=4.4482216152605),
        Unit("N m", "torque"),
        Unit("N cm", "torque", divide=100.0),
        Unit("N mm", "torque", divide=1e3),
        Unit("mN m", "torque", divide=1e3),
        Unit("kgf m", "torque", multiply=_GRAVITY),
        Unit("in lbf", "torque", multiply=4.4482216152605 * 0.0254),
        Unit("V", "emg"),
        Unit("mV", "emg", divide=1e3),
        Unit("uV", "emg", divide=1e6),
        Unit("normalised", "emg"),
        Unit("%MVC", "emg", divide=100.0),
    )
}

#: Other ways in which files write them; letter case counts only where a prefix needs it.
_OTHERS: Final = {
    "s": "sec secs second seconds sekunde sekunden seconde secondes",
    "ms": "msec msecs millisecond milliseconds millisekunden",
    "us": "usec µs μs microsecond microseconds",
    "min": "minute minutes",
    "m": "meter meters metre metres",
    "cm": "centimeter centimeters centimetre centimetres",
    "mm": "millimeter millimeters millimetre millimetres",
    "um": "µm μm",
    "in": "inch inches",
    "rad": "rads radian radians radiant",
    "deg": "degs degree degrees ° grad_deg degrés",
    "rev": "revs turn turns",
    "N": "newton newtons",
    "kgf": "kp kg-f kgforce",
    "lbf": "lb lbs",
    "N m": "nm n·m n*m n.m n-m newtonmeter newtonmeters newton-meters",
    "N cm": "ncm n·cm n*cm n.cm",
    "N mm": "nmm n·mm n*mm n.mm",
    "mN m": "mnm",
    "V": "volt volts",
    "mV": "millivolt millivolts",
    "uV": "µv μv microvolt microvolts",
    "normalised": "normalized mvc norm",
    "%MVC": "%mvc percentmvc",
}
_BY_NAME: Final = {
    **{other: symbol for symbol, others in _OTHERS.items() for other in others.split()},
    **{symbol.lower().replace(" ", ""): symbol for symbol in UNITS},
}


def known_unit(text: str) -> Unit | None:
    """The unit that a text names, or None.

    Parameters
    ----------
    text : str
        Such as ``"mm"``, ``"[Nm]"``, ``"N*m"``, ``"Rad"``, ``"µV"``.

    Returns
    -------
    Unit or None
    """
    bare = text.strip().strip("[](){}<>").strip()
    if bare in UNITS:
        return UNITS[bare]
    compact = bare.replace(" ", "")
    if compact[:1] == "M" and compact not in ("MVC", "Meter", "Meters", "Metre", "Metres"):
        return None  # mega is not milli
    symbol = _BY_NAME.get(compact.lower())
    return None if symbol is None else UNITS[symbol]


def unit_of(text: str, *dimensions: Dimension) -> Unit:
    """The unit that a mapping names, of one of these dimensions.

    Raises
    ------
    InputError
        There is no such unit, or it measures something else.
    """
    unit = known_unit(text)
    expected = ", ".join(u.symbol for u in UNITS.values() if u.dimension in dimensions)
    if unit is None:
        raise InputError(f"unknown unit {text!r}", expected=f"one of {expected}, or a scale")
    if unit.dimension not in dimensions:
        wanted = " or ".join(dimensions)
        raise InputError(f"{text!r} is no unit of {wanted}", expected=f"one of {expected}")
    return unit


def scaled(scale: float) -> Unit:
    """A unit of the user's own: SI units per unit of the file.

    Raises
    ------
    InputError
        Zero or not finite.
    """
    if not np.isfinite(scale) or scale == 0.0:
        raise InputError(f"scale {scale}", expected="a number other than 0")
    return Unit(f"{scale:g} SI", "any", multiply=scale)
