"""A look at a Kinarm exam as the experimenter thinks of it, whether or not it can be converted.

Of each trial only the range of its channels is kept, and of a few trials, spread over the exam, the
samples: an exam of any length is looked at in the memory of a few minutes.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from armimpedance.core.errors import InputError
from armimpedance.core.inputs import unchanged
from armimpedance.recordings.kinarm.channels import force_labels, sound_trials, wanted_channels
from armimpedance.recordings.kinarm.exam_file import ExamFile, Samples
from armimpedance.recordings.kinarm.files import Exam, ExamTrial, LeftOut, read_exam
from armimpedance.recordings.kinarm.force_balance import force_balance
from armimpedance.recordings.kinarm.hand import hand_position
from armimpedance.recordings.kinarm.robot import SIDES, Side, choose_side, robot_of, with_own_names
from armimpedance.recordings.kinarm.tables import protocol_of, protocol_row
from armimpedance.recordings.kinarm.trials import event_column, in_words, trial_table

#: Samples of whole trials that are kept to find whose force the sensor holds: 2 min at 1 kHz.
KEPT_SAMPLES: Final = 120_000

#: Labels of channels that may hold EMG.
_INPUT: Final = re.compile(r"ACH\d+|.*(EMG|MUSCLE).*", re.IGNORECASE)

#: What is the matter with a trial: nothing, no samples, or why it cannot be used.
SOUND, EMPTY = "sound", "empty"


@dataclass(frozen=True)
class Input:
    """A channel that may hold EMG: in how many trials it moves, its range, its unit."""

    label: str
    trials: int
    low: float
    high: float
    unit: str


@dataclass(frozen=True)
class ExamOverview:
    """What an exam holds.

    `trials`: one per trial as columns of a table: `trial`, `file`, `state` ("sound", "empty", or
    what is broken), `samples`, `duration_s`, and what `convert` would make the trial table of.
    `protocols`: row of the trial protocols -> its name, else its targets and load in words.
    `robots`: side -> version and kind of the robot; sides without one are not there.
    `force_trials`: side -> in how many trials a force sensor shows anything.
    `side`: the arm that would be converted; None: it must be told, or none can be.
    `refusal`: why no arm can be chosen; "" where one can.
    `whose_force`: "limb" or "device" as the robot's dynamics show; None: they do not.
    `events`: columns of the events that the exam defines, also of those that occurred in no trial.
    `others`: labels of the channels that were not looked at.
    """

    path: str
    trials: tuple[Mapping[str, object], ...]
    protocols: Mapping[object, str]
    rates_hz: tuple[float, ...]
    robots: Mapping[Side, str]
    force_trials: Mapping[Side, int]
    side: Side | None
    refusal: str
    whose_force: str | None
    evidence: str
    events: tuple[str, ...]
    inputs: tuple[Input, ...]
    others: tuple[str, ...]
    remarks: tuple[str, ...]


@dataclass
class _Spread:
    """Whole trials, spread over an exam of unknown length; where they are too many, each second."""

    files: list[ExamFile] = field(default_factory=list)
    step: int = 1
    seen: int = 0

    def keep(self, file: ExamFile) -> ExamFile:
        """Remember a trial, or not; what an overview needs of it."""
        if self.seen % self.step == 0:
            self.files.append(_own(file))
        self.seen += 1
        while sum(kept.frames for kept in self.files) > KEPT_SAMPLES and len(self.files) > 1:
            self.files, self.step = self.files[::2], 2 * self.step
        return _ranges(file)


def overview_of(path: str | os.PathLike[str], side: Side | None = None) -> ExamOverview:
    """What a Kinarm exam holds, as its experimenter thinks of it.

    `path`: an exam in any form that is read; it need not have a force sensor.
    `side`: the arm that is looked at, where both were recorded.
    Raises InputError: there is no exam at `path`, or no trial of it can be read.
    """
    known, spread = wanted_channels({}), _Spread()
    with unchanged(path):
        whole = read_exam(path, lambda n: known(n) or _INPUT.fullmatch(n) is not None, spread.keep)
    exam, renamed = with_own_names(whole)
    chosen, refusal = _chosen_side(exam, side, path)
    shown = chosen or side or _first_side(exam)
    with_force = {s: sum(_has_force(t.file, s) for t in exam.trials) for s in SIDES}
    rows, remarks = _rows(exam, shown, judged=with_force[shown] > 0)
    full = tuple(ExamTrial("", file, 1, 1, 1) for file in spread.files)
    whose, evidence = _whose_force(with_own_names(replace(exam, trials=full))[0], shown)
    return ExamOverview(
        path=os.fspath(path),
        trials=tuple(rows),
        protocols=_protocols(exam, shown),
        rates_hz=tuple(sorted({trial.file.rate_hz for trial in exam.trials})),
        robots={s: told for s in SIDES if (told := _robot(exam.common, s))},
        force_trials=with_force,
        side=chosen,
        refusal=refusal,
        whose_force=whose,
        evidence=evidence,
        events=tuple(map(event_column, _defined_events(exam))),
        inputs=tuple(_inputs(exam)),
        others=tuple(dict.fromkeys(n for t in exam.trials for n in t.file.others)),
        remarks=(*renamed, *remarks),
    )


def _own(file: ExamFile) -> ExamFile:
    """The same file with samples of its own: those of an exam share rooms, which it would hold."""

    def copied(samples: Mapping[str, Samples]) -> dict[str, Samples]:
        return {n: v.copy() if v.any() else v for n, v in samples.items()}

    # a damaged sample may be a signalling NaN
    with np.errstate(invalid="ignore"):
        return replace(file, channels=copied(file.channels), hands=copied(file.hands))


def _ranges(file: ExamFile) -> ExamFile:
    """The same file with the lowest and the highest sample of each channel only."""
    if not file.frames:
        return file
    channels = {n: np.array([v.min(), v.max()], v.dtype) for n, v in file.channels.items()}
    hands = {n: np.array([v.min(axis=0), v.max(axis=0)], v.dtype) for n, v in file.hands.items()}
    return replace(file, channels=channels, hands=hands)


def _chosen_side(exam: Exam, asked: Side | None, path: object) -> tuple[Side | None, str]:
    try:
        return choose_side(exam, asked, path), ""
    except InputError as error:
        return None, error.problem


def _first_side(exam: Exam) -> Side:
    """The side that is shown where none can be chosen: that of a robot that is there."""
    there = [
        s
        for s in SIDES
        if exam.common.parameters.number(f"{s.upper()}_KINARM", "IS_PRESENT") != 0.0
    ]
    moving = [s for s in there if any(_moves(trial.file, s) for trial in exam.trials)]
    return (moving or there or list(SIDES))[0]


def _moves(file: ExamFile, side: Side) -> bool:
    hand = file.hands.get(f"{side.title()}_Hand")
    return hand is not None and bool(hand.any())


def _has_force(file: ExamFile, side: Side) -> bool:
    return any(n in file.channels and file.channels[n].any() for n in force_labels(side))


def _robot(common: ExamFile, side: Side) -> str:
    """Version and kind of a side's robot; "" where there is none."""
    group = f"{side.upper()}_KINARM"
    if (
        group not in common.parameters.groups
        or common.parameters.number(group, "IS_PRESENT") == 0.0
    ):
        return ""
    robot = robot_of(common, side)
    return f"{robot.version} ({robot.kind})"


def _rows(exam: Exam, side: Side, *, judged: bool) -> tuple[list[dict[str, object]], list[str]]:
    """Every trial as a row, in the order they were run, those that cannot be used at the end.

    Trials are judged as `convert` does it, where there is a force at all.
    """
    sound, broken = sound_trials(exam.trials, side, {}) if judged else (list(exam.trials), [])
    why = {left.name: _reason(left) for left in broken}
    # Two trials of one name would be two files of one name; then both are as the first one is.
    apart = [trial for trial in exam.trials if trial.name in why]
    rows, remarks = [], []
    for trials in filter(None, (sound, apart)):
        table, told = trial_table(trials, exam.common, side, keep_personal=False)
        remarks += told if trials is sound else []
        for row in table.drop(columns="direction_from", errors="ignore").to_dict("records"):
            trial = trials[int(row.pop("file_index"))]
            rows.append(_row(trial, {str(k): v for k, v in row.items()}, why.get(trial.name)))
    for left in sorted(exam.left_out, key=lambda each: each.name):
        rows.append(_empty_row(left))
    return rows, remarks


def _protocols(exam: Exam, side: Side) -> dict[object, str]:
    """What the tables say of each protocol, in words."""
    words: dict[object, str] = {}
    for trial in exam.trials:
        if protocol_row(trial) not in words:
            protocol = protocol_of(trial, exam.common, side)
            words[protocol.row] = in_words(protocol)
    return words


def _row(trial: ExamTrial, row: dict[str, object], broken: str | None) -> dict[str, object]:
    file = trial.file
    first = {
        "trial": row.pop("trial"),
        "file": trial.name,
        "state": broken or SOUND,
        "samples": file.frames,
        "duration_s": file.frames / file.rate_hz,
    }
    return first | {name: _plain_value(value) for name, value in row.items()}


def _plain_value(value: object) -> object:
    """A cell as a table holds it: nothing where there is no number."""
    return None if isinstance(value, float) and not np.isfinite(value) else value


def _empty_row(left: LeftOut) -> dict[str, object]:
    """A trial of which nothing but its file's name is known."""
    row: dict[str, object] = {"trial": None, "file": left.name, "state": _reason(left)}
    if left.error is None:
        row["samples"] = 0
    numbers = re.match(r"(\d{1,9})_(\d{1,9})_(\d{1,9})(\D|$)", left.name)
    if numbers is not None:
        row["set"], row["protocol"], row["repetition"] = (int(n) for n in numbers.groups()[:3])
    return row


def _reason(left: LeftOut) -> str:
    """What is wrong with a trial; the sample is not known, of which the range was kept only."""
    error = left.error
    if error is None:
        return EMPTY
    return f"{error.column}: {error.problem}" if error.column else error.problem


def _whose_force(exam: Exam, side: Side) -> tuple[str | None, str]:
    """Whose force the sensor of a side holds, by the trials that were kept whole."""
    try:
        sound = sound_trials(exam.trials, side, {})[0]
        files = [trial.file for trial in sound]
        if not files:
            return None, "no trial with a force was looked at"
        robot = hand_position(files, robot_of(exam.common, side)).robot
        balance = force_balance(files, exam.common, robot)
    except InputError as error:
        return None, error.problem
    return balance.force_by, balance.evidence


def _defined_events(exam: Exam) -> tuple[str, ...]:
    files = (exam.common, *(trial.file for trial in exam.trials))
    each = (file.parameters.texts("EVENT_DEFINITIONS", "LABELS") for file in files)
    return tuple(filter(None, next(filter(None, each), ())))


def _inputs(exam: Exam) -> list[Input]:
    """The channels that may hold EMG: inputs that are not the same number throughout."""
    ranges: dict[str, list[np.ndarray]] = {}
    units: dict[str, str] = {}
    for trial in exam.trials:
        file = trial.file
        for label, values in file.channels.items():
            if _INPUT.fullmatch(label):
                ranges.setdefault(label, []).append(values.astype(np.float64))
        units |= _units(file) if not units else {}
    found = []
    for label, each in ranges.items():
        low, high = np.array(each).T
        moving = int(np.sum(low != high))
        if moving:
            finite = np.isfinite(low) & np.isfinite(high)
            lowest, highest = low[finite].min(initial=np.inf), high[finite].max(initial=-np.inf)
            found.append(Input(label, moving, lowest, highest, units.get(label, "")))
    return found


def _units(file: ExamFile) -> dict[str, str]:
    labels: Sequence[str] = file.parameters.texts("ANALOG", "LABELS")
    return dict(zip(labels, file.parameters.texts("ANALOG", "UNITS"), strict=False))
