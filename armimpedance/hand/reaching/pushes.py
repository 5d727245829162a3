"""Which trials were pushed, when and whereto; which ones nobody pushed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray, FrozenRecord
from armimpedance.core.errors import InputError
from armimpedance.core.records import Recording

#: Columns of the trial table, and what stands in them.
COLUMNS: Final = {
    "phase": "a name for when the push comes, empty in a trial that nobody pushed",
    "push_deg": "its direction, empty in a trial that nobody pushed, and where the samples' "
    "columns command_x and command_y hold what the robot was told",
    "push_onset_s": "its onset on the trial's clock, empty in a trial that nobody pushed",
}
#: Optional columns of the samples: what a robot was told that pushes throughout, in any unit.
COMMAND: Final = ("command_x", "command_y")
#: Optional: when the robot lets go.
END: Final = "push_end_s"
#: A push that does not say its end is taken to last this long (s).
USUAL_PUSH_S: Final = 0.12


@dataclass(frozen=True)
class Pushes(FrozenRecord):
    """The trials' pushes.

    `phase`: "" where nobody pushed.
    `direction` (T, 2): unit vectors; 0 where nobody pushed.
    `onset_s` (T,): 0 where nobody pushed.
    `duration_s`: of the longest push.
    `command` (N, 2) or None: what the robot was told at each sample, where it pushed throughout.
    """

    phase: tuple[str, ...]
    direction: Annotated[FloatArray, "T 2"]
    onset_s: Annotated[FloatArray, "T"]
    duration_s: float
    command: Annotated[FloatArray, "N 2"] | None = None

    def throughout(self, phase: str) -> bool:
        """Whether this phase's pushes are random courses, which have no direction."""
        return not self.direction[self.rows(phase)].any()

    @property
    def pushed(self) -> BoolArray:
        """(T,)"""
        return np.array([bool(name) for name in self.phase])

    @property
    def phases(self) -> tuple[str, ...]:
        """The phases, in the order of their mean onset."""
        names = [name for name in dict.fromkeys(self.phase) if name]
        return tuple(sorted(names, key=lambda name: float(self.onset_s[self.rows(name)].mean())))

    def rows(self, phase: str) -> BoolArray:
        """(T,) trials that were pushed at this phase."""
        return np.array([name == phase for name in self.phase])


def pushes_of(recording: Recording) -> Pushes:
    """What the trial table says of the pushes.

    Raises InputError: a column is missing, a pushed trial lacks its direction or onset, an onset
    lies outside of its trial, or no trial was pushed.
    """
    table = recording.trials
    command = _command(recording)
    for name, holds in COLUMNS.items():
        if name not in table and (name != "push_deg" or command is None):
            raise InputError(
                "no such column in the trial table", column=name, expected=f"a column with {holds}"
            )
    phase = tuple("" if _is_empty(value) else str(value) for value in table["phase"])
    pushed = np.array([bool(name) for name in phase])
    if not pushed.any():
        raise InputError("no trial was pushed", column="phase", expected=COLUMNS["phase"])
    onset = _numbers(recording, "push_onset_s", pushed)
    random = pushed & ~_told(recording, command)
    angle = np.zeros(len(pushed))
    if (pushed & ~random).any():
        angle = np.nan_to_num(_numbers(recording, "push_deg", pushed & ~random))
    _check_onsets(recording, onset, pushed)
    radians = np.radians(np.where(pushed, angle, 0.0))
    direction = np.stack([np.cos(radians), np.sin(radians)], axis=1) * (pushed & ~random)[:, None]
    duration = USUAL_PUSH_S
    if END in table:
        lasting = _numbers(recording, END, pushed)[pushed] - onset[pushed]
        if not (lasting > 0).all():
            raise InputError("a push ends before it begins", column=END, expected="its end")
        duration = float(lasting.max())
    return Pushes(phase, direction, np.where(pushed, onset, 0.0), duration, command)


def _told(recording: Recording, command: FloatArray | None) -> BoolArray:
    """Whether the pushes of trials (T,) have a direction, which only commands can replace."""
    table = recording.trials
    if command is None:
        return np.ones(len(table), dtype=bool)
    if "push_deg" not in table:
        return np.zeros(len(table), dtype=bool)
    return np.array([not _is_empty(value) for value in table["push_deg"]])


def _command(recording: Recording) -> FloatArray | None:
    """What the robot was told (N, 2): columns `COMMAND` of the samples, if they are there."""
    if not all(name in recording.extra for name in COMMAND):
        return None
    return np.nan_to_num(np.stack([recording.extra[name] for name in COMMAND], axis=1))


def _is_empty(value: object) -> bool:
    return value is None or value != value or str(value).strip() in ("", "none")


def _numbers(recording: Recording, column: str, pushed: BoolArray) -> FloatArray:
    try:
        values = recording.trials[column].to_numpy(dtype=float)
    except (TypeError, ValueError):
        raise InputError("not all numbers", column=column, expected=COLUMNS.get(column)) from None
    missing = pushed & ~np.isfinite(values)
    if missing.any():
        trial = recording.trials["trial"].iloc[int(np.flatnonzero(missing)[0])]
        raise InputError(
            f"trial {trial} was pushed and has no number", column=column, expected="a number"
        )
    return np.asarray(values)


def _check_onsets(recording: Recording, onset: FloatArray, pushed: BoolArray) -> None:
    first = recording.time_s[recording.offsets[:-1]]
    last = recording.time_s[recording.offsets[1:] - 1]
    outside = pushed & ((onset < first) | (onset > last))
    if outside.any():
        row = int(np.flatnonzero(outside)[0])
        raise InputError(
            f"trial {recording.trials['trial'].iloc[row]}: a push at {onset[row]:g} s",
            column="push_onset_s",
            expected=f"a time from {first[row]:g} to {last[row]:g} s",
        )
