"""Trials of a Kinarm exam: numbers, protocols, events, conditions, and their selection."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import pandas as pd

from armimpedance.core.errors import InputError
from armimpedance.recordings.kinarm.exam_file import ExamFile
from armimpedance.recordings.kinarm.files import ExamTrial, LeftOut
from armimpedance.recordings.kinarm.robot import Side
from armimpedance.recordings.kinarm.tables import (
    Protocol,
    Value,
    as_written,
    ends_of,
    force_columns,
    force_of,
    is_load,
    only_strongest,
    plain,
    protocol_of,
    protocol_row,
)
from armimpedance.recordings.where import parse_where

# Names of the conditions of a Kinarm exam: its own names, else its settings in words.
#
# Protocols that differ only in the direction of the disturbance are one condition: eight pushes at
# one position are eight rows of the table and one experiment.

#: Most columns of a load in its description.
_MOST_COLUMNS: Final = 3


def condition_names(protocols: Sequence[Protocol]) -> tuple[list[str], list[str]]:
    """Return the condition of each trial, and remarks.

    `protocols`: of all trials of the exam, so that names do not depend on the selection.
    """
    names, remarks = [""] * len(protocols), list[str]()
    # unnamed protocols are of two kinds: with and without a disturbance
    kinds = [(p.name, not p.name and p.direction is not None) for p in protocols]
    for kind in dict.fromkeys(kinds):
        rows = [i for i, other_kind in enumerate(kinds) if other_kind == kind]
        group_names, remark = _names([protocols[i] for i in rows])
        remarks += remark
        for i, name in zip(rows, group_names, strict=True):
            names[i] = name
    return names, remarks


def _differences(protocols: Sequence[Protocol]) -> tuple[list[str], list[str]]:
    """Features in which protocols differ, and their values for each protocol, in words."""
    features = [dict(_features(protocol)) for protocol in protocols]
    labels = list(dict.fromkeys(label for values in features for label in values))
    varying = [n for n in labels if len({values.get(n) for values in features}) > 1]
    return varying, [" ".join(values[n] for n in varying if n in values) for values in features]


def _names(protocols: Sequence[Protocol]) -> tuple[list[str], list[str]]:
    """Names of protocols with the same stated name, or of one of the two unnamed kinds."""
    stated = protocols[0].name
    varying, words = _differences(protocols)
    rows = sorted({protocol.row for protocol in protocols})
    if stated:
        if not varying:
            return [stated] * len(protocols), []
        note = f"Conditions: trial protocols named {stated} differ in {', '.join(varying)}."
        return [f"{stated} {differences}".strip() for differences in words], [note]
    pooled = len(set(words)) < len(rows) and any(p.direction is not None for p in protocols)
    if not pooled:
        return [" ".join([f"TP_{p.row}", *_description(p)]) for p in protocols], []
    remark = "Conditions: trial protocols that differ in direction only are together."
    together = f"TP_{rows[0]} to TP_{rows[-1]}"
    return [differences or together for differences in words], [remark]


def _features(protocol: Protocol) -> Iterator[tuple[str, str]]:
    """Yield the features of a protocol other than its direction: label, and value in words."""
    direction = protocol.direction
    for name, value in protocol.settings.items():
        label, source = plain(name), direction is not None and name == direction.source
        if source and direction is not None and direction.kind == "stated":
            continue
        if name in protocol.loads:
            yield from _of_load(protocol, name, at=not source)
        elif is_load(name):
            yield label, f"no {label}" if value == 0.0 else f"{label} {_number(value)}"
        elif source and direction is not None and direction.size is not None:
            yield label, f"target {_cm(direction.size)} cm"
        elif name in protocol.targets:
            yield label, f"{label} {_place(protocol, name)}"
        else:
            yield label, f"{label} {_number(value)}"


def _of_load(protocol: Protocol, name: str, *, at: bool) -> Iterator[tuple[str, str]]:
    """Yield a load in words: its force in N, and further columns of its row."""
    label, load = plain(name), protocol.loads[name]
    force = force_of(load, protocol.side)
    if force is not None:
        size = f"{label} {np.hypot(*force):.4g} N"
        yield label, f"{size} at {_degrees(*force)} deg" if at and any(force) else size
    for column, value in load.items():
        if column not in (force_columns(load) or ()):
            yield f"{label}_{plain(column)}", f"{label} {plain(column)} {_number(value)}"


def in_words(protocol: Protocol) -> str:
    """Return a protocol's name, else its targets and loads; "" if the tables have neither."""
    return protocol.name or " ".join(_description(protocol))


def _description(protocol: Protocol) -> Iterator[str]:
    """Yield a short description of a single protocol: start, end, and loads."""
    first, last = ends_of(protocol.targets)
    start, end = protocol.ways.get(first or ""), protocol.ways.get(last or "")
    if start is not None and end is not None:
        vector = end[0] - start[0], end[1] - start[1]
        text = f"target {_cm(float(np.hypot(*vector)))} cm"
        yield f"{text} at {_degrees(*vector)} deg" if any(vector) else text
    elif first and last:
        yield f"target {_number(protocol.settings[first])} to {_number(protocol.settings[last])}"
    else:
        yield from (f"{plain(name)} {_place(protocol, name)}" for name in protocol.targets)
    for name in protocol.loads:
        words = dict(_of_load(protocol, name, at=True))
        # a load that is no force is described by its columns: a viscosity, torques
        columns = [w for label, w in words.items() if not w.endswith(" 0")][:_MOST_COLUMNS]
        plainly = f"{plain(name)} {_number(protocol.settings[name])}"
        yield words.get(plain(name), ", ".join(columns) or plainly)


def _place(protocol: Protocol, name: str) -> str:
    position = protocol.targets[name]
    if position is None:
        return _number(protocol.settings[name])
    return " ".join(_cm(coordinate) for coordinate in position) + " cm"


def _degrees(x: float, y: float) -> str:
    return f"{round(float(np.rad2deg(np.arctan2(y, x))), 1) % 360.0:g}"


def _cm(metres: float) -> str:
    return f"{round(100.0 * metres, 2) + 0.0:g}"


def _number(value: Value) -> str:
    return value if isinstance(value, str) else f"{value:g}"


#: Internal columns of the table: a trial's file, and the source of its direction.
_HIDDEN: Final = ("file_index", "direction_from")


@dataclass(frozen=True)
class Choice:
    """Selection of trials of an exam.

    `onset_event`, `end_event`: events at which the disturbance begins and ends; trials must have
    them.
    `protocols`: rows of the trial protocols; empty: all.
    `events`: events that a trial must have.
    `without_errors`: leave out trials that the task marked as errors.
    `where`: an expression over the columns of the trial table; see `recordings.where`.
    """

    onset_event: str | None = None
    end_event: str | None = None
    protocols: tuple[int, ...] = ()
    events: tuple[str, ...] = ()
    without_errors: bool = False
    where: str | None = None


def trial_table(
    trials: Sequence[ExamTrial], common: ExamFile, side: Side, keep_personal: bool
) -> tuple[pd.DataFrame, list[str]]:
    """Build a table with one row per trial in their order, `file_index` into `trials`; remarks."""
    numbers = [_whole(trial.file.parameters.number("TRIAL", "TRIAL_NUM")) for trial in trials]
    known = [n for n in numbers if n is not None]
    # numbers may start again in every set; then trials are renumbered by set and number
    sequence = sorted(range(len(numbers)), key=lambda i: (trials[i].block, numbers[i] or 0, i))
    unique = len(known) == len(numbers) == len(set(known))
    if unique:
        sequence = sorted(sequence, key=lambda i: numbers[i] or 0)
    protocols = [protocol_of(trials[i], common, side) for i in sequence]
    directions = only_strongest(protocol.direction for protocol in protocols)
    protocols = [replace(p, direction=d) for p, d in zip(protocols, directions, strict=True)]
    names, remarks = condition_names(protocols)
    rows = []
    for running, (i, protocol) in enumerate(zip(sequence, protocols, strict=True), start=1):
        number = numbers[i] if unique else running
        row: dict[str, object] = {"trial": number, "condition": names[running - 1]}
        row |= _trial_row(trials[i], keep_personal) | protocol.columns()
        rows.append(row | {"file_index": i})
    table = pd.DataFrame(rows)
    for label, column in table.items():
        if not pd.api.types.is_numeric_dtype(column):
            table[label] = column.fillna("")
    remark = "Trial numbers are not unique in the exam: counted through, by set and number."
    return table, [*remarks, *([] if unique else [remark])]


def _trial_row(trial: ExamTrial, keep_personal: bool) -> dict[str, object]:
    file = trial.file
    row: dict[str, object] = {
        "set": trial.block,
        "protocol": protocol_row(trial),
        "repetition": trial.repetition,
        "is_error": bool(file.parameters.number("TRIAL", "IS_ERROR") or 0),
    }
    row |= _events(file)
    if keep_personal:
        row["date"] = file.parameters.text("TRIAL", "DATE")
        row["time_of_day"] = file.parameters.text("TRIAL", "TIME")
    return row


def _whole(value: float | None) -> int | None:
    return int(value) if value is not None and value == np.round(value) else None


def _events(file: ExamFile) -> dict[str, float]:
    """First time of each event, s from the trial's start, by column of the trial table."""
    labels = file.parameters.texts("EVENTS", "LABELS")
    seconds = np.array([as_written(t) for t in file.parameters.numbers("EVENTS", "TIMES")])
    if not labels or not len(seconds):
        return {}
    if len(seconds) == 2 * len(labels):
        # pairs of minutes and seconds as in the guide; Dexterit-E does not use the first number
        seconds = seconds[1::2]
    used = file.parameters.number("EVENTS", "USED")
    count = len(labels) if used is None else max(int(used), 0)
    first: dict[str, float] = {}
    for label, time_s in list(zip(labels, seconds.tolist(), strict=False))[:count]:
        if label and np.isfinite(time_s):
            column = event_column(label)
            first[column] = min(time_s, first.get(column, np.inf))
    return first


def event_column(label: str) -> str:
    """Name of the column of the trial table with an event's times."""
    return "event_" + re.sub(r"\W+", "_", label).strip("_") + "_s"


def chosen_trials(
    trials: pd.DataFrame, choice: Choice, path: object
) -> tuple[pd.DataFrame, list[str]]:
    """Select the requested trials; return them and sentences on those left out.

    Raises InputError: an event or a protocol is in no trial, or no trial remains.
    """
    usable = pd.Series(True, index=trials.index)
    remarks: list[str] = []

    def leave_out(wanted: pd.Series, reason: str) -> None:
        numbers = trials["trial"][usable & ~wanted].tolist()
        if numbers:
            remarks.append(f"Left out, {reason}: trials {', '.join(map(str, numbers))}.")
        usable[~wanted] = False

    if choice.protocols:
        _refuse_unknown(choice.protocols, sorted(set(trials["protocol"])), path)
        names = ", ".join(map(str, choice.protocols))
        leave_out(trials["protocol"].isin(choice.protocols), f"of other protocols than {names}")
    for label in choice.events:
        leave_out(_has(trials, label, path), f"without the event {label}")
    if choice.without_errors:
        leave_out(~trials["is_error"], "marked as errors")
    if choice.where is not None:
        shown = trials.drop(columns=[c for c in _HIDDEN if c in trials])
        met, sentence = parse_where(choice.where).choose(shown, path)
        remarks.append(sentence)
        usable[~met] = False
    both = pd.Series(True, index=trials.index)
    for event in (choice.onset_event, choice.end_event):
        if event is not None:
            both &= _has(trials, event, path)
    leave_out(both, "without the event of the onset or end")
    if not usable.any():
        problem = "no trial is left of those asked for: " + " ".join(remarks)
        raise InputError(problem, file=path, expected="a choice that some trial meets")
    return trials[usable].reset_index(drop=True), remarks


def _refuse_unknown(requested: Sequence[int], available: Sequence[int], path: object) -> None:
    for protocol in requested:
        if protocol not in available:
            expected = f"one of {', '.join(map(str, available))}"
            raise InputError(f"no trial of protocol {protocol}", file=path, expected=expected)


def _has(trials: pd.DataFrame, label: str, path: object) -> pd.Series:
    """True for trials that have an event, (T,)."""
    column = event_column(label)
    if column not in trials:
        events = [c[6:-2] for c in map(str, trials) if c.startswith("event_")]
        raise InputError(
            f"no trial has the event {label}",
            file=path,
            expected=f"one of {', '.join(events)}" if events else "an exam with events",
        )
    return trials[column].notna()


def with_onsets(
    trials: pd.DataFrame, files: Sequence[ExamTrial], choice: Choice
) -> tuple[pd.DataFrame, list[LeftOut]]:
    """Add `onset_s` and `end_s` from events; return the trials and those with impossible times.

    `trials`: table of trials that have the events.
    `files`: the files, by `file_index`.
    """
    trials = trials.copy()
    for column, label in (("onset_s", choice.onset_event), ("end_s", choice.end_event)):
        if label is not None:
            trials[column] = trials[event_column(label)]
    left_out = []
    for index, row in trials.iterrows():
        trial = files[int(row["file_index"])]
        try:
            _check_onset(trial.file, row, choice)
        except InputError as error:
            left_out.append(LeftOut(trial.name, error))
            trials = trials.drop(index=index)
    return trials.reset_index(drop=True), left_out


def _check_onset(file: ExamFile, row: pd.Series, choice: Choice) -> None:
    """Refuse an onset or end outside the trial, and an end before the onset."""
    last_s = (file.frames - 1) / file.rate_hz
    for column, label in (("onset_s", choice.onset_event), ("end_s", choice.end_event)):
        if label is not None and not 0.0 <= row[column] <= last_s + 0.5 / file.rate_hz:
            raise InputError(
                f"the event {label} at {row[column]:g} s lies outside of the trial",
                file=file.name,
                expected=f"a time from 0 to {last_s:g} s",
            )
    if choice.onset_event and choice.end_event and row["end_s"] <= row["onset_s"]:
        problem = f"the event {choice.end_event} at {row['end_s']:g} s is not after"
        expected = f"a time after {row['onset_s']:g} s"
        raise InputError(f"{problem} {choice.onset_event}", file=file.name, expected=expected)


def with_direction(trials: pd.DataFrame) -> tuple[pd.DataFrame, list[str]]:
    """Return the table with `direction_deg` for all trials or for none, and a remark."""
    if "direction_deg" not in trials:
        return trials, []
    sources = sorted(set(trials["direction_from"]) - {""})
    trials = trials.drop(columns="direction_from")
    known = trials["direction_deg"].notna()
    if known.all():
        return trials, [f"direction_deg: from the exam's tables ({', '.join(sources)})."]
    without = ", ".join(map(str, trials["trial"][~known].tolist()))
    remark = f"No direction_deg: the exam's tables give none to trials {without}."
    return trials.drop(columns="direction_deg"), [remark]
