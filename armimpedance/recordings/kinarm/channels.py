"""Channels of Kinarm trials: kept channels, required channels, and checks of the trials."""

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

#: Channels that are kept as recorded, in addition to `ACHn`: motion of the side's robot.
KEPT_CHANNELS: Final = tuple(
    f"{link}{what}" for link in ("L1", "L2") for what in ("Ang", "Vel", "Acc")
) + ("M1TorCMD", "M2TorCMD", "FS_Status")

#: Channels for the check of the force's sign, in addition to the links' angles.
FRICTION: Final = ("M1TorFRC", "M2TorFRC")

_ANALOG_INPUT: Final = re.compile(r"ACH\d+")


def wanted_channels(muscles: Mapping[str, str]) -> Callable[[str], bool]:
    """Return a predicate of a channel's label: True if the channel is read."""
    names = (*KEPT_CHANNELS, *FRICTION, "FS_ForceX", "FS_ForceY")
    labels = {f"{side}_{name}" for side in ("Right", "Left") for name in names}
    labels |= {"StatusBits", *muscles}
    return lambda label: label in labels or _ANALOG_INPUT.fullmatch(label) is not None


def force_labels(side: Side) -> tuple[str, str]:
    """Labels of the force sensor's channels in the plane."""
    return f"{side.title()}_FS_ForceX", f"{side.title()}_FS_ForceY"


def link_labels(side: Side) -> tuple[str, str]:
    """Labels of the angles of the robot's two links."""
    return f"{side.title()}_L1Ang", f"{side.title()}_L2Ang"


def sound_trials(
    trials: Sequence[ExamTrial], side: Side, muscles: Mapping[str, str]
) -> tuple[list[ExamTrial], list[LeftOut]]:
    """Separate valid trials from those that are left out, with the reasons.

    The exam's rate is the most common rate. A trial must have the force and the muscles' inputs,
    and the links' angles and the hand if most trials have them; all must be finite.

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
            # two trials with the same number are both kept, and renumbered later
            sound[key if key not in sound else (*key, trial.name)] = trial
    return list(sound.values()), left_out


def _usual(trials: Sequence[ExamTrial], labels: Sequence[str]) -> tuple[str, ...]:
    """Labels that more than half of the trials have."""
    labels_of = [{*trial.file.channels, *trial.file.hands} for trial in trials]
    return tuple(n for n in labels if 2 * sum(n in names for names in labels_of) > len(labels_of))


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
    """Refuse positions and angles (F, ...) that no arm reaches, as in a damaged file."""
    size = np.abs(values).reshape(len(values), -1).max(axis=1)
    if size.max() > largest:
        row = int(np.argmax(size > largest))
        problem = f"{size[row]:.3g} {unit} is out of reach"
        expected = f"at most {largest:g}"
        raise InputError(problem, file=file.name, row=row + 1, column=label, expected=expected)


def _refuse_copy(trial: ExamTrial, earlier: ExamTrial | None) -> None:
    """Refuse a trial with the same samples as an earlier trial of the same set and number."""
    if earlier is None or trial.file.parameters.number("TRIAL", "TRIAL_NUM") is None:
        return
    if trial.file.same_samples(earlier.file):
        problem = f"number and samples of {earlier.name} once more"
        raise InputError(problem, file=trial.file.name, expected="every trial once")


def channel(file: ExamFile, label: str) -> FloatArray:
    """Return one analog channel, (F,).

    Raises InputError: the file has no such channel, or a value is not finite.
    """
    if label not in file.channels:
        available = ", ".join([*file.channels, *file.others][:8])
        raise InputError(
            "no such channel", file=file.name, column=label, expected=f"it: {available}, …"
        )
    values = file.samples(label)
    check_finite(file, label, values)
    return values


def channels(files: Sequence[ExamFile], *labels: str) -> FloatArray:
    """Return analog channels of all trials, one after another, (N, len(labels))."""
    parts = (np.column_stack([channel(file, label) for label in labels]) for file in files)
    return joined([file.frames for file in files], parts, len(labels))


def check_finite(file: ExamFile, label: str, values: FloatArray) -> None:
    """Refuse values (F,) or (F, d) that are not all finite; the error names the first row."""
    broken = ~np.isfinite(values)
    if broken.any():
        row = int(np.argmax(broken.reshape(len(values), -1).any(axis=1))) + 1
        raise InputError(
            "not finite", file=file.name, row=row, column=label, expected="a finite number"
        )


def further_channels(
    files: list[ExamFile], side: Side, muscles: Mapping[str, str]
) -> tuple[dict[str, FloatArray], list[str]]:
    """Channels that are kept as recorded (not mirrored), and remarks on those left out.

    An input that is zero in all trials is unused, and left out without a remark.

    `files`: the channels are removed from it as they are read: a long exam is never in memory
    twice.
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
    """Reason why a channel of these files cannot be kept; "" if it can."""
    if len(holders) < trials:
        return f"not in {trials - len(holders)} trials"
    broken = sum(not np.isfinite(file.samples(label)).all() for file in holders)
    return f"not finite in {broken} trials" if broken else ""


def _kept(side: Side) -> set[str]:
    """Labels of the channels that are kept as recorded, in addition to `ACHn`."""
    return {*(f"{side.title()}_{name}" for name in KEPT_CHANNELS), "StatusBits"}


# Sentences on the channels of a Kinarm exam that its recording leaves out.


def labels_there(files: Sequence[ExamFile]) -> set[str]:
    """Labels of all channels and hands, except those that were read and are all zero."""
    labels = {label for file in files for label in file.others}
    for file in files:
        samples = {**file.channels, **file.hands}
        labels |= {label for label in samples.keys() - labels if anything(samples[label])}
    return labels


def channels_not_taken(there: set[str], side: Side, taken: Collection[str]) -> tuple[str, ...]:
    """Sentences of the provenance on the exam's channels that are not in the recording.

    `there`: labels of all channels.
    `side`: the arm of the recording.
    `taken`: labels in the recording, in addition to the force and the hand.
    """
    unused = there - {*taken, *force_labels(side), f"{side.title()}_Hand"}
    other_side = "Left_" if side == "right" else "Right_"
    of_other = {label for label in unused if label.startswith(other_side)}
    return (
        *not_taken(grouped(unused - of_other), "the recording has no use for these channels"),
        *not_taken(grouped(of_other), "the other arm's"),
    )


def grouped(labels: Iterable[str]) -> list[str]:
    """Join labels that differ only at their end: `FS_TorqueX/Y/Z`, `ACH1/2/3`."""
    ends: dict[str, list[str]] = {}
    for label in sorted(labels, key=_in_order):
        match = re.fullmatch(r"(.*[a-z_])([U-Z])|(.*?\D)(\d+)", label)
        stem, end = [part for part in match.groups() if part] if match else (label, "")
        ends.setdefault(stem, []).append(end)
    return [stem + "/".join(endings) for stem, endings in ends.items()]


def _in_order(label: str) -> tuple[str, int]:
    """Sort key of labels: ACH9 before ACH10."""
    match = re.fullmatch(r"(.*?)(\d{1,9})", label)
    return (match[1], int(match[2])) if match else (label, -1)
