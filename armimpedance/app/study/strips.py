"""The numbers of all sessions, one strip for each quantity of each condition."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final

import numpy as np

from armimpedance.app.study.gathering import KEYS
from armimpedance.core.arrays import FloatArray, FrozenRecord, IntArray
from armimpedance.core.conventions import UNITS
from armimpedance.core.delimited import number_of, read_text_table, text_header

#: Half a 95 % interval in standard errors, where a table holds the interval alone.
_NORMAL: Final = 1.959964
_LOW: Final = "ci_low_"
_HIGH: Final = "ci_high_"
#: The first column of a table of results that is no name of a group.
_FIRST_NUMBER: Final = "n_trials"


@dataclass(frozen=True, eq=False)
class Strip(FrozenRecord):
    """One quantity of one condition, of every session that has it.

    `kind`: whether people are set side by side by differences, by ratios (sizes and shapes, which
    are positive), or as axes, which are the same after half a turn, in degrees.
    `sessions` (S,): numbers of the sessions.
    `values`, `low`, `high` (S,): with 95 % limits, as the table has them.
    `errors` (S,): standard errors of `scaled`.
    """

    table: str
    condition: str
    quantity: str
    unit: str
    kind: str
    sessions: Annotated[IntArray, "S"]
    values: Annotated[FloatArray, "S"]
    low: Annotated[FloatArray, "S"]
    high: Annotated[FloatArray, "S"]
    errors: Annotated[FloatArray, "S"]

    @property
    def scaled(self) -> FloatArray:
        """The values on the scale on which they are compared: of ratios the logarithm.

        Axes lie within a quarter turn of their mean axis.
        """
        if self.kind == "ratio":
            return np.log(self.values)
        if self.kind == "axis":
            return self._unwrapped(self.values)
        return self.values

    def told(self, scaled: float) -> float:
        """A value of the scale, as the table would have it."""
        return math.exp(scaled) if self.kind == "ratio" else scaled

    def _unwrapped(self, degrees: FloatArray) -> FloatArray:
        turned = np.exp(2j * np.radians(degrees))
        middle = np.degrees(np.angle(turned.sum())) / 2
        return np.asarray(middle + (degrees - middle + 90) % 180 - 90)

    def of(self, rows: FloatArray | IntArray) -> Strip:
        """The same of some of the sessions, by row."""
        parts = {name: getattr(self, name)[rows] for name in _PER_SESSION}
        names = (self.table, self.condition, self.quantity, self.unit, self.kind)
        return Strip(*names, **parts)


_PER_SESSION: Final = ("sessions", "values", "low", "high", "errors")


def strips_of(
    tables: Mapping[str, Path], numbers: Mapping[tuple[str, str], int], known: Sequence[str]
) -> list[Strip]:
    """Every quantity with a 95 % interval in the gathered tables.

    A value without finite limits is left out.

    `tables`: name -> the gathered table.
    `numbers`: (participant, session) -> the session's number; rows of others are left out.
    `known`: columns that say something of the people.
    Returns: in the order of the tables' columns.
    """
    return [strip for name in tables for strip in _of_table(name, tables[name], numbers, known)]


def _of_table(
    name: str, file: Path, numbers: Mapping[tuple[str, str], int], known: Sequence[str]
) -> Iterator[Strip]:
    points: dict[tuple[str, str, str], list[tuple[float, ...]]] = {}
    header = list(text_header(file))
    read = _reader(header, [*KEYS, *known])
    if read is None:
        return
    for row in read_text_table(file).rows:
        session = numbers.get((row[header.index(KEYS[0])], row[header.index(KEYS[1])]))
        if session is None:
            continue
        for quantity, condition, unit, numbers_of_row in read(row):
            if all(map(math.isfinite, numbers_of_row[:3])):
                points.setdefault((quantity, condition, unit), []).append(
                    (session, *numbers_of_row)
                )
    order = {quantity: i for i, quantity in enumerate(dict.fromkeys(key[0] for key in points))}
    for key in sorted(points, key=lambda key: order[key[0]]):
        yield _strip(name, *key, np.array(points[key]).T)


def _strip(table: str, quantity: str, condition: str, unit: str, columns: FloatArray) -> Strip:
    kind = _kind(quantity, columns[1], columns[2])
    return Strip(
        table=table,
        condition=condition,
        quantity=quantity,
        unit=unit,
        kind=kind,
        sessions=columns[0].astype(int),
        values=columns[1],
        low=columns[2],
        high=columns[3],
        errors=_errors(kind, columns),
    )


#: Of a row: quantity, condition, unit, and value, limits, standard error (NaN: not known).
_Read = Callable[[Sequence[str]], Iterator[tuple[str, str, str, tuple[float, ...]]]]


def _reader(header: Sequence[str], apart: Sequence[str]) -> _Read | None:
    """The reader of a table: a row a condition, or a row a number; None without intervals."""
    at = {column: i for i, column in enumerate(header)}
    own = [column for column in header if column not in apart]
    if any(_LOW + c in at and _HIGH + c in at for c in own):
        return _wide(at, own)
    for limits in (("ci_low", "ci_high"), ("lower", "upper")):
        name = next((c for c in ("parameter", "quantity") if c in at), None)
        if name is not None and {"value", *limits} <= set(own):
            return _long(at, own, name, limits)
    return None


def _wide(at: Mapping[str, int], own: Sequence[str]) -> _Read:
    """A row a group, its numbers beside each other: RESULTS.csv and its sisters."""
    quantities = [c for c in own if _LOW + c in at and _HIGH + c in at]
    heads = [at[column] for column in _conditions(own)]
    level = at.get("level")
    cells = [(c, [at.get(n) for n in (c, _LOW + c, _HIGH + c, f"sd_{c}")]) for c in quantities]

    def read(row: Sequence[str]) -> Iterator[tuple[str, str, str, tuple[float, ...]]]:
        condition = ", ".join(row[i] for i in heads)
        of = row[level] if level is not None else ""
        for quantity, places in cells:
            numbers_of_row = tuple(_number(row, place) for place in places)
            yield quantity, condition, _unit(quantity, of), numbers_of_row

    return read


def _long(at: Mapping[str, int], own: Sequence[str], name: str, limits: tuple[str, str]) -> _Read:
    """A row a number: fits as tables, and what ``--long`` writes."""
    named = [c for c in ("condition", "group", "joint", "trial") if c in own]
    places = [at.get(n) for n in ("value", *limits, "sd")]
    unit = at.get("unit")

    def read(row: Sequence[str]) -> Iterator[tuple[str, str, str, tuple[float, ...]]]:
        condition = ", ".join(row[at[c]] for c in named)
        of = row[unit] if unit is not None else ""
        yield row[at[name]], condition, of, tuple(_number(row, place) for place in places)

    return read


def _number(row: Sequence[str], place: int | None) -> float:
    value = None if place is None else number_of(row[place])
    return math.nan if value is None else value


def _conditions(own: Sequence[str]) -> Sequence[str]:
    """Columns that name a row of one session: those before the first number."""
    if _FIRST_NUMBER in own:
        return own[: own.index(_FIRST_NUMBER)]
    return [column for column in own if column in ("condition", "group", "joint")]


def _kind(quantity: str, values: FloatArray, low: FloatArray) -> str:
    if quantity.endswith("orientation_deg"):
        return "axis"
    positive = quantity.endswith(("_size", "_shape")) and values.min() > 0
    return "ratio" if positive and not (low <= 0).any() else "difference"


def _errors(kind: str, columns: FloatArray) -> FloatArray:
    """Standard errors on the scale of the comparison; without any an interval is taken as none."""
    _, value, low, high, sd = columns
    if kind == "ratio":
        return np.asarray(np.nan_to_num(np.log(high / low) / (2 * _NORMAL)))
    from_interval = np.nan_to_num((high - low) / (2 * _NORMAL))
    return np.where(np.isfinite(sd), sd, from_interval)


def _unit(quantity: str, level: str) -> str:
    if quantity.endswith("_deg"):
        return "deg"
    matrix, _, rest = quantity.partition("_")
    unit = UNITS.get(level, {}).get(matrix, "")
    if rest == "shape":
        return ""
    # The size of an ellipse is its area.
    square = f"{unit}^2" if unit.isalpha() else f"({unit})^2"
    return square if rest == "size" and unit else unit
