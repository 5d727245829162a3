"""The trials of a Kinarm exam: numbers, protocols, events."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
import pandas as pd

from armimpedance.errors import InputError
from armimpedance.recordings.c3d_file import C3DFile
from armimpedance.recordings.kinarm.files import Exam, ExamTrial


def trial_table(exam: Exam, keep_personal: bool) -> pd.DataFrame:
    """One row per trial in the order they were run, with `file_index` into `exam.trials`."""
    numbers = [_whole(trial.c3d.number("TRIAL", "TRIAL_NUM")) for trial in exam.trials]
    known = [n for n in numbers if n is not None]
    # Numbers may start again in every set; then the order of sets and numbers is counted through.
    sequence = sorted(range(len(numbers)), key=lambda i: (exam.trials[i].block, numbers[i] or 0, i))
    unique = len(known) == len(numbers) == len(set(known))
    if unique:
        sequence = sorted(sequence, key=lambda i: numbers[i] or 0)
    rows = []
    for running, i in enumerate(sequence, start=1):
        number = numbers[i] if unique else running
        rows.append(
            {"trial": number} | _trial_row(exam.trials[i], keep_personal) | {"file_index": i}
        )
    return pd.DataFrame(rows)


def _trial_row(trial: ExamTrial, keep_personal: bool) -> dict[str, object]:
    c3d = trial.c3d
    name = c3d.text("TRIAL", "TP") or ""
    row: dict[str, object] = {
        "condition": name if name and not name.isdigit() else f"TP_{trial.protocol}",
        "set": trial.block,
        "protocol": trial.protocol,
        "repetition": trial.repetition,
        "is_error": bool(c3d.number("TRIAL", "IS_ERROR") or 0),
    }
    row |= _events(c3d)
    if keep_personal:
        row["date"] = c3d.text("TRIAL", "DATE") or ""
        row["time_of_day"] = c3d.text("TRIAL", "TIME") or ""
    return row


def _whole(value: float | None) -> int | None:
    return int(value) if value is not None and value == np.round(value) else None


def _events(c3d: C3DFile) -> dict[str, float]:
    """Events by column of the trial table, the first of each, in s from the trial's start."""
    labels, times = c3d.texts("EVENTS", "LABELS"), c3d.parameters.get("EVENTS", {}).get("TIMES")
    if not labels or not isinstance(times, np.ndarray):
        return {}
    seconds = times.astype(np.float64)
    if len(seconds) == 2 * len(labels):
        # The guide's form, pairs of minutes and seconds; Dexterit-E leaves the first number unused.
        seconds = seconds[1::2]
    used = c3d.number("EVENTS", "USED")
    count = len(labels) if used is None else max(int(used), 0)
    first: dict[str, float] = {}
    for label, time_s in list(zip(labels, seconds.tolist(), strict=False))[:count]:
        if label and np.isfinite(time_s):
            column = _event_column(label)
            first[column] = min(time_s, first.get(column, np.inf))
    return first


def _event_column(label: str) -> str:
    return "event_" + re.sub(r"\W+", "_", label).strip("_") + "_s"


def used_trials(
    trials: pd.DataFrame, onset_event: str | None, end_event: str | None, path: object
) -> tuple[list[int], list[str]]:
    """Rows of the trials that have the events asked for, and a sentence on those left out."""
    usable = np.ones(len(trials), dtype=bool)
    for label in filter(None, (onset_event, end_event)):
        column = _event_column(label)
        if column not in trials:
            there = [c[6:-2] for c in map(str, trials) if c.startswith("event_")]
            raise InputError(
                f"no trial has the event {label}",
                file=path,
                expected=f"one of {', '.join(there)}" if there else "an exam with events",
            )
        usable &= trials[column].notna().to_numpy()
    if not usable.any():
        raise InputError("no trial has both events", file=path, expected="onset and end")
    left_out = trials["trial"][~usable].tolist()
    remarks = []
    if left_out:
        numbers = ", ".join(map(str, left_out))
        remarks.append(f"Left out, without the event of the onset or end: trials {numbers}.")
    return np.flatnonzero(usable).tolist(), remarks


def set_onsets(
    trials: pd.DataFrame, files: Sequence[C3DFile], onset_event: str | None, end_event: str | None
) -> None:
    """Fill `onset_s` and `end_s` of these trials from their events, which must lie inside.

    Raises
    ------
    InputError
        An event lies outside of its trial, or the end is not after the onset.
    """
    for column, label in (("onset_s", onset_event), ("end_s", end_event)):
        if label is None:
            continue
        trials[column] = trials[_event_column(label)]
        for c3d, time_s in zip(files, trials[column], strict=True):
            last_s = (c3d.frames - 1) / c3d.rate_hz
            if not 0.0 <= time_s <= last_s + 0.5 / c3d.rate_hz:
                raise InputError(
                    f"the event {label} at {time_s:g} s lies outside of the trial",
                    file=c3d.name,
                    expected=f"a time from 0 to {last_s:g} s",
                )
    if onset_event and end_event:
        for c3d, onset, end in zip(files, trials["onset_s"], trials["end_s"], strict=True):
            if end <= onset:
                problem = f"the event {end_event} at {end:g} s is not after {onset_event}"
                raise InputError(problem, file=c3d.name, expected=f"a time after {onset:g} s")
