"""What the columns of results mean: in words, their unit, their place in a matrix.

The names of columns are a contract; this reads them, so that long tables, workbooks and MATLAB
structs of every result agree on what a column is. Standard library only.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from armimpedance.core.conventions import AXES, FORCE_UNIT, MATRICES, UNITS

_SYMBOLS: Final = {symbol: field for field, (symbol, _) in MATRICES.items()}
#: Symbol at the beginning of a column -> (the matrix whose unit it has, what it is).
_NAMED: Final = {
    **{symbol: (symbol, field) for symbol, field in _SYMBOLS.items()},
    "M_with_handle": ("M", "inertia with the handle"),
    "K_without": ("K", "stiffness without a reflex in the model"),
    "R": ("K", "reflex stiffness"),
}
_ELEMENT: Final = re.compile(r"(.+)_(\d)(\d)")
_NUMBERED: Final = re.compile(r"(position|force|torque|q|alpha)_(\d+)(_m|_rad|_N|_Nm)?")
_OF_MUSCLES: Final = re.compile(r"([BK])_(\D.*)")
#: Pair of joints in the name of a sum over muscles.
_PAIRS: Final = {"ss": "shoulder", "se": "shoulder with elbow", "ee": "elbow"}
_OF_ELLIPSE: Final = re.compile(r"([MBK])_(size|orientation_deg|shape)")
#: End of a column's name -> unit.
_SUFFIXES: Final = {
    "_deg": "deg", "_rad": "rad", "_percent": "%", "_ms": "ms", "_s": "s", "_Nm": "N m",
    "_N": "N", "_m": "m", "_Hz": "Hz", "_kg": "kg", "_share": "1", "_rad_s": "rad/s",
}  # fmt: skip
_PURE: Final = {
    "multiple_correlation": "multiple correlation",
    "vaf": "variance accounted for",
    "cond_scaled": "condition of the scaled columns",
    "cond_raw": "condition of the columns",
    "rank": "rank",
    "coherence": "coherence",
    "n_rows": "rows of the regression",
    "dof": "degrees of freedom",
    "p": "p value",
}
#: Displacement and force of a level, in words.
_MOTION: Final = {
    "hand": ("force", ("displacement", "velocity", "acceleration")),
    "joint": ("torque", ("angle", "velocity", "acceleration")),
}
_JOINTS: Final = ("shoulder", "elbow")
_PLACES: Final = re.compile(r"(q)_(shoulder|elbow)_rad|(shoulder)_([xyz])_m")


@dataclass(frozen=True)
class Meaning:
    """What a column means.

    Attributes
    ----------
    words : str
    unit : str
        "1" for a pure number, "" where it is not known.
    i, j : int or None
        Row and column in its matrix, or number in its list, from 1.
    """

    words: str
    unit: str = ""
    i: int | None = None
    j: int | None = None


def meaning_of(column: str, level: str = "hand", axes: int = 2) -> Meaning:
    """What a column of results means.

    Parameters
    ----------
    column : str
        Its name in the wide table.
    level : {"hand", "joint", "muscle"}
        Where the row's impedance is.
    axes : int
        Number of the row's axes.

    Returns
    -------
    Meaning
    """
    if level == "muscle" and (found := _OF_MUSCLES.fullmatch(column)):
        return _of_muscles(found[1], found[2])
    element = _ELEMENT.fullmatch(column)
    if element and element[1] in _NAMED:
        return _element(element[1], int(element[2]), int(element[3]), level, axes)
    if found := _OF_ELLIPSE.fullmatch(column):
        return _of_ellipse(found[1], found[2], level)
    if (symbol := column.removesuffix("_antisymmetric")) in _SYMBOLS and symbol != column:
        words = f"antisymmetric part of the {_SYMBOLS[symbol]}"
        return Meaning(words, UNITS[level][symbol])
    if found := _NUMBERED.fullmatch(column):
        return _numbered(column, found[1], int(found[2]), level, axes)
    if found := _PLACES.fullmatch(column):
        words = f"angle of {found[2]}" if found[1] else f"place of the shoulder: {found[4]}"
        return Meaning(words, "rad" if found[1] else "m")
    if column in ("B", "K", "I"):
        return _of_one_joint(column)
    if column == "residual_sd":
        return Meaning("standard deviation of the residuals", FORCE_UNIT.get(level, ""))
    if column in _PURE:
        return Meaning(_PURE[column], "1")
    return _by_suffix(column)


def _element(symbol: str, i: int, j: int, level: str, axes: int) -> Meaning:
    matrix, words = _NAMED[symbol]
    unit = UNITS[level][matrix]
    force, motions = _MOTION.get(level, _MOTION["joint"])
    motion = motions[dict(MATRICES.values())[matrix]]
    names = axis_names(level, axes)
    if max(i, j) > len(names):
        return Meaning(f"{words} {i}, {j}", unit, i, j)
    return Meaning(f"{words}: {names[i - 1]} {force} per {names[j - 1]} {motion}", unit, i, j)


def axis_names(level: str, axes: int) -> Sequence[str]:
    """Names of the axes of a level: x and y, shoulder and elbow, or axis 1, axis 2.

    Parameters
    ----------
    level : {"hand", "joint", "muscle"}
    axes : int

    Returns
    -------
    sequence of str
    """
    if level == "hand" and axes <= len(AXES):
        return AXES[:axes]
    if level == "joint" and axes == len(_JOINTS):
        return _JOINTS
    return [f"axis {number}" for number in range(1, axes + 1)]


def _of_muscles(symbol: str, rest: str) -> Meaning:
    """A sum over muscles, a group's part of it, or a single muscle."""
    what = _SYMBOLS[symbol]
    if rest == "outside_se":
        return Meaning(f"{what} that no muscles can make, in standard errors", "1")
    group, _, pair = rest.rpartition("_")
    if pair in _PAIRS:
        muscles = "all" if group == "sum" else group.replace("_", "-")
        words = f"{what} of {muscles} muscles: {_PAIRS[pair]}"
        return Meaning(words, UNITS["joint"][symbol])
    return Meaning(f"{what} of {rest.replace('_', ' ')}", UNITS["muscle"][symbol])


def _of_ellipse(symbol: str, part: str, level: str) -> Meaning:
    words = f"{_SYMBOLS[symbol]} ellipse: {part.removesuffix('_deg')}"
    units = {"size": f"({UNITS[level][symbol]})^2", "orientation_deg": "deg", "shape": "1"}
    return Meaning(words, units[part])


def _numbered(column: str, what: str, number: int, level: str, axes: int) -> Meaning:
    if what == "alpha":
        return Meaning(f"activation of muscle {number}", "1", number)
    place = (
        level if what in ("position", "force") and not column.endswith(("rad", "Nm")) else "joint"
    )
    names = axis_names(place, axes)
    axis = names[number - 1] if number <= len(names) else f"axis {number}"
    words = {
        "position": f"position {axis}" if place == "hand" else f"angle of {axis}",
        "force": f"force {axis}" if place == "hand" else f"torque of {axis}",
        "torque": f"torque of {axis}",
        "q": f"angle of {axis}",
    }
    return Meaning(words[what], _by_suffix(column).unit, number)


def _of_one_joint(column: str) -> Meaning:
    symbol = "M" if column == "I" else column
    return Meaning(_SYMBOLS[symbol], UNITS["joint"][symbol])


def _by_suffix(column: str) -> Meaning:
    for ending, unit in sorted(_SUFFIXES.items(), key=lambda pair: -len(pair[0])):
        if column.endswith(ending) and column != ending[1:]:
            return Meaning(column.removesuffix(ending).replace("_", " "), unit)
    return Meaning(column.replace("_", " "))
