"""The channels of Kinarm trials: which are kept, which must be there, which trials are sound."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Collection, Container, Iterable, Mapping, Sequence
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray, frozen
from armimpedance.core.conventions import LARGEST_ANGLE_RAD
from armimpedance.core.errors import InputError
from armimpedance.core.findings import not_taken
from armimpedance.recordings.kinarm.exam_file import ExamFile, anything, joined
from armimpedance.recordings.kinarm.files import ExamTrial, LeftOut
from armimpedance.recordings.kinarm.robot import Side
from armimpedance.recordings.tables.metadata import LARGEST_COORDINATE_M

#: Channels that are kept as they were recorded, beside `ACHn`: the side's robot as it moved.
KEPT_CHANNELS: Final = tuple(
    f"{link}{what}" for link in ("L1", "L2") for what in ("Ang", "Vel", "Acc")
) + ("M1TorCMD", "M2TorCMD", "FS_Status")

#: What is needed to hold the force against the robot, beside its links' angles.
FRICTION: Final = ("M1TorFRC", "M2TorFRC")

_ANALOG_INPUT: Final = re.compile(r"ACH\d+")


def wanted_channels(muscles: Mapping[str, str]) -> Callable[[str], bool]:
    """Whether a channel of an exam is read at all, by its label."""
    names = (*KEPT_CHANNELS, *FRICTION, "FS_ForceX", "FS_ForceY")
    known = {f"{side}_{name}" for side in ("Right", "Left") for name in names}
    known |= {"StatusBits", *muscles}
    return lambda label: label in known or _ANALOG_INPUT.fullmatch(label) is not None


def force_labels(side: Side) -> tuple[str, str]:
    """The force sensor's channels in the plane."""
    return f"{side.title()}_FS_ForceX", f"{side.title()}_FS_ForceY"


def link_labels(side: Side) -> tuple[str, str]:
    """The angles of the robot's two links."""
    return f"{side.title()}_L1Ang", f"{side.title()}_L2Ang"


def sound_trials(
    trials: Sequence[ExamTrial], side: Side, muscles: Mapping[str, str]
) -> tuple[list[ExamTrial], list[LeftOut]]:
    """The trials that are as the exam's others, and those that are not, with what is wrong.

    The exam's rate is the commonest one; a trial must have the force, the muscles' inputs, and the
    links' angles and the hand where most trials have them, all of them finite.

    `muscles`: analog input -> muscle.
    """
    rate_hz = Counter(trial.file.rate_hz for trial in trials).most_common(1)[0][0]
    hand = f"{side.title()}_Hand"
    labels = (*force_labels(side), *muscles, *_usual(trials, link_labels(side)))
    points = [hand] if _usual(trials, (hand,)) else []
    sound: dict[tuple[object, ...], ExamTrial] = {}
    left_out = []
    for trial in trials:
        key: tuple[object, ...] = (trial.block, trial.file.parameters.number("TRIAL", "TRIAL_NUM"))
        try:
            _check_trial(trial.file, rate_hz, labels, points, side)
            _refuse_copy(trial, sound.get(key))
        except InputError as error:
            left_out.append(LeftOut(trial.name, error))
        else:
            # Two trials of one number are both kept: they are counted through.
            sound[key if key not in sound else (*key, trial.name)] = trial
    return list(sound.values()), left_out


def _usual(trials: Sequence[ExamTrial], labels: Sequence[str]) -> tuple[str, ...]:
    """Those of the labels that more than half of the trials have."""
    there = [{*trial.file.channels, *trial.file.hands} for trial in trials]
    return tuple(n for n in labels if 2 * sum(n in names for names in there) > len(there))


def _check_trial(
    file: ExamFile, rate_hz: float, labels: Sequence[str], points: Sequence[str], side: Side
) -> None:
    if file.rate_hz != rate_hz:
        expected = f"{rate_hz:g}, as in the others"
        raise InputError(f"{file.rate_hz:g} samples/s", file=file.name, expected=expected)
    for label in labels:
        channel(file, label)
    for label in points:
        if label not in file.hands:
            raise InputError("no such point", file=file.name, column=label, expected="the hand")
        hand = file.place(label)
        check_finite(file, label, hand)
        _check_size(file, label, hand, LARGEST_COORDINATE_M, "m")
    for label in link_labels(side):
        if label in labels:
            _check_size(file, label, channel(file, label), 2 * LARGEST_ANGLE_RAD, "rad")
    if not any(channel(file, name).any() for name in force_labels(side)):
        raise InputError(
            "the force is zero throughout, as of an absent sensor",
            file=file.name,
            column=force_labels(side)[0],
            expected="a measured force",
        )


def _check_size(file: ExamFile, label: str, values: FloatArray, largest: float, unit: str) -> None:
    """Refuse places and angles, (F, ...), that no arm reaches, as of a damaged file."""
    size = np.abs(values).reshape(len(values), -1).max(axis=1)
    if size.max() > largest:
        row = int(np.argmax(size > largest))
        problem = f"{size[row]:.3g} {unit} is out of reach"
        expected = f"at most {largest:g}"
        raise InputError(problem, file=file.name, row=row + 1, column=label, expected=expected)


def _refuse_copy(trial: ExamTrial, earlier: ExamTrial | None) -> None:
    """Refuse a trial that holds the same samples as another of its set and number."""
    if earlier is None or trial.file.parameters.number("TRIAL", "TRIAL_NUM") is None:
        return
    if trial.file.same_samples(earlier.file):
        problem = f"number and samples of {earlier.name} once more"
        raise InputError(problem, file=trial.file.name, expected="every trial once")


def channel(file: ExamFile, label: str) -> FloatArray:
    """One analog channel, (F,).

    Raises InputError: the file has no such channel, or it is not finite throughout.
    """
    if label not in file.channels:
        there = ", ".join([*file.channels, *file.others][:8])
        raise InputError(
            "no such channel", file=file.name, column=label, expected=f"it: {there}, …"
        )
    values = file.samples(label)
    check_finite(file, label, values)
    return values


def channels(files: Sequence[ExamFile], *labels: str) -> FloatArray:
    """Analog channels of all trials one after another, (N, len(labels))."""
    parts = (np.column_stack([channel(file, label) for label in labels]) for file in files)
    return joined([file.frames for file in files], parts, len(labels))


def check_finite(file: ExamFile, label: str, values: FloatArray) -> None:
    """Refuse values, (F,) or (F, d), that are not finite throughout; the first row is named."""
    broken = ~np.isfinite(values)
    if broken.any():
        row = int(np.argmax(broken.reshape(len(values), -1).any(axis=1))) + 1
        raise InputError(
            "not finite", file=file.name, row=row, column=label, expected="a finite number"
        )


def further_channels(
    files: list[ExamFile], side: Side, muscles: Mapping[str, str]
) -> tuple[dict[str, FloatArray], list[str]]:
    """Channels kept as recorded, neither mirrored nor turned, and a remark on each that is not.

    An input that is zero in all trials is nobody's, and left out without a word.

    `files`: each channel is let go of, in place, when it is taken: a long exam is not held twice.
    `muscles`: analog input -> muscle.
    """
    kept, remarks = {}, []
    labels = dict.fromkeys(label for file in files for label in file.channels)
    further = [n for n in labels if n in _kept(side) or _ANALOG_INPUT.fullmatch(n)]
    further = [n for n in further if n not in muscles]
    _let_go(files, labels.keys() - set(further))
    for label in further:
        holders = [file for file in files if label in file.channels]
        if any(anything(file.samples(label)) for file in holders):
            problem = _problem(holders, label, len(files))
            if problem:
                remarks.append(f"Channel {label} left out: {problem}.")
            else:
                frames = [file.frames for file in files]
                kept[label] = frozen(joined(frames, (file.samples(label) for file in files)))
        del holders
        _let_go(files, {label})
    return kept, remarks


def _let_go(files: list[ExamFile], labels: Container[str]) -> None:
    files[:] = [file.without(labels) for file in files]


def _problem(holders: Sequence[ExamFile], label: str, trials: int) -> str:
    """Why a channel of these files cannot be kept; "" where it can."""
    if len(holders) < trials:
        return f"not in {trials - len(holders)} trials"
    broken = sum(not np.isfinite(file.samples(label)).all() for file in holders)
    return f"not finite in {broken} trials" if broken else ""


def _kept(side: Side) -> set[str]:
    """Labels of the channels that are kept as they were recorded, beside `ACHn`."""
    return {*(f"{side.title()}_{name}" for name in KEPT_CHANNELS), "StatusBits"}


# The channels of a Kinarm exam that a recording of it does not take, in a few words.


def labels_there(files: Sequence[ExamFile]) -> set[str]:
    """Labels of all channels and hands; those that were read and are zero are nobody's."""
    there = {label for file in files for label in file.others}
    for file in files:
        read = {**file.channels, **file.hands}
        there |= {label for label in read.keys() - there if anything(read[label])}
    return there


def channels_not_taken(there: set[str], side: Side, taken: Collection[str]) -> tuple[str, ...]:
    """Sentences of the provenance on the channels that are there and not in the recording.

    `side`: the arm of the recording.
    `taken`: labels that are in the recording, beside the force and the hand.
    """
    left = there - {*taken, *force_labels(side), f"{side.title()}_Hand"}
    other = "Left_" if side == "right" else "Right_"
    of_other = {label for label in left if label.startswith(other)}
    return (
        *not_taken(grouped(left - of_other), "the recording has no use for these channels"),
        *not_taken(grouped(of_other), "the other arm's"),
    )


def grouped(labels: Iterable[str]) -> list[str]:
    """Labels that differ at their end only, together: `FS_TorqueX/Y/Z`, `ACH1/2/3`."""
    ends: dict[str, list[str]] = {}
    for label in sorted(labels, key=_in_order):
        match = re.fullmatch(r"(.*[a-z_])([U-Z])|(.*?\D)(\d+)", label)
        stem, end = [part for part in match.groups() if part] if match else (label, "")
        ends.setdefault(stem, []).append(end)
    return [stem + "/".join(each) for stem, each in ends.items()]


def _in_order(label: str) -> tuple[str, int]:
    """What labels are sorted by: ACH9 before ACH10."""
    match = re.fullmatch(r"(.*?)(\d{1,9})", label)
    return (match[1], int(match[2])) if match else (label, -1)
