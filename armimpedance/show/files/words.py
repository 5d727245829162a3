"""Columns of results in words, with units; from one row a group to one row a quantity.

The names of columns are a contract; this reads them, so that long tables, workbooks and MATLAB
structs of every result agree on what a column is. Standard library only.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from numbers import Real
from typing import Any, Final

import numpy as np

from armimpedance.core.conventions import AXES, FORCE_UNIT, MATRICES, UNITS
from armimpedance.show.files.content import Cells, Quantity

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

    `unit`: "1" for a pure number, "" where it is not known.
    `i`, `j`: row and column in its matrix, or number in its list, from 1.
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
        return _of_ellipse(found[1], found[2], level, axes)
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
    """Names of the axes of a level: x and y, shoulder and elbow, or axis 1, axis 2."""
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


def _of_ellipse(symbol: str, part: str, level: str, axes: int) -> Meaning:
    """The size is an area, in three axes a volume."""
    shape = "ellipsoid" if axes == 3 else "ellipse"
    words = f"{_SYMBOLS[symbol]} {shape}: {part.removesuffix('_deg')}"
    units = {"size": f"({UNITS[level][symbol]})^{axes}", "orientation_deg": "deg", "shape": "1"}
    return Meaning(words, units[part])


def _numbered(column: str, what: str, number: int, level: str, axes: int) -> Meaning:
    if what == "alpha":
        return Meaning(f"activation of muscle {number}", "1", number)
    place = level if what in ("position", "force") else "joint"
    if what in ("position", "force") and column.endswith(("_m", "_N")):
        # of the hand, which a row at the joints keeps
        place = "hand"
    elif column.endswith(("_rad", "_Nm")):
        place = "joint"
    names = AXES if place == "hand" else axis_names(place, axes)
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


# From one row a group to one row a quantity, by the names of the columns.
#
# A column ``X`` may have ``sd_X``, ``ci_low_X`` and ``ci_high_X`` beside it: one quantity with its
# standard error and its 95 % limits.

#: Beginnings of columns that belong to another column -> the field of the quantity, or its column.
_BESIDE: Final = {
    "sd_": "sd",
    "ci_low_": "lower",
    "ci_high_": "upper",
    "feasible_low_": "feasible_lower",
    "feasible_high_": "feasible_upper",
    "efficiency_": "efficiency",
}
_RANGES: Final = ("ci_low_", "ci_high_", "feasible_low_", "feasible_high_")
_OWN: Final = ("lower", "upper", "sd")
_COUNTED: Final = re.compile(r"K_(\d)(\d)")

Meaner = Callable[[str, str, int], Meaning]


def quantities_of(
    columns: Sequence[str],
    rows: Sequence[Cells],
    keys: Sequence[str],
    meaning: Meaner = meaning_of,
) -> list[Quantity]:
    """One entry for each number of each row that has a value or limits.

    Parameters
    ----------
    columns : sequence of str
        Of the wide table, in their order.
    rows : sequence of mappings
    keys : sequence of str
        Columns that name a row; they stand before each of its quantities. Texts and truths that
        are no keys are left out.
    meaning : function (column, level, axes), optional
        What a column means.

    Returns
    -------
    list of Quantity
    """
    beside = _beside(columns)
    base = {name: column for column, others in beside.items() for name in others.values()}
    # limits may stand without the number that they are of: a range, nothing more
    own = dict.fromkeys(base.get(name, name) for name in columns if name not in keys)
    return [one for row in rows for one in _of_row(row, own, keys, beside, meaning)]


def _beside(columns: Sequence[str]) -> dict[str, dict[str, str]]:
    """Column -> what stands beside it: field -> its column."""
    known = set(columns)
    found: dict[str, dict[str, str]] = {}
    for name in columns:
        for beginning, field in _BESIDE.items():
            base = name.removeprefix(beginning)
            if base == name:
                continue
            # The sd of a percentage is told without the unit: share_percent, sd_share.
            own = [column for column in (base, f"{base}_percent") if column in known]
            for column in own or ([base] if beginning in _RANGES else []):
                found.setdefault(column, {})[field] = name
    return found


def _of_row(
    row: Cells,
    own: Iterable[str],
    keys: Sequence[str],
    beside: dict[str, dict[str, str]],
    meaning: Meaner,
) -> Iterator[Quantity]:
    level = row.get("level")
    level = level if level in ("hand", "joint", "muscle") else "hand"
    named = {name: row.get(name) for name in keys}
    # what the checks said of the data behind the row
    verdict = {"verdict": "warning" if row["warnings"] else "ok"} if "warnings" in row else {}
    axes = _axes(row)
    for name in own:
        value = row.get(name)
        if not (value is None or _is_number(value)):
            continue
        others = {field: number(row.get(column)) for field, column in beside.get(name, {}).items()}
        if number(value) is None and all(other is None for other in others.values()):
            continue
        means = meaning(name, level, axes)
        limits = {field: others.pop(field, None) for field in _OWN}
        yield Quantity(
            named,
            name,
            means.words,
            number(value),
            **limits,
            unit=means.unit,
            i=means.i,
            j=means.j,
            more={**others, **verdict},
        )


def _axes(row: Cells) -> int:
    """The number of axes of a row: the highest number in ``K_ij``."""
    found = (_COUNTED.fullmatch(name) for name, cell in row.items() if cell is not None)
    return max((int(match[1]) for match in found if match), default=2)


def _is_number(value: Any) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool)


def number(value: Any) -> float | None:
    """A cell as a number; None where it is none or not a number."""
    if not _is_number(value) or math.isnan(value):
        return None
    return float(value)


# A course over time as MATLAB has it: one struct with a vector a column, not a struct a sample.


def course_struct(columns: Sequence[str], rows: Sequence[Cells]) -> dict[str, Any]:
    """The columns of a table as vectors, with their units.

    Parameters
    ----------
    columns : sequence of str
    rows : sequence of mappings

    Returns
    -------
    dict
        Column -> (rows, 1) array, not a number where a cell is empty; texts as cells, or one text
        where all rows have the same. `units` holds those that are known.
    """
    means = {name: meaning_of(name, "joint") for name in columns}
    units = {name: one.unit for name, one in means.items() if one.unit}
    return {**{n: _vector([row.get(n) for row in rows]) for n in columns}, "units": units}


def _vector(cells: Sequence[Any]) -> Any:
    if any(isinstance(cell, str) for cell in cells):
        texts = tuple("" if cell is None else str(cell) for cell in cells)
        return texts[0] if len(set(texts)) == 1 else texts
    if cells and all(isinstance(cell, (bool, np.bool_)) for cell in cells):
        return np.array(cells, dtype=bool)[:, None]
    return np.array([np.nan if cell is None else cell for cell in cells], dtype=float)[:, None]
