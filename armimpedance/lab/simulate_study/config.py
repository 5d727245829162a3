"""The file of a simulated study: read, and refused before any work where anything is wrong."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from math import prod
from pathlib import Path
from typing import Any, Final

from armimpedance.core.errors import InputError
from armimpedance.core.inputs import read_toml
from armimpedance.lab.simulate_study.blocks import Cell
from armimpedance.lab.simulate_study.fields import Field, Value, one_of, whole
from armimpedance.lab.simulate_study.rig import RIGS

MOST_CELLS: Final = 10_000
MOST_SESSIONS: Final = 10_000_000
MOST_DRAWN: Final = 1_000_000_000
#: Fewer sessions do not tell the covariance of all that is drawn.
FEWEST_FITTED: Final = 100
_KEYS: Final = ("sessions", "seed", "power", "fixed", "grid")


@dataclass(frozen=True)
class Config:
    """A simulated study.

    `sessions`: of each cell, simulated and estimated.
    `drawn`: sessions drawn from the distribution of those estimates; 0: none.
    `power` tuple of (str, str): conditions between which a change is looked for.
    """

    sessions: int
    seed: int
    drawn: int
    power: tuple[tuple[str, str], ...]
    cells: tuple[Cell, ...]


def read_config(file: Path) -> Config:
    """The study in a file.

    Raises InputError: naming file and field.
    """
    try:
        return _config(read_toml(file, "the settings of a study")[0])
    except InputError as error:
        if error.file is not None:
            raise
        raise InputError(error.problem, file=file, expected=error.expected) from error


def _config(content: Mapping[str, Any]) -> Config:
    _refuse_unknown(content, _KEYS, "")
    sessions, drawn = _sizes(content)
    seed = _whole(content, "seed", 0, 2**63 - 1, 0)
    cells = tuple(dict.fromkeys(_cells(content)))
    power = _power(content.get("power", []), cells)
    if drawn:
        for cell in cells:
            if cell.rig.shortcut is None:
                raise InputError(f"fixed: the rig {cell.rig_name} has no shortcut to draw by")
    return Config(sessions, seed, drawn, power, cells)


def _sizes(content: Mapping[str, Any]) -> tuple[int, int]:
    """Sessions on the full path, and drawn ones."""
    fixed = content.get("fixed")
    if (fixed is None) == ("sessions" not in content):
        raise InputError("sessions and fixed", expected="one of the two: sessions = N, or [fixed]")
    if fixed is None:
        return _whole(content, "sessions", 1, MOST_SESSIONS), 0
    if not isinstance(fixed, dict):
        raise InputError("fixed is no table", expected="[fixed] with full = N and drawn = N")
    _refuse_unknown(fixed, ("full", "drawn"), "fixed.")
    full = _whole(fixed, "full", FEWEST_FITTED, MOST_SESSIONS, place="fixed.")
    return full, _whole(fixed, "drawn", 1, MOST_DRAWN, place="fixed.")


def _whole(
    content: Mapping[str, Any],
    name: str,
    low: int,
    high: int,
    default: int | None = None,
    place: str = "",
) -> int:
    if name not in content and default is not None:
        return default
    expected = f"a whole number from {low} to {high}"
    if name not in content:
        raise InputError(f"{place}{name} is missing", expected=expected)
    return int(_checked(Field(name, None, whole(low, high)), content[name], place))  # type: ignore[arg-type]


def _checked(field: Field, value: object, place: str) -> Value:
    try:
        return field.check(value)
    except InputError as error:
        raise InputError(f"{place}{field.name}: {error.problem}", expected=error.expected) from None


def _refuse_unknown(content: Mapping[str, Any], known: tuple[str, ...], place: str) -> None:
    for name in content:
        if name not in known:
            expected = f"one of {', '.join(known)}"
            raise InputError(f"no such field: {place}{name}", expected=expected)


def _cells(content: Mapping[str, Any]) -> Iterator[Cell]:
    """Every combination of every grid."""
    grids = content.get("grid", {})
    grids = grids if isinstance(grids, list) else [grids]
    left = MOST_CELLS
    for grid in grids:
        if not isinstance(grid, dict):
            raise InputError("grid is no table", expected="[grid], or [[grid]] many times")
        for rig in _choices(Field("rig", RIGS.default, one_of(lambda: RIGS.names)), grid):
            fields = RIGS[str(rig)].fields
            _refuse_unknown(grid, ("rig", *(f.name for f in fields)), "grid.")
            choices = [_choices(field, grid) for field in fields]
            left -= prod(map(len, choices))
            if left < 0:
                raise InputError(f"grid: more than {MOST_CELLS} cells", expected="fewer")
            for chosen in product(*choices):
                yield _cell(str(rig), fields, chosen)


def _choices(field: Field, grid: Mapping[str, Any]) -> list[Value]:
    if field.name not in grid:
        return [field.default]
    given = grid[field.name]
    given = given if isinstance(given, list) else [given]
    if not given:
        raise InputError(f"grid.{field.name} is empty", expected="one value or more")
    return [_checked(field, value, "grid.") for value in given]


def _cell(rig: str, fields: tuple[Field, ...], chosen: tuple[Value, ...]) -> Cell:
    settings = {field.name: value for field, value in zip(fields, chosen, strict=True)}
    try:
        conditions = RIGS[rig].conditions(settings)
    except InputError as error:
        raise InputError(f"grid: {error.problem}", expected=error.expected) from None
    return Cell(rig, tuple(settings.items()), conditions)


def _power(given: object, cells: tuple[Cell, ...]) -> tuple[tuple[str, str], ...]:
    expected = 'pairs of conditions of one cell, such as [["relaxed", "tense"]]'
    if not isinstance(given, list):
        raise InputError("power is no list", expected=expected)
    pairs = []
    for pair in given:
        names = isinstance(pair, list) and all(isinstance(name, str) for name in pair)
        if not names or len(set(pair)) != 2 or len(pair) != 2:
            raise InputError(f"power: {pair!r}", expected=expected)
        if not any(set(pair) <= set(cell.conditions) for cell in cells):
            together = next((c.conditions for c in cells if len(c.conditions) > 1), ())
            raise InputError(
                f"power: no cell has both {pair[0]} and {pair[1]}",
                expected=f"conditions of one cell, such as {', '.join(together)}"
                if together
                else "a cell with two conditions",
            )
        pairs.append((pair[0], pair[1]))
    return tuple(pairs)
