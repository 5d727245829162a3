"""Text of an overview of a Kinarm exam: lines, tables of text, and the next command."""

from __future__ import annotations

import os
import re
import shlex
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.recordings.kinarm.channels import grouped
from armimpedance.recordings.kinarm.overview import EMPTY, SOUND, ExamOverview, overview_of
from armimpedance.recordings.kinarm.robot import Side
from armimpedance.recordings.where import OTHER_NAMES, plain_name

Row = Mapping[str, object]
Table = tuple[str, Sequence[str], Sequence[Sequence[str]]]

#: Patterns for names of events at which a disturbance begins, and words for its end.
_DISTURBANCE: Final = re.compile(r"PERT|LOAD|PUSH|FORCE|DISTURB|BUMP|PULSE|TORQUE|FIELD")
_BEGINS: Final = re.compile(r"(?<![A-Z])(ON|ONSET|START|BEGIN)(?![A-Z])")
_ENDS: Final = ("OFF", "OFFSET", "END", "STOP", "FINISH")

#: Longer names are shortened in the middle of a table.
_WIDEST: Final = 44


@dataclass(frozen=True)
class ExamLook:
    """Contents of an exam as text.

    `head`: sentences on the whole exam.
    `tables` tuple of (title, header, rows): protocols, blocks, conditions, events, inputs, and
    trials that cannot be used.
    `next`: what to type next, and what the user must know for it.
    `trials`: one mapping per trial, as a row of a table.
    `events`: the labels of its events.
    `pair`: the events that are named as begin and end of a disturbance; None if not exactly one
    pair is.
    `sides`: the arms with a recorded force.
    """

    head: tuple[str, ...]
    tables: tuple[Table, ...]
    next: tuple[str, ...]
    trials: tuple[Row, ...]
    events: tuple[str, ...]
    pair: tuple[str, str] | None
    sides: tuple[Side, ...]


def look_at_exam(path: str | os.PathLike[str], side: Side | None = None) -> ExamLook:
    """Summarise the contents of a Kinarm exam in the experimenter's terms.

    Parameters
    ----------
    path : path
        An exam in any form that `open_recording` takes; it need not have a force sensor.
    side : {"right", "left"}, optional
        The arm to summarise, if both were recorded.

    Returns
    -------
    ExamLook

    Raises
    ------
    InputError
        There is no exam at `path`, or no trial of it can be read.
    """
    overview = overview_of(path, side)
    tables = (
        _by(overview, "protocol", "Protocols"),
        _by(overview, "set", "Blocks"),
        _conditions(overview),
        _events(overview),
        _inputs(overview),
        _broken(overview),
    )
    return ExamLook(
        head=tuple(_head(overview)),
        tables=tuple(table for table in tables if table[2]),
        next=tuple(_next(overview, requested=side)),
        trials=overview.trials,
        events=tuple(_event_times(_sound(overview))),
        pair=_pair(_sound(overview)),
        sides=tuple(side for side, trials in overview.force_trials.items() if trials),
    )


def _head(seen: ExamOverview) -> Iterator[str]:
    counts = _counts(seen.trials)
    kinds = ("empty", "broken", "marked as errors")
    text = ", ".join(f"{n} {kind}" for n, kind in zip(counts[1:], kinds, strict=True))
    yield f"{len(seen.trials)} trials: {text}"
    seconds = [s for row in seen.trials if isinstance(s := row.get("duration_s"), float)]
    rates = ", ".join(f"{rate:g}" for rate in seen.rates_hz)
    lasting = f"{min(seconds):.3g} to {max(seconds):.3g} s" if seconds else "no time"
    yield f"{rates} samples/s; trials last {lasting}, {sum(seconds) / 60:.1f} min in all"
    for side, robot in seen.robots.items():
        n = seen.force_trials[side]
        force = f"force sensor in {n} trials" if n else "no force sensor"
        yield f"{side} robot: {robot}; {force}"
    if not seen.robots:
        yield "robot: the exam does not say"
    if any(seen.force_trials.values()):
        whose = {"limb": "the limb on the device", "device": "the device on the limb"}
        text = whose.get(str(seen.whose_force), "not shown by the robot's dynamics")
        yield f"force by: {text} ({seen.evidence})"
    yield from seen.remarks
    columns = dict.fromkeys(name for row in _sound(seen) for name in row)
    further = [c for c in columns if c not in ("file", "state", "samples", "duration_s")]
    short_names = [short_name for short_name, column in OTHER_NAMES.items() if column in further]
    yield f"columns for --where: {', '.join([*short_names, *map(plain_name, further)])}"
    if seen.others:
        yield f"further channels: {', '.join(grouped(seen.others))}"


def _sound(seen: ExamOverview) -> list[Row]:
    return [row for row in seen.trials if row["state"] == SOUND]


def _counts(rows: Iterable[Row]) -> tuple[int, int, int, int]:
    """Numbers of trials: all, empty, broken, and marked as errors by the task."""
    all_rows = list(rows)
    empty = sum(row["state"] == EMPTY for row in all_rows)
    broken = sum(row["state"] not in (SOUND, EMPTY) for row in all_rows)
    return len(all_rows), empty, broken, sum(row.get("is_error") is True for row in all_rows)


def _by(seen: ExamOverview, column: str, title: str) -> Table:
    """Table of the trials of each protocol or block."""
    groups: dict[object, list[Row]] = {}
    for row in seen.trials:
        groups.setdefault(row.get(column), []).append(row)
    numbered = sorted(groups.items(), key=lambda group: _order(group[0]))
    rows = []
    for number, members in numbered:
        sound = [row for row in members if row["state"] == SOUND]
        name = "?" if number is None else f"{number:>2}"
        if column == "protocol":
            name = f"{name}  {_short(seen.protocols.get(number, ''))}".rstrip()
            last = _directions(sound)
        else:
            last = _ranges(row.get("protocol") for row in members)
        rows.append([name, *map(str, _counts(members)), last])
    ending = "direction (deg)" if column == "protocol" else "protocols"
    head = [title.lower().removesuffix("s"), "trials", "empty", "broken", "errors", ending]
    return title, head, rows


def _order(number: object) -> float:
    return float(number) if isinstance(number, int | np.integer) else np.inf


def _conditions(seen: ExamOverview) -> Table:
    """Table of the conditions of the sound trials."""
    groups: dict[str, list[Row]] = {}
    for row in _sound(seen):
        groups.setdefault(str(row["condition"]), []).append(row)
    rows = [
        [
            _short(name),
            str(len(members)),
            _ranges(row["protocol"] for row in members),
            _directions(members),
        ]
        for name, members in sorted(groups.items(), key=lambda g: _order(g[1][0]["protocol"]))
    ]
    return "Conditions", ["condition", "trials", "protocols", "directions (deg)"], rows


def _directions(rows: Iterable[Row]) -> str:
    directions = sorted({v for row in rows if isinstance(v := row.get("direction_deg"), float)})
    shown = ", ".join(f"{v:g}" for v in directions[:8])
    return f"{shown}, … ({len(directions)})" if len(directions) > 8 else shown


def _ranges(values: Iterable[object]) -> str:
    """Integers as text, with ranges: ``1-8, 12``."""
    numbers = sorted({int(v) for v in values if isinstance(v, int | np.integer)})
    parts: list[list[int]] = []
    for number in numbers:
        if parts and number == parts[-1][-1] + 1:
            parts[-1].append(number)
        else:
            parts.append([number])
    return ", ".join(f"{p[0]}-{p[-1]}" if len(p) > 1 else f"{p[0]}" for p in parts)


def _event_times(rows: Iterable[Row]) -> dict[str, list[float]]:
    times: dict[str, list[float]] = {}
    for row in rows:
        for column, value in row.items():
            if column.startswith("event_") and isinstance(value, float):
                times.setdefault(_event(column), []).append(value)
    return times


def _event(column: str) -> str:
    return column.removeprefix("event_").removesuffix("_s")


def _events(seen: ExamOverview) -> Table:
    times = _event_times(seen.trials)
    rows = [[_short(n), str(len(t)), f"{min(t):g}", f"{max(t):g}"] for n, t in times.items()]
    never = [name for name in map(_event, seen.events) if name not in times]
    rows += [[_short(name), "0", "-", "-"] for name in dict.fromkeys(never)]
    return "Events", ["event", "trials", "earliest (s)", "latest (s)"], rows


def _inputs(seen: ExamOverview) -> Table:
    rows = [
        [i.label, str(i.trials), f"{i.low:.4g}", f"{i.high:.4g}", i.unit or "-"]
        for i in seen.inputs
    ]
    return "Inputs that may hold EMG", ["channel", "trials", "lowest", "highest", "unit"], rows


def _broken(seen: ExamOverview) -> Table:
    """Table of the reasons why trials are broken, the most common first, with an example file."""
    broken = [row for row in seen.trials if row["state"] not in (SOUND, EMPTY)]
    reasons = Counter(str(row["state"]) for row in broken)
    first = {str(row["state"]): str(row["file"]) for row in reversed(broken)}
    rows = [[_short(reason, 70), str(n), first[reason]] for reason, n in reasons.most_common(12)]
    return "Broken trials", ["what is wrong", "trials", "first"], rows


def _next(seen: ExamOverview, requested: Side | None) -> Iterator[str]:
    """Lines with a call of `convert` that works, and remarks on what it leaves open."""
    both = all(seen.force_trials.values())
    if not any(seen.force_trials.values()) or not _sound(seen):
        yield f"It cannot be converted: {seen.refusal or 'no trial is sound'}."
        return
    shown_path = f"./{seen.path}" if seen.path.startswith("-") else seen.path
    words = ["armimpedance", "convert", shown_path, "session"]
    side: str = seen.side or next(s for s, n in seen.force_trials.items() if n)
    if both or requested is not None:
        words += ["--side", side]
    if seen.whose_force is None:
        words += ["--force-by", "limb"]
    pair = _pair(_sound(seen))
    if pair is not None:
        words += ["--events", *pair]
    yield shlex.join(words)
    yield from _left_open(seen, both and requested is None, pair is None)


def _left_open(seen: ExamOverview, either_side: bool, no_pair: bool) -> Iterator[str]:
    """Yield remarks on what the proposed call does not specify."""
    if either_side:
        yield "Both arms were recorded: --side left is the other one."
    if seen.whose_force is None:
        yield (
            "Whose force the sensor holds must be known: --force-by limb where it is the hand's on "
            "the robot, --force-by device where it is the robot's on the hand."
        )
    if no_pair and _event_times(_sound(seen)):
        yield "--events ONSET END: two of the events, if the disturbance begins and ends there."
    if any(row.get("is_error") is True for row in _sound(seen)):
        yield "--without-errors leaves out what the task marked as errors."
    if seen.inputs:
        yield f"--emg {seen.inputs[0].label}=MUSCLE for each input that holds a muscle's EMG."


def _pair(rows: Sequence[Row]) -> tuple[str, str] | None:
    """The pair of events named as a disturbance's begin and end; None if there is not one pair."""
    times = _event_times(rows)
    pairs = []
    for name in times:
        match = _BEGINS.search(name.upper())
        if match is None or not _DISTURBANCE.search(name.upper()):
            continue
        ends = [name[: match.start()] + end + name[match.end() :] for end in _ENDS]
        by_name = {event.upper(): event for event in times}
        pairs += [(name, by_name[end.upper()]) for end in ends if end.upper() in by_name]
    if len(pairs) != 1 or not any(_follows(row, *pairs[0]) for row in rows):
        return None
    return pairs[0]


def _follows(row: Row, onset: str, end: str) -> bool:
    """True if a disturbance begins and ends within a trial."""
    first, last, lasting = (
        row.get(n) for n in (f"event_{onset}_s", f"event_{end}_s", "duration_s")
    )
    if not (isinstance(first, float) and isinstance(last, float) and isinstance(lasting, float)):
        return False
    return 0.0 <= first < last < lasting


def _short(text: str, width: int = _WIDEST) -> str:
    """Return a text, with its middle left out if it is too long: names differ at their ends."""
    half = width // 2
    return text if len(text) <= width else f"{text[: half - 1]}…{text[-half:]}"
