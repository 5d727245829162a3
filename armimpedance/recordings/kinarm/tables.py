"""Tables of a Kinarm exam: protocols, targets, loads, and the direction of the disturbance.

`TP_TABLE` has a row for each trial protocol and a column (a parameter) for each of the task's
settings; a setting may be a row, counted from 1, of `TARGET_TABLE` (`X_GLOBAL`, `Y_GLOBAL` in cm,
in the frame of the hand; `X`, `Y` from an origin of the task) or of `LOAD_TABLE`. The tables are in
`common.c3d`, in older exams in every trial.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from armimpedance.recordings.c3d.parameters import Entry
from armimpedance.recordings.kinarm.exam_file import ExamFile
from armimpedance.recordings.kinarm.files import ExamTrial
from armimpedance.recordings.kinarm.robot import Side

# Direction of the disturbance in a trial protocol, from the exam's tables.

Value = float | str

#: Sources of a direction, the strongest first: a setting that states it, the force of the load, the
#: vector from the start target to the end target.
Kind = Literal["stated", "load", "target"]
_STRONGEST_FIRST: Final[tuple[Kind, ...]] = ("stated", "load", "target")

_START: Final = re.compile(r"START|INIT|HOME|ORIGIN|CENT(ER|RE)")
_END: Final = re.compile(r"END|REACH|DEST|GOAL|FINAL")
_FORCE_X: Final = re.compile(r"F_?X|(.*_)?FORCE_?X(_.*)?|X_FORCE(_.*)?")


@dataclass(frozen=True)
class Direction:
    """A direction in the recording's frame.

    `source`: name of the setting.
    `degrees`: from +x, counter-clockwise, in [0, 360).
    `size`: of the load in N, or of the distance in m; None if the tables do not state it.
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
    """Return the disturbance's direction; None if the tables state no direction or several.

    `settings`: column of `TP_TABLE` -> number or text.
    `loads`: setting that is a load -> columns of `LOAD_TABLE`.
    `targets`: setting that is a target -> position in m, from any origin, or None.
    """
    mirror = -1.0 if side == "left" else 1.0
    stated = {n: v for n, v in settings.items() if n.endswith("DIRECTION_DEG")}
    if len(stated) == 1:
        ((name, value),) = stated.items()
        if isinstance(value, float):
            angle = np.deg2rad(value)
            return _direction("stated", name, mirror * np.cos(angle), np.sin(angle), sized=False)
    force_by_load = {name: force_of(row, side) for name, row in loads.items()}
    forces = {name: force for name, force in force_by_load.items() if force is not None}
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
    """Return the settings of the start and end target of a movement; None if not unique."""
    names = list(targets)
    return _one(names, _START), _one(names, _END)


def force_columns(load: Mapping[str, Value]) -> tuple[str, str] | None:
    """Return the columns of a load's force along x and y; None if the names do not show them."""
    pairs = [(n, re.sub(r"X(?=$|_)", "Y", n, count=1)) for n in load if _FORCE_X.fullmatch(n)]
    whole = [pair for pair in pairs if all(isinstance(load.get(n), float) for n in pair)]
    chosen = [pair for pair in whole if pair[0] in ("FORCE_X", "FX")] or whole
    return chosen[0] if len(chosen) == 1 else None


def force_of(load: Mapping[str, Value], side: Side) -> tuple[float, float] | None:
    """Return the force of a load in the recording's frame, N; None if the table has none."""
    columns = force_columns(load)
    if columns is None:
        return None
    x, y = (float(load[name]) for name in columns)
    return (-x if side == "left" and x else x), y


def only_strongest(directions: Iterable[Direction | None]) -> list[Direction | None]:
    """Replace directions from sources weaker than the strongest in the exam by None.

    If loads push in some protocols, a protocol without a load has no disturbance: the way to its
    target is a voluntary movement.
    """
    every = list(directions)
    kinds = [direction.kind for direction in every if direction is not None]
    strongest = next((kind for kind in _STRONGEST_FIRST if kind in kinds), None)
    return [item if item is not None and item.kind == strongest else None for item in every]


def _direction(
    kind: Kind, source: str, x: float, y: float, *, sized: bool = True
) -> Direction | None:
    if x == 0.0 and y == 0.0:
        return None
    degrees = float(round(np.rad2deg(np.arctan2(y, x)), 3) % 360.0)
    return Direction(kind, source, degrees, round(float(np.hypot(x, y)), 6) if sized else None)


def _one(names: list[str], pattern: re.Pattern[str]) -> str | None:
    """Name of the target that starts or ends a movement; None if there is not exactly one."""
    matching = [name for name in names if pattern.search(name)]
    exact = [name for name in matching if name in ("START_TARGET", "END_TARGET")]
    chosen = exact or matching
    return chosen[0] if len(chosen) == 1 else None


#: Parameters of a table that are not columns.
_NO_COLUMNS: Final = ("USED", "COLUMN_ORDER", "DESCRIPTIONS", "DESCRIPTION", "UNITS")

#: Columns of `TP_TABLE` that may name a protocol.
_NAMES: Final = ("NAME", "TP_NAME", "LABEL", "TITLE")

#: Settings that are rows of the target table; `TARGET_ON_TIME` and the like are not.
_TARGET: Final = re.compile(
    r"(.*_)?(START|INIT|HOME|ORIGIN|CENTER|CENTRE|END|REACH|GOAL|FINAL|DEST|DESTINATION)?"
    r"TARGET(_?\d+|_(ROW|START|END))?"
)

#: Settings that are rows of the load table; `LOAD_DELAY` and the like are not.
_LOAD: Final = re.compile(r"(.*_)?LOAD(_?\d+|_ROW)?")


@dataclass(frozen=True)
class Protocol:
    """Settings of one trial from the exam's tables.

    `row`: row of `TP_TABLE`, from 1.
    `name`: the exam's name of the protocol; "" if it has none.
    `settings`: column of `TP_TABLE` -> number or text.
    `targets`: setting that is a target -> position (x, y) in m in the recording's frame, or None if
    the table does not state it.
    `ways`: the same targets in m from any common origin, for the vector between two targets.
    `loads`: setting that is a load -> the columns of the load table.
    `direction`: direction of the disturbance.
    """

    row: int
    name: str
    settings: Mapping[str, Value]
    targets: Mapping[str, tuple[float, float] | None]
    ways: Mapping[str, tuple[float, float] | None]
    loads: Mapping[str, Mapping[str, Value]]
    side: Side
    direction: Direction | None

    def columns(self) -> dict[str, Value]:
        """Return the settings as columns of the trial table.

        `tp_<setting>` as in `TP_TABLE`; `<setting>_x_m`, `<setting>_y_m` for a target;
        `load_<column>` for a single load from `LOAD_TABLE`, `<setting>_<column>` for several;
        `direction_deg` if the tables have a direction.
        """
        columns: dict[str, Value] = {f"tp_{plain(n)}": v for n, v in self.settings.items()}
        for name, place in self.targets.items():
            if place is not None:
                columns |= {f"{plain(name)}_{axis}_m": place[i] for i, axis in enumerate("xy")}
        for name, load in self.loads.items():
            first = "load" if len(self.loads) == 1 else plain(name)
            columns |= {f"{first}_{plain(column)}": value for column, value in load.items()}
        if self.direction is not None:
            columns |= {
                "direction_deg": self.direction.degrees,
                "direction_from": self.direction.source,
            }
        return columns


def protocol_of(trial: ExamTrial, common: ExamFile, side: Side) -> Protocol:
    """Read the settings of a trial from the tables.

    `side`: a left arm's targets and loads are mirrored, as its hand is.
    """
    row = protocol_row(trial)
    settings = _row(trial.file, common, "TP_TABLE", row)
    targets = dict(_targets(settings, trial.file, common, side))
    direction_targets = targets
    if None in targets.values() and side == "right":
        # the origin of older tables is the task's; a left arm's may be mirrored or not
        direction_targets = dict(_targets(settings, trial.file, common, side, ("X", "Y")))
    loads = dict(_loads(settings, trial.file, common))
    direction = direction_of(settings, loads, direction_targets, side)
    stated = trial.file.parameters.text("TRIAL", "TP")
    if not stated or stated.isdigit():
        stated = next((str(settings[n]) for n in _NAMES if isinstance(settings.get(n), str)), "")
    return Protocol(row, stated, settings, targets, direction_targets, loads, side, direction)


def as_written(value: object) -> float:
    """Return a single-precision number as its shortest decimal: 0.665, not 0.6650000215."""
    return float(str(np.float32(value)))  # type: ignore[arg-type]


def protocol_row(trial: ExamTrial) -> int:
    """Row of `TP_TABLE` of a trial: `TRIAL:TP_ROW`, in older exams from the file's name."""
    row = trial.file.parameters.number("TRIAL", "TP_ROW")
    return trial.protocol if row is None else int(row)


def _row(trial_file: ExamFile, common: ExamFile, group: str, row: int) -> dict[str, Value]:
    """Read one row of a table, counted from 1, by the names of its columns, in capitals."""
    file = next((f for f in (trial_file, common) if f.parameters.groups.get(group)), common)
    used = file.parameters.number(group, "USED")
    if row < 1 or (used is not None and row > used):
        return {}
    return dict(_cells(file.parameters.groups.get(group, {}), row - 1, int(used or 1)))


def _cells(table: Mapping[str, Entry], index: int, rows: int) -> Iterator[tuple[str, Value]]:
    for name, column in table.items():
        least = max(rows, index + 1)
        if name in _NO_COLUMNS or max(len(column.texts), len(column.numbers)) < least:
            continue
        if column.texts and column.texts[index]:
            yield name, column.texts[index]
        elif len(column.numbers) and np.isfinite(column.numbers[index]):
            yield name, as_written(column.numbers[index])


def _targets(
    settings: Mapping[str, Value],
    file: ExamFile,
    common: ExamFile,
    side: Side,
    columns: tuple[str, str] = ("X_GLOBAL", "Y_GLOBAL"),
) -> Iterator[tuple[str, tuple[float, float] | None]]:
    """Yield each setting that is a target, with its position in m, or None."""
    mirror = -1.0 if side == "left" else 1.0
    for name, value in settings.items():
        if not (_TARGET.fullmatch(name) and _counts(value)):
            continue
        target = _row(file, common, "TARGET_TABLE", int(value))
        x, y = (target.get(column) for column in columns)
        if isinstance(x, float) and isinstance(y, float):
            # adding 0 makes a mirrored zero positive
            yield name, (round(mirror * x / 100.0, 9) + 0.0, round(y / 100.0, 9))
        else:
            yield name, None


def _loads(
    settings: Mapping[str, Value], file: ExamFile, common: ExamFile
) -> Iterator[tuple[str, dict[str, Value]]]:
    """Yield each setting that is a load and has a row in the load table, with this row."""
    for name, value in settings.items():
        if is_load(name) and _counts(value):
            row = _row(file, common, "LOAD_TABLE", int(value))
            if row:
                yield name, row


def is_load(setting: str) -> bool:
    """Return True if a setting, by its name, is a row of the load table; row 0 means no load."""
    return _LOAD.fullmatch(setting) is not None


def _counts(value: object) -> bool:
    """True if a cell is a row of another table: an integer from 1."""
    return isinstance(value, float) and value >= 1 and value == int(value)


def plain(name: str) -> str:
    """Return a name for use in a column's name: lower-case letters, digits and underscores."""
    return re.sub(r"\W+", "_", name).strip("_").lower()
