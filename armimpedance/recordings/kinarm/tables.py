"""The tables of a Kinarm exam: what each trial protocol shows, where its targets are, its load.

`TP_TABLE` has a row for each trial protocol and a column (a parameter) for each of the task's
settings; a setting may be a row, counted from 1, of `TARGET_TABLE` (`X_GLOBAL`, `Y_GLOBAL` in cm,
in the frame of the hand) or of `LOAD_TABLE`. They stand in `common.c3d`, in older exams in every
trial.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
import pandas as pd

from armimpedance.recordings.c3d_parameters import Parameter
from armimpedance.recordings.kinarm.exam_file import ExamFile
from armimpedance.recordings.kinarm.files import ExamTrial
from armimpedance.recordings.kinarm.robot import Side

#: Parameters of a table that are no columns.
_NO_COLUMNS: Final = ("USED", "COLUMN_ORDER", "DESCRIPTIONS", "DESCRIPTION", "UNITS")

#: Columns of `TP_TABLE` that may name a protocol.
_NAMES: Final = ("NAME", "TP_NAME", "LABEL", "TITLE")

#: Settings that are rows of the target table; `TARGET_ON_TIME` and the like are not.
_TARGET: Final = re.compile(r"(.*_)?TARGET(_?\d+)?")

_START: Final = re.compile(r"START|INIT|HOME|ORIGIN")
_END: Final = re.compile(r"END|REACH|DEST|GOAL|FINAL")

#: Columns of the table that no recording has: a trial's file, and of its direction, which setting
#: it is from and how large.
HIDDEN: Final = ("file_index", "direction_from", "direction_size")
_HIDDEN: Final = HIDDEN[1:]

Value = float | str


@dataclass(frozen=True)
class _Direction:
    """A direction, the setting that it is from, and its components in the recording's frame."""

    source: str
    x: float
    y: float

    @property
    def degrees(self) -> float | None:
        """From +x, in [0, 360); None of no direction."""
        if self.x == 0.0 and self.y == 0.0:
            return None
        return float(round(np.rad2deg(np.arctan2(self.y, self.x)), 3) % 360.0)


def as_written(value: object) -> float:
    """A single-precision number as the decimal that it stands for: 0.665, not 0.6650000215."""
    return float(str(np.float32(value)))  # type: ignore[arg-type]


def protocol_row(trial: ExamTrial) -> int:
    """The row of `TP_TABLE` that a trial ran: `TRIAL:TP_ROW`, in older exams in the file's name."""
    row = trial.file.number("TRIAL", "TP_ROW")
    return trial.protocol if row is None else int(row)


def protocol_columns(trial: ExamTrial, common: ExamFile, side: Side) -> dict[str, Value]:
    """What the tables say of a trial, as columns of the trial table.

    Parameters
    ----------
    trial : ExamTrial
    common : ExamFile
    side : {"right", "left"}
        A left arm's targets are mirrored as its hand is.

    Returns
    -------
    dict
        `tp_<setting>` as it stands in `TP_TABLE`; `<setting>_x_m`, `<setting>_y_m` where it is a
        target; `load_<column>` of the row of `LOAD_TABLE` that `LOAD` names; `direction_deg` where
        the tables say one (`_direction`).
    """
    settings = _row(trial.file, common, "TP_TABLE", protocol_row(trial))
    columns: dict[str, Value] = {f"tp_{_plain(n)}": value for n, value in settings.items()}
    places = dict(_places(settings, trial.file, common, side))
    for name, place in places.items():
        columns |= {f"{_plain(name)}_{axis}_m": place[i] for i, axis in enumerate("xy")}
    load = _load(settings, trial.file, common)
    columns |= {f"load_{_plain(name)}": value for name, value in load.items()}
    direction = _direction(settings, load, places, side)
    if direction is None or direction.degrees is None:
        return columns
    size = round(float(np.hypot(direction.x, direction.y)), 4)
    return {
        **columns,
        "direction_deg": direction.degrees,
        "direction_from": direction.source,
        "direction_size": size,
    }


def stated_name(trial: ExamTrial, common: ExamFile) -> str:
    """The name that the exam gives to a trial's protocol; "" where it gives none."""
    stated = trial.file.text("TRIAL", "TP") or ""
    if stated and not stated.isdigit():
        return stated
    settings = _row(trial.file, common, "TP_TABLE", protocol_row(trial))
    return next((str(settings[n]) for n in _NAMES if isinstance(settings.get(n), str)), "")


def protocol_name(trial: ExamTrial, common: ExamFile) -> str:
    """A readable name of a protocol without a name: its row, its targets, its load."""
    settings = _row(trial.file, common, "TP_TABLE", protocol_row(trial))
    words = [f"TP_{protocol_row(trial)}"]
    targets = {n: v for n, v in settings.items() if _TARGET.fullmatch(n) and _counts(v)}
    first, last = _one(targets, _START), _one(targets, _END)
    if first and last:
        words.append(f"target {targets[first]:g} to {targets[last]:g}")
    else:
        words += [f"{_plain(name)} {value:g}" for name, value in targets.items()]
    if _counts(settings.get("LOAD")):
        words.append(f"load {settings['LOAD']:g}")
    return " ".join(words)


def _row(own: ExamFile, common: ExamFile, group: str, row: int) -> dict[str, Value]:
    """One row of a table, counted from 1, by the names of its columns in the file, in capitals."""
    file = next((f for f in (own, common) if f.parameters.get(group)), common)
    used = file.number(group, "USED")
    if row < 1 or (used is not None and row > used):
        return {}
    return dict(_cells(file.parameters.get(group, {}), row - 1, int(used or 1)))


def _cells(table: Mapping[str, Parameter], index: int, rows: int) -> Iterator[tuple[str, Value]]:
    for name, column in table.items():
        flat = column if isinstance(column, tuple) else column.ravel()
        if name in _NO_COLUMNS or len(flat) < max(rows, index + 1):
            continue
        if isinstance(column, tuple):
            if column[index]:
                yield name, column[index]
        elif np.isfinite(flat[index]):
            yield name, as_written(flat[index])


def _places(
    settings: Mapping[str, Value], own: ExamFile, common: ExamFile, side: Side
) -> Iterator[tuple[str, tuple[float, float]]]:
    """Each setting that is a target, with its place in m."""
    mirror = -1.0 if side == "left" else 1.0
    for name, value in settings.items():
        if not (_TARGET.fullmatch(name) and _counts(value)):
            continue
        target = _row(own, common, "TARGET_TABLE", int(value))
        x, y = target.get("X_GLOBAL"), target.get("Y_GLOBAL")
        if isinstance(x, float) and isinstance(y, float):
            # Adding 0 makes a mirrored zero positive.
            yield name, (round(mirror * x / 100.0, 9) + 0.0, round(y / 100.0, 9))


def _load(settings: Mapping[str, Value], own: ExamFile, common: ExamFile) -> dict[str, Value]:
    """The row of the load table that the setting `LOAD` names; empty where there is none."""
    row = settings.get("LOAD")
    return _row(own, common, "LOAD_TABLE", int(row)) if _counts(row) else {}  # type: ignore[arg-type]


def _direction(
    settings: Mapping[str, Value],
    load: Mapping[str, Value],
    places: Mapping[str, tuple[float, float]],
    side: Side,
) -> _Direction | None:
    """The disturbance in the recording's frame.

    A setting `…DIRECTION_DEG`; else that of the load's force, columns such as `FORCE_X, FORCE_Y`;
    else from the start's to the end's target.
    """
    mirror = -1.0 if side == "left" else 1.0
    stated = [n for n, v in settings.items() if n.endswith("DIRECTION_DEG")]
    if len(stated) == 1:
        angle = np.deg2rad(float(settings[stated[0]]))
        return _Direction(stated[0], mirror * float(np.cos(angle)), float(np.sin(angle)))
    force = _force_columns(load)
    if force is not None:
        return _Direction("LOAD", mirror * force[0], force[1])
    first, last = _one(places, _START), _one(places, _END)
    if first is None or last is None:
        return None
    return _Direction(last, *(places[last][i] - places[first][i] for i in (0, 1)))


def _force_columns(load: Mapping[str, Value]) -> tuple[float, float] | None:
    """The force of a load along x and y; None where its columns do not say so by their names."""
    for name, x in load.items():
        if re.fullmatch(r"F_?X|(.*_)?FORCE_?X(_.*)?|X_FORCE(_.*)?", name):
            y = load.get(re.sub(r"X(?=$|_)", "Y", name, count=1))
            if isinstance(x, float) and isinstance(y, float):
                return x, y
    return None


def _one(names: Mapping[str, object], pattern: re.Pattern[str]) -> str | None:
    """The one target that starts or ends a movement; None where none or several might."""
    found = [name for name in names if pattern.search(name)]
    exact = [name for name in found if name in ("START_TARGET", "END_TARGET")]
    chosen = exact or found
    return chosen[0] if len(chosen) == 1 else None


def _counts(value: object) -> bool:
    """Whether a cell is a row of another table: a whole number from 1."""
    return isinstance(value, float) and value >= 1 and value == int(value)


def _plain(name: str) -> str:
    return re.sub(r"\W+", "_", name).strip("_").lower()


def with_direction(trials: pd.DataFrame, named: bool) -> tuple[pd.DataFrame, list[str]]:
    """The table with `direction_deg` for all trials or for none, and remarks.

    Where all have one, protocols that differ in nothing else are one condition: eight pushes at
    one place are eight rows of the table and one experiment.

    Parameters
    ----------
    trials : DataFrame
    named : bool
        Whether the exam names its protocols, so that the conditions are its own.
    """
    if "direction_deg" not in trials:
        return trials, []
    hidden, trials = trials[list(_HIDDEN)], trials.drop(columns=list(_HIDDEN))
    known = trials["direction_deg"].notna()
    if not known.all():
        without = ", ".join(map(str, trials["trial"][~known].tolist()))
        remark = f"No direction_deg: the exam's tables give none to trials {without}."
        return trials.drop(columns="direction_deg"), [remark]
    sources = sorted(set(hidden["direction_from"]))
    remarks = [f"direction_deg: from the exam's tables ({', '.join(sources)})."]
    if named or len(sources) > 1:
        return trials, remarks
    pooled = _pooled_conditions(trials, f"tp_{_plain(sources[0])}", hidden["direction_size"])
    if pooled.nunique() < trials["condition"].nunique():
        remarks.append("Conditions: trial protocols that differ in direction only are together.")
        trials = trials.assign(condition=pooled)
    return trials, remarks


def _pooled_conditions(trials: pd.DataFrame, source: str, size: pd.Series) -> pd.Series:
    """Names of the conditions by every setting but that of the direction."""
    settings = [c for c in trials if str(c).startswith("tp_") and c != source]
    key = trials[settings].assign(size=size)
    if source == "tp_load":
        other = [c for c in trials if str(c).startswith("load_") and "force" not in str(c)]
        key = pd.concat([key, trials[other]], axis=1)
    varying = [c for c in key if len(set(key[c])) > 1]
    if not varying:
        rows = sorted(set(trials["protocol"]))
        name = f"TP_{rows[0]}" if len(rows) == 1 else f"TP_{rows[0]} to TP_{rows[-1]}"
        return pd.Series(name, index=trials.index)
    words = [
        [
            f"{str(c).removeprefix('tp_')} {v if isinstance(v, str) else format(v, 'g')}"
            for v in key[c]
        ]
        for c in varying
    ]
    return pd.Series([" ".join(each) for each in zip(*words, strict=True)], index=trials.index)
