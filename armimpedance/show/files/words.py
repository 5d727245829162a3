"""The columns of an impedance in words, with units; from one row a group to one row a quantity.

The names of matrices, ellipses, places and sums over muscles are built from their symbol, axes and
level; this reads them. Every other column of a result is described where the result is
(`core.described`). A number that is in neither has no unit: none is guessed.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from numbers import Real
from types import MappingProxyType
from typing import Any, Final

from armimpedance.core.conventions import AXES, FORCE_UNIT, MATRICES, PLANAR_JOINTS, UNITS
from armimpedance.core.described import BESIDE, Column, Meaning, meaning_in, meanings, split_beside
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.show.files.content import Cells, Quantity

_SYMBOLS: Final = {symbol: field for field, (symbol, _) in MATRICES.items()}
#: Symbol at the beginning of a column -> (the matrix whose unit it has, what it is).
_NAMED: Final = {
    **{symbol: (symbol, field) for symbol, field in _SYMBOLS.items()},
    "M_with_handle": ("M", "inertia with the handle"),
    "K_without": ("K", "stiffness without a reflex in the model"),
    "R": ("K", "reflex stiffness"),
}
_COUNTED: Final = re.compile(r"K_(\d)(\d)")
_ELEMENT: Final = re.compile(r"(.+)_(\d)(\d)")
_UNITS_OF_PLACES: Final = {"m": "m", "rad": "rad", "N": "N", "Nm": "N m"}
_NUMBERED: Final = re.compile(r"(position|force|torque|q|alpha)_(\d+)(_m|_rad|_N|_Nm)?")
_OF_MUSCLES: Final = re.compile(r"([BK])_(\D.*)")
#: Pair of joints in the name of a sum over muscles.
_PAIRS: Final = {"ss": "shoulder", "se": "shoulder with elbow", "ee": "elbow"}
_OF_AXIS: Final = re.compile(r"([MBK])_axis_([123])(?:_([xyz]|turn_deg))?")
_OF_ELLIPSE: Final = re.compile(r"([MBK])_(size|orientation_deg|shape)")
#: How well an impedance is known: numbers of a row; the unit of the residuals is that of the force.
QUALITY_COLUMNS: Final[tuple[Column[ImpedanceEstimate], ...]] = (
    Column(
        "multiple_correlation",
        "multiple correlation",
        "1",
        lambda one: number(one.quality.multiple_correlation),
    ),
    Column("vaf", "variance accounted for", "1", lambda one: number(one.quality.vaf)),
    Column(
        "cond_scaled",
        "condition of the scaled columns",
        "1",
        lambda one: number(one.quality.cond_scaled),
    ),
    Column("cond_raw", "condition of the columns", "1", lambda one: number(one.quality.cond_raw)),
    Column("rank", "rank", "1", lambda one: int(one.quality.rank) or None),
    Column(
        "residual_sd",
        "standard deviation of the residuals",
        value=lambda one: number(one.quality.residual_sd),
    ),
    Column("coherence", "coherence", "1", lambda one: number(one.quality.coherence)),
    Column("n_rows", "rows of the regression", "1", lambda one: int(one.quality.n_rows) or None),
    Column("dof", "degrees of freedom", "1", lambda one: float(one.dof)),
)
#: What else stands in a row of an impedance beside its matrices, ellipses and places.
IMPEDANCE_COLUMNS: Final[tuple[Column[ImpedanceEstimate], ...]] = (
    Column("n_trials", "number of trials", "1"),
    Column("method", "method of the estimate"),
    Column("level", "where the impedance is: at the hand, the joints or the muscles"),
    *QUALITY_COLUMNS,
    Column("covariance", "lower triangle of the covariance of M, B, K, row by row"),
    Column(
        "shared_errors",
        "errors of M, B, K, row by row, that one cause makes in all rows alike: one standard "
        "deviation of each cause, part of the covariance",
    ),
    Column("muscles", "names of the muscles"),
    Column("warnings", "what the fit warns of; empty where it does not"),
    Column("provenance", "what was done, one sentence each"),
)
_OF_A_ROW: Final = {
    **meanings(IMPEDANCE_COLUMNS),
    "condition": Meaning("condition of the trials"),
}
#: Displacement and force of a level, in words.
_MOTION: Final = {
    "hand": ("force", ("displacement", "velocity", "acceleration")),
    "joint": ("torque", ("angle", "velocity", "acceleration")),
}
_PLACES: Final = re.compile(r"(q)_(shoulder|elbow)_rad|(shoulder)_([xyz])_m")


@dataclass(frozen=True)
class RowAxes:
    """Where the impedance of a row is, and its axes.

    `level`: "hand", "joint" or "muscle".
    `arm`: whether two joints are shoulder and elbow; a wrist has none of these.
    """

    level: str = "hand"
    count: int = 2
    arm: bool = True

    @classmethod
    def of(cls, row: Cells) -> RowAxes:
        """Those of a row: as many axes as the highest number in ``K_ij``."""
        stated_level = row.get("level")
        level = stated_level if stated_level in UNITS else "hand"
        filled = [name for name, cell in row.items() if cell is not None]
        found = (_COUNTED.fullmatch(name) for name in filled)
        count = max((int(match[1]) for match in found if match), default=2)
        # joints that were recorded themselves bear no names; an arm's angles do
        arm = "position_1_rad" not in filled or "q_shoulder_rad" in filled
        return cls(level, count, arm)

    @property
    def names(self) -> Sequence[str]:
        """Names of the axes: x and y, shoulder and elbow, or axis 1, axis 2."""
        if self.level == "hand" and self.count <= len(AXES):
            return AXES[: self.count]
        return self.joints if self.level == "joint" else self._numbered("axis")

    @property
    def joints(self) -> Sequence[str]:
        """Names of the joints."""
        if self.arm and self.count == len(PLANAR_JOINTS):
            return PLANAR_JOINTS
        return self._numbered("axis" if self.arm else "joint")

    def _numbered(self, what: str) -> list[str]:
        return [f"{what} {number}" for number in range(1, self.count + 1)]


#: A hand in the plane.
PLANAR: Final = RowAxes()


def meaning_of(
    column: str,
    axes: RowAxes = PLANAR,
    described: Mapping[str, Meaning] = MappingProxyType({}),
) -> Meaning:
    """The meaning of a column of results.

    Parameters
    ----------
    column : str
        Its name in the wide table, also of a column beside another: ``sd_K_11``.
    axes : RowAxes
        Of its row.
    described : mapping
        What the result itself says of its columns.

    Returns
    -------
    Meaning
        Without a unit where nothing describes the column.
    """
    if own := meaning_in(described, column):
        return own
    base, beside = split_beside(column)
    if beside is not None:
        return beside.of(meaning_of(base, axes, described))
    return _of_impedance(column, axes)


@lru_cache(maxsize=4096)
def _of_impedance(column: str, axes: RowAxes) -> Meaning:
    """Kept, for each row of a table asks for the same columns."""
    if column == "residual_sd":
        return Meaning(_OF_A_ROW[column].words, FORCE_UNIT.get(axes.level, ""))
    plain = Meaning(column.replace("_", " "))
    return _OF_A_ROW.get(column) or _of_a_matrix(column, axes) or _of_a_place(column, axes) or plain


def _of_a_matrix(column: str, axes: RowAxes) -> Meaning | None:
    """An element, an ellipse or a sum over muscles; None: it is none of these."""
    if axes.level == "muscle" and (match := _OF_MUSCLES.fullmatch(column)):
        return _of_muscles(match[1], match[2])
    element = _ELEMENT.fullmatch(column)
    if element and element[1] in _NAMED:
        return _element(element[1], int(element[2]), int(element[3]), axes)
    if match := _OF_ELLIPSE.fullmatch(column):
        return _of_ellipse(match[1], match[2], axes)
    if match := _OF_AXIS.fullmatch(column):
        return _of_axis(match[1], match[2], match[3] or "", axes.level)
    if (symbol := column.removesuffix("_antisymmetric")) in _SYMBOLS and symbol != column:
        words = f"antisymmetric part of the {_SYMBOLS[symbol]}"
        return Meaning(words, UNITS[axes.level][symbol])
    return None


def _of_a_place(column: str, axes: RowAxes) -> Meaning | None:
    """A position, a force, an angle, a torque or an activation; None: it is none of these."""
    if match := _NUMBERED.fullmatch(column):
        return _numbered(column, match[1], int(match[2]), axes)
    if match := _PLACES.fullmatch(column):
        words = f"angle of {match[2]}" if match[1] else f"place of the shoulder: {match[4]}"
        return Meaning(words, "rad" if match[1] else "m")
    return None


def _element(symbol: str, i: int, j: int, axes: RowAxes) -> Meaning:
    matrix, words = _NAMED[symbol]
    unit = UNITS[axes.level][matrix]
    force, motions = _MOTION.get(axes.level, _MOTION["joint"])
    motion = motions[dict(MATRICES.values())[matrix]]
    names = axes.names
    if max(i, j) > len(names):
        return Meaning(f"{words} {i}, {j}", unit, i, j, whole=words)
    named = f"{words}: {names[i - 1]} {force} per {names[j - 1]} {motion}"
    return Meaning(named, unit, i, j, whole=words)


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


def _of_ellipse(symbol: str, part: str, axes: RowAxes) -> Meaning:
    """The size is an area, in three axes a volume."""
    shape = "ellipsoid" if axes.count == 3 else "ellipse"
    words = f"{_SYMBOLS[symbol]} {shape}: {part.removesuffix('_deg')}"
    size = f"({UNITS[axes.level][symbol]})^{axes.count}"
    return Meaning(words, {"size": size, "orientation_deg": "deg", "shape": "1"}[part])


def _of_axis(symbol: str, number: str, part: str, level: str) -> Meaning:
    """A half-axis of an ellipsoid, a component of its direction, or how far that may turn."""
    own = f"{_SYMBOLS[symbol]} ellipsoid: half-axis"
    more, unit = {
        "": ("", UNITS[level][symbol]),
        "turn_deg": (", how far it may turn", "deg"),
    }.get(part, (f", direction {part}", "1"))
    words, whole = f"{own} {number}{more}", f"{own}{more}"
    return Meaning(words, unit, int(number), along="half_axis", whole=whole)


def _numbered(column: str, what: str, number: int, axes: RowAxes) -> Meaning:
    if what == "alpha":
        words = f"activation of muscle {number}"
        return Meaning(words, "1", number, along="muscle", whole="activation")
    place = axes.level if what in ("position", "force") else "joint"
    if what in ("position", "force") and column.endswith(("_m", "_N")):
        # of the hand, which a row at the joints keeps
        place = "hand"
    elif column.endswith(("_rad", "_Nm")):
        place = "joint"
    names = AXES if place == "hand" else axes.joints
    axis = names[number - 1] if number <= len(names) else f"axis {number}"
    at_hand = place == "hand"
    whole = what if at_hand else {"position": "angle", "q": "angle"}.get(what, "torque")
    words = f"{whole} {axis}" if at_hand else f"{whole} of {axis}"
    unit = _UNITS_OF_PLACES.get(column.rpartition("_")[2], "")
    return Meaning(words, unit, number, along="axis" if at_hand else "joint", whole=whole)


# From one row a group to one row a quantity, by the names of the columns.
#
# A column ``X`` may have ``sd_X``, ``ci_low_X`` and ``ci_high_X`` beside it: one quantity with its
# standard error and its 95 % limits.

_RANGES: Final = ("ci_low_", "ci_high_", "feasible_low_", "feasible_high_")
_OWN: Final = ("lower", "upper", "sd")


def quantities_of(
    columns: Sequence[str],
    rows: Sequence[Cells],
    keys: Sequence[str],
    described: Mapping[str, Meaning] = MappingProxyType({}),
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
    described : mapping
        What the result itself says of its columns.

    Returns
    -------
    list of Quantity
    """
    beside = _beside(columns)
    base = {name: column for column, others in beside.items() for name in others.values()}
    # limits may stand without the number that they are of: a range, nothing more
    own = dict.fromkeys(base.get(name, name) for name in columns if name not in keys)
    return [one for row in rows for one in _of_row(row, own, keys, beside, described)]


def _beside(columns: Sequence[str]) -> dict[str, dict[str, str]]:
    """Column -> what stands beside it: field -> its column."""
    names = set(columns)
    neighbours: dict[str, dict[str, str]] = {}
    for name in columns:
        for beginning, one in BESIDE.items():
            base = name.removeprefix(beginning)
            if base == name:
                continue
            # The sd of a percentage is told without the unit: share_percent, sd_share.
            own = [column for column in (base, f"{base}_percent") if column in names]
            for column in own or ([base] if beginning in _RANGES else []):
                neighbours.setdefault(column, {})[one.field] = name
    return neighbours


def _of_row(
    row: Cells,
    own: Iterable[str],
    keys: Sequence[str],
    beside: dict[str, dict[str, str]],
    described: Mapping[str, Meaning],
) -> Iterator[Quantity]:
    named = {name: row.get(name) for name in keys}
    # what the checks said of the data behind the row
    verdict = {"verdict": "warning" if row["warnings"] else "ok"} if "warnings" in row else {}
    axes = RowAxes.of(row)
    for name in own:
        value = row.get(name)
        if not (value is None or _is_number(value)):
            continue
        others = {field: number(row.get(column)) for field, column in beside.get(name, {}).items()}
        if number(value) is None and all(other is None for other in others.values()):
            continue
        means = meaning_of(name, axes, described)
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


def _is_number(value: Any) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool)


def number(value: Any) -> float | None:
    """A cell as a number; None of a text, a truth, an empty cell or NaN."""
    if not _is_number(value) or math.isnan(value):
        return None
    return float(value)
