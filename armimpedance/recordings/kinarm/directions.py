"""The direction in which a trial protocol of a Kinarm exam disturbs the hand, from its tables."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from armimpedance.recordings.kinarm.robot import Side

Value = float | str

#: What a direction can be from, the strongest first: a setting that states it, the force of the
#: load, the way from the target of the start to that of the end.
Kind = Literal["stated", "load", "target"]
_STRONGEST_FIRST: Final[tuple[Kind, ...]] = ("stated", "load", "target")

_START: Final = re.compile(r"START|INIT|HOME|ORIGIN|CENT(ER|RE)")
_END: Final = re.compile(r"END|REACH|DEST|GOAL|FINAL")
_FORCE_X: Final = re.compile(r"F_?X|(.*_)?FORCE_?X(_.*)?|X_FORCE(_.*)?")


@dataclass(frozen=True)
class Direction:
    """A direction in the recording's frame.

    Attributes
    ----------
    kind : {"stated", "load", "target"}
    source : str
        The setting that it is from.
    degrees : float
        From +x, counter-clockwise, in [0, 360).
    size : float or None
        Of the load in N, of the way in m; None where the tables do not say it.
    """

    kind: Kind
    source: str
    degrees: float
    size: float | None = None


def direction_of(
    settings: Mapping[str, Value],
    loads: Mapping[str, Mapping[str, Value]],
    targets: Mapping[str, tuple[float, float] | None],
    side: Side,
) -> Direction | None:
    """The disturbance's direction; None where the tables do not say it, or say several.

    Parameters
    ----------
    settings : mapping
        Column of `TP_TABLE` -> number or text.
    loads : mapping
        Those settings that are loads -> columns of `LOAD_TABLE`.
    targets : mapping
        Those settings that are targets -> place in m, from any origin, or None.
    side : {"right", "left"}
    """
    mirror = -1.0 if side == "left" else 1.0
    stated = {n: v for n, v in settings.items() if n.endswith("DIRECTION_DEG")}
    if len(stated) == 1:
        ((name, value),) = stated.items()
        if isinstance(value, float):
            angle = np.deg2rad(value)
            return _direction("stated", name, mirror * np.cos(angle), np.sin(angle), sized=False)
    every = {name: force_of(row, side) for name, row in loads.items()}
    forces = {name: force for name, force in every.items() if force is not None}
    pushing = {name: force for name, force in forces.items() if any(force)} or forces
    if len(pushing) == 1:
        ((name, (x, y)),) = pushing.items()
        return _direction("load", name, x, y)
    first, last = ends_of(targets)
    start, end = targets.get(first or ""), targets.get(last or "")
    if last is None or start is None or end is None:
        return None
    return _direction("target", last, end[0] - start[0], end[1] - start[1])


def ends_of(targets: Iterable[str]) -> tuple[str | None, str | None]:
    """The settings of the targets at which a movement starts and ends, where there is one each."""
    names = list(targets)
    return _one(names, _START), _one(names, _END)


def force_columns(load: Mapping[str, Value]) -> tuple[str, str] | None:
    """The columns of a load's force along x and y; None where their names do not say which."""
    pairs = [(n, re.sub(r"X(?=$|_)", "Y", n, count=1)) for n in load if _FORCE_X.fullmatch(n)]
    whole = [pair for pair in pairs if all(isinstance(load.get(n), float) for n in pair)]
    chosen = [pair for pair in whole if pair[0] in ("FORCE_X", "FX")] or whole
    return chosen[0] if len(chosen) == 1 else None


def force_of(load: Mapping[str, Value], side: Side) -> tuple[float, float] | None:
    """The force of a load in N in the recording's frame; None where the table does not say."""
    columns = force_columns(load)
    if columns is None:
        return None
    x, y = (float(load[name]) for name in columns)
    return (-x if side == "left" and x else x), y


def only_strongest(directions: Iterable[Direction | None]) -> list[Direction | None]:
    """The directions of an exam without those that are from weaker sources than others are.

    Where loads push in some protocols, a protocol without a load has no disturbance: the way to
    its target is a movement of the person's own.
    """
    every = list(directions)
    there = [direction.kind for direction in every if direction is not None]
    strongest = next((kind for kind in _STRONGEST_FIRST if kind in there), None)
    return [one if one is not None and one.kind == strongest else None for one in every]


def _direction(
    kind: Kind, source: str, x: float, y: float, *, sized: bool = True
) -> Direction | None:
    if x == 0.0 and y == 0.0:
        return None
    degrees = float(round(np.rad2deg(np.arctan2(y, x)), 3) % 360.0)
    return Direction(kind, source, degrees, round(float(np.hypot(x, y)), 6) if sized else None)


def _one(names: list[str], pattern: re.Pattern[str]) -> str | None:
    """The one target that starts or ends a movement; None where none or several might."""
    found = [name for name in names if pattern.search(name)]
    exact = [name for name in found if name in ("START_TARGET", "END_TARGET")]
    chosen = exact or found
    return chosen[0] if len(chosen) == 1 else None
