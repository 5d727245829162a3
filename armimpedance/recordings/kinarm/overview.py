"""Overview of a Kinarm exam in the experimenter's terms, whether or not it can be converted.

Only the ranges of channels are kept of each trial, and the samples of a few trials spread over the
exam: an exam of any length needs the memory of a few minutes.
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

#: Samples of whole trials that are kept to determine the force's sign: 2 min at 1 kHz.
KEPT_SAMPLES: Final = 120_000

#: Labels of channels that may hold EMG.
_INPUT: Final = re.compile(r"ACH\d+|.*(EMG|MUSCLE).*", re.IGNORECASE)

#: States of a trial; any other text is the reason why it cannot be used.
SOUND, EMPTY = "sound", "empty"


@dataclass(frozen=True)
class Input:
    """A channel that may hold EMG: number of trials in which it changes, range, unit."""

    label: str
    trials: int
    low: float
    high: float
    unit: str


@dataclass(frozen=True)
class ExamOverview:
    """Contents of an exam.

    `trials`: one mapping per trial, as a row of a table: `trial`, `file`, `state` ("sound",
    "empty", or the fault), `samples`, `duration_s`, and the columns of `convert`'s trial table.
    `protocols`: row of the trial protocols -> its name, else its targets and load in words.
    `robots`: side -> version and kind of the robot, for the sides that have one.
    `force_trials`: side -> number of trials with a force that is not zero.
    `side`: the arm that would be converted; None: it must be stated, or no arm can be converted.
    `refusal`: why no arm can be chosen; "" if one can.
    `whose_force`: "limb" or "device" from the robot's dynamics; None: undetermined.
    `events`: columns of the events that the exam defines, also of those that occurred in no trial.
    `others`: labels of the channels that were not read.
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
    """Whole trials, spread over an exam of unknown length; if there are too many, every second."""

    files: list[ExamFile] = field(default_factory=list)
    step: int = 1
    seen: int = 0

    def keep(self, file: ExamFile) -> ExamFile:
        """Keep a copy of the trial if it is its turn; return only the ranges of its channels."""
        if self.seen % self.step == 0:
            self.files.append(_own(file))
        self.seen += 1
        while sum(kept.frames for kept in self.files) > KEPT_SAMPLES and len(self.files) > 1:
            self.files, self.step = self.files[::2], 2 * self.step
        return _ranges(file)


def overview_of(path: str | os.PathLike[str], side: Side | None = None) -> ExamOverview:
    """Summarise the contents of a Kinarm exam in the experimenter's terms.

    `path`: an exam in any form that can be read; it need not have a force sensor.
    `side`: the arm to summarise, if both were recorded.
    Raises InputError: there is no exam at `path`, or no trial of it can be read.
    """
    is_wanted, spread = wanted_channels({}), _Spread()
    with unchanged(path):
        whole = read_exam(
            path, lambda n: is_wanted(n) or _INPUT.fullmatch(n) is not None, spread.keep
        )
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
        robots={s: description for s in SIDES if (description := _robot(exam.common, s))},
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
    """Copy a file's samples, since those of an exam share blocks of memory."""

    def copied(samples: Mapping[str, Samples]) -> dict[str, Samples]:
        return {n: v.copy() if v.any() else v for n, v in samples.items()}

    # a damaged sample may be a signalling NaN
    with np.errstate(invalid="ignore"):
        return replace(file, channels=copied(file.channels), hands=copied(file.hands))


def _ranges(file: ExamFile) -> ExamFile:
    """Reduce a file to the lowest and the highest sample of each channel."""
    if not file.frames:
        return file
    channels = {n: np.array([v.min(), v.max()], v.dtype) for n, v in file.channels.items()}
    hands = {n: np.array([v.min(axis=0), v.max(axis=0)], v.dtype) for n, v in file.hands.items()}
    return replace(file, channels=channels, hands=hands)


def _chosen_side(exam: Exam, requested: Side | None, path: object) -> tuple[Side | None, str]:
    try:
        return choose_side(exam, requested, path), ""
    except InputError as error:
        return None, error.problem


def _first_side(exam: Exam) -> Side:
    """Side to show if none can be chosen: of a present robot, preferably one that moves."""
    present = [
        s
        for s in SIDES
        if exam.common.parameters.number(f"{s.upper()}_KINARM", "IS_PRESENT") != 0.0
    ]
    moving = [s for s in present if any(_moves(trial.file, s) for trial in exam.trials)]
    return (moving or present or list(SIDES))[0]


def _moves(file: ExamFile, side: Side) -> bool:
    hand = file.hands.get(f"{side.title()}_Hand")
    return hand is not None and bool(hand.any())


def _has_force(file: ExamFile, side: Side) -> bool:
    return any(n in file.channels and file.channels[n].any() for n in force_labels(side))


def _robot(common: ExamFile, side: Side) -> str:
    """Version and kind of a side's robot; "" if there is none."""
    group = f"{side.upper()}_KINARM"
    if (
        group not in common.parameters.groups
        or common.parameters.number(group, "IS_PRESENT") == 0.0
    ):
        return ""
    robot = robot_of(common, side)
    return f"{robot.version} ({robot.kind})"


def _rows(exam: Exam, side: Side, *, judged: bool) -> tuple[list[dict[str, object]], list[str]]:
    """One row per trial in the order they were run, unusable trials at the end.

    Trials are checked as by `convert`, if there is any force.
    """
    sound, broken = sound_trials(exam.trials, side, {}) if judged else (list(exam.trials), [])
    reasons = {trial_out.name: _reason(trial_out) for trial_out in broken}
    # two trials with the same name would be two files of the same name: both get the first's state
    unusable = [trial for trial in exam.trials if trial.name in reasons]
    rows, remarks = [], []
    for trials in filter(None, (sound, unusable)):
        table, notes = trial_table(trials, exam.common, side, keep_personal=False)
        remarks += notes if trials is sound else []
        for row in table.drop(columns="direction_from", errors="ignore").to_dict("records"):
            trial = trials[int(row.pop("file_index"))]
            rows.append(_row(trial, {str(k): v for k, v in row.items()}, reasons.get(trial.name)))
    for trial_out in sorted(exam.left_out, key=lambda missing: missing.name):
        rows.append(_empty_row(trial_out))
    return rows, remarks


def _protocols(exam: Exam, side: Side) -> dict[object, str]:
    """Name or description of each protocol, by its row."""
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
    """Return a cell for a table: None for a number that is not finite."""
    return None if isinstance(value, float) and not np.isfinite(value) else value


def _empty_row(left_out: LeftOut) -> dict[str, object]:
    """Row of a trial of which only the file's name is known."""
    row: dict[str, object] = {"trial": None, "file": left_out.name, "state": _reason(left_out)}
    if left_out.error is None:
        row["samples"] = 0
    numbers = re.match(r"(\d{1,9})_(\d{1,9})_(\d{1,9})(\D|$)", left_out.name)
    if numbers is not None:
        row["set"], row["protocol"], row["repetition"] = (int(n) for n in numbers.groups()[:3])
    return row


def _reason(left_out: LeftOut) -> str:
    """Fault of a trial, without a row, since only the range of its samples was kept."""
    error = left_out.error
    if error is None:
        return EMPTY
    return f"{error.column}: {error.problem}" if error.column else error.problem


def _whose_force(exam: Exam, side: Side) -> tuple[str | None, str]:
    """Determine whose force the sensor of a side holds, from the trials that were kept whole."""
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
    labels = (file.parameters.texts("EVENT_DEFINITIONS", "LABELS") for file in files)
    return tuple(filter(None, next(filter(None, labels), ())))


def _inputs(exam: Exam) -> list[Input]:
    """Channels that may hold EMG: inputs that are not constant."""
    ranges: dict[str, list[np.ndarray]] = {}
    units: dict[str, str] = {}
    for trial in exam.trials:
        file = trial.file
        for label, values in file.channels.items():
            if _INPUT.fullmatch(label):
                ranges.setdefault(label, []).append(values.astype(np.float64))
        units |= _units(file) if not units else {}
    inputs = []
    for label, extremes in ranges.items():
        low, high = np.array(extremes).T
        moving = int(np.sum(low != high))
        if moving:
            finite = np.isfinite(low) & np.isfinite(high)
            lowest, highest = low[finite].min(initial=np.inf), high[finite].max(initial=-np.inf)
            inputs.append(Input(label, moving, lowest, highest, units.get(label, "")))
    return inputs


def _units(file: ExamFile) -> dict[str, str]:
    labels: Sequence[str] = file.parameters.texts("ANALOG", "LABELS")
    return dict(zip(labels, file.parameters.texts("ANALOG", "UNITS"), strict=False))
