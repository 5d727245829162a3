"""The numbers of all sessions, one strip for each quantity of each condition."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final

import numpy as np

from armimpedance.arrays import FloatArray, FrozenRecord, IntArray
from armimpedance.conventions import UNITS
from armimpedance.study.gathering import KEYS

#: Half a 95 % interval in standard errors, where a table holds the interval alone.
_NORMAL: Final = 1.959964
_LOW: Final = "ci_low_"
_HIGH: Final = "ci_high_"
#: The first column of a table of results that is no name of a group.
_FIRST_NUMBER: Final = "n_trials"


@dataclass(frozen=True, eq=False)
class Strip(FrozenRecord):
    """One quantity of one condition, of every session that has it.

    Attributes
    ----------
    table, condition, quantity, unit : str
    kind : {"difference", "ratio", "axis"}
        Whether people are set side by side by differences, by ratios (sizes and shapes, which are
        positive), or as axes, which are the same after half a turn, in degrees.
    sessions : (S,)
        Numbers of the sessions.
    values, low, high : (S,)
        With 95 % limits, as the table has them.
    errors : (S,)
        Standard errors of `scaled`.
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

    Parameters
    ----------
    tables : mapping
        Name -> the gathered table.
    numbers : mapping
        (participant, session) -> the session's number; rows of others are left out.
    known : sequence of str
        Columns that say something of the people.

    Returns
    -------
    list of Strip
        In the order of the tables' columns.
    """
    return [strip for name in tables for strip in _of_table(name, tables[name], numbers, known)]


def _of_table(
    name: str, file: Path, numbers: Mapping[tuple[str, str], int], known: Sequence[str]
) -> Iterator[Strip]:
    found: dict[tuple[str, str, str], list[tuple[float, ...]]] = {}
    with open(file, newline="", encoding="utf-8") as stream:
        reader = csv.reader(stream)
        header = next(reader, [])
        at = {column: i for i, column in enumerate(header)}
        named = [c for c in header if _LOW + c in at and _HIGH + c in at]
        if not named:
            return
        conditions = [at[column] for column in _conditions(header, known)]
        level = at.get("level", -1)
        cells = [_Cells(at, column) for column in named]
        for row in reader:
            session = numbers.get((row[at[KEYS[0]]], row[at[KEYS[1]]]))
            if session is None:
                continue
            condition = ", ".join(row[i] for i in conditions)
            of = row[level] if level >= 0 else ""
            for one in cells:
                if (read := one.read(row)) is not None:
                    found.setdefault((one.name, condition, of), []).append((session, *read))
    order = {column: i for i, column in enumerate(named)}
    for key in sorted(found, key=lambda key: order[key[0]]):
        quantity, condition, of = key
        columns = np.array(found[key]).T
        yield Strip(
            table=name,
            condition=condition,
            quantity=quantity,
            unit=_unit(quantity, of),
            kind=_kind(quantity, columns[1], columns[2]),
            sessions=columns[0].astype(int),
            values=columns[1],
            low=columns[2],
            high=columns[3],
            errors=_errors(_kind(quantity, columns[1], columns[2]), columns),
        )


class _Cells:
    """Where a quantity stands in a row."""

    def __init__(self, at: Mapping[str, int], name: str) -> None:
        self.name = name
        self._columns = (at[name], at[_LOW + name], at[_HIGH + name])
        self._sd = at.get(f"sd_{name}")

    def read(self, row: Sequence[str]) -> tuple[float, ...] | None:
        """Value, limits and standard error, which is NaN where there is none; None: no number."""
        try:
            value, low, high = (float(row[i]) for i in self._columns)
            sd = float(row[self._sd]) if self._sd is not None and row[self._sd] else math.nan
        except ValueError:
            return None
        return (value, low, high, sd) if math.isfinite(value) else None


def _conditions(header: Sequence[str], known: Sequence[str]) -> list[str]:
    """Columns that name a row of one session: those before the first number."""
    own = [c for c in header if c not in KEYS and c not in known]
    if _FIRST_NUMBER in own:
        return own[: own.index(_FIRST_NUMBER)]
    return [column for column in own if column in ("condition", "group", "parameter", "quantity")]


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
    squared = f"({unit})²" if " " in unit or "/" in unit else f"{unit}²"
    return squared if rest == "size" and unit else unit
