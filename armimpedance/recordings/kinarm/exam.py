"""Kinarm exams (Dexterit-E, C3D) as recordings of the hand."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final, Literal

import numpy as np
import pandas as pd

from armimpedance.arrays import FloatArray
from armimpedance.errors import InputError
from armimpedance.recordings.c3d_file import C3DFile, muscles_of
from armimpedance.recordings.kinarm.files import Exam, read_exam, refuse_new_format
from armimpedance.recordings.kinarm.robot import Robot, Side, choose_side, robot_of
from armimpedance.recordings.kinarm.trials import set_onsets, trial_table, used_trials
from armimpedance.records import Recording, Subject

#: The hand as recorded and as its links put it agree within 0.001 mm in a real exam.
HAND_TOLERANCE_M: Final = 1e-4

#: Channels that are kept as they were recorded, beside `ACHn`: the side's robot as it moved.
KEPT_CHANNELS: Final = tuple(
    f"{link}{what}" for link in ("L1", "L2") for what in ("Ang", "Vel", "Acc")
) + ("M1TorCMD", "M2TorCMD")


def read_kinarm(
    path: str | os.PathLike[str],
    *,
    force_by: Literal["limb", "device"],
    side: Side | None = None,
    onset_event: str | None = None,
    end_event: str | None = None,
    emg_channels: Mapping[str, str] | None = None,
    keep_personal: bool = False,
) -> Recording:
    """Read an exam of C3D files as Dexterit-E writes them.

    The hand's position follows from the link angles where the links' lengths are known (the
    encoders are what differentiates best) and agree with the recorded hand; else it is the
    recorded hand. A left arm is mirrored (x to -x, angles a to pi - a), so that the conventions of
    a right arm hold. An exoskeleton's links lie along the arm: they give joint angles and the
    shoulder. An endpoint robot's do not: its angles are kept as further columns only.

    Parameters
    ----------
    path : path
        A folder or zip with `common.c3d` and `BB_TT_RR.c3d`, at most two folders deep.
    force_by : {"limb", "device"}
        Whose force on the other the sensor's channels hold; the files do not say it.
    side : {"right", "left"}, optional
        Needed where both arms have a force sensor.
    onset_event, end_event : str, optional
        Labels of the events at which the disturbance begins and is back. Trials without them are
        left out, and the provenance says which.
    emg_channels : mapping, optional
        Analog input -> muscle, such as ``{"ACH0": "biceps_long"}``.
    keep_personal : bool
        Keep subject, experiment, dates and times, which identify a person.

    Returns
    -------
    Recording
        A recording of kind "hand". Trial columns: `trial`, `condition` (the protocol's name, or
        `TP_n`), `set` (block), `protocol`, `repetition`, `is_error`, `event_<label>_s` (first
        occurrence).

    Raises
    ------
    InputError
        The exam cannot be read, lacks what is needed, or holds both arms and no side was chosen.
    """
    muscles = muscles_of(emg_channels)
    exam = read_exam(path)
    side = choose_side(exam, side, path)
    robot = robot_of(exam.common, side)
    trials, used, remarks = _trials(exam, keep_personal, onset_event, end_event, path)
    for c3d in used:
        _check_trial(c3d, used[0].rate_hz, side)
    offsets = np.concatenate([[0], np.cumsum([c3d.frames for c3d in used])])
    position, source = _hand_position(used, robot)
    force = _channels(used, f"{side.title()}_FS_ForceX", f"{side.title()}_FS_ForceY")
    personal = _personal(exam.common) if keep_personal else {}
    mirror = np.array([-1.0, 1.0]) if side == "left" else np.ones(2)
    along = robot.kind == "exoskeleton"
    told = [f"{name}: {text}" for name, text in personal.items()]
    return Recording(
        kind="hand",
        sample_rate_hz=used[0].rate_hz,
        trials=trials,
        offsets=offsets,
        time_s=np.concatenate([np.arange(c3d.frames) / c3d.rate_hz for c3d in used]),
        position=position * mirror,
        force=force * mirror * (-1.0 if force_by == "device" else 1.0),
        joint_angles=_joint_angles(used, side) if along else None,
        emg=_channels(used, *muscles) if muscles else None,
        muscles=tuple(muscles.values()),
        shoulder_m=robot.shoulder_m * mirror if along and robot.shoulder_m is not None else None,
        subject=_subject(personal),
        extra=_further_channels(used, side, muscles),
        provenance=(*_provenance(robot, source, force_by, len(used)), *remarks, *told),
    )


def _trials(
    exam: Exam, keep_personal: bool, onset_event: str | None, end_event: str | None, path: object
) -> tuple[pd.DataFrame, list[C3DFile], list[str]]:
    """The trial table, the file of each trial, and remarks on trials left out."""
    trials = trial_table(exam, keep_personal)
    order, remarks = used_trials(trials, onset_event, end_event, path)
    trials = trials.iloc[order].reset_index(drop=True)
    used = [exam.trials[int(i)].c3d for i in trials.pop("file_index")]
    set_onsets(trials, used, onset_event, end_event)
    return trials, used, remarks


def exam_subject(path: str | os.PathLike[str], keep_personal: bool) -> Subject:
    """The subject of an exam; the files name nobody unless `keep_personal`.

    Raises
    ------
    InputError
        The exam cannot be read, where it has to be.
    """
    refuse_new_format(Path(path))
    return _subject(_personal(read_exam(path).common)) if keep_personal else Subject()


def _check_trial(c3d: C3DFile, rate_hz: float, side: Side) -> None:
    if c3d.frames == 0:
        raise InputError("holds no samples", file=c3d.name, expected="a trial")
    if c3d.samples_per_frame != 1:
        problem = f"{c3d.samples_per_frame} analog samples per frame"
        raise InputError(problem, file=c3d.name, expected="1, as Dexterit-E writes it")
    if c3d.rate_hz != rate_hz:
        expected = f"{rate_hz:g}, as in the first trial"
        raise InputError(f"{c3d.rate_hz:g} samples/s", file=c3d.name, expected=expected)
    names = [f"{side.title()}_FS_Force{axis}" for axis in "XY"]
    if not any(_channel(c3d, name).any() for name in names):
        raise InputError(
            "the force is zero throughout, as of an absent sensor",
            file=c3d.name,
            column=names[0],
            expected="a measured force",
        )


def _channel(c3d: C3DFile, label: str) -> FloatArray:
    """One analog channel, (F,)."""
    if label not in c3d.analog_labels:
        there = ", ".join(c3d.analog_labels[:8])
        raise InputError("no such channel", file=c3d.name, column=label, expected=f"it: {there}, …")
    values = c3d.analog[:, c3d.analog_labels.index(label)]
    _check_finite(c3d, label, values)
    return values


def _check_finite(c3d: C3DFile, label: str, values: FloatArray) -> None:
    broken = ~np.isfinite(values)
    if broken.any():
        row = int(np.argmax(broken.reshape(len(values), -1).any(axis=1))) + 1
        raise InputError(
            "not finite", file=c3d.name, row=row, column=label, expected="a finite number"
        )


def _channels(files: Sequence[C3DFile], *labels: str) -> FloatArray:
    """Analog channels of all trials one after another, (N, len(labels))."""
    return np.column_stack(
        [np.concatenate([_channel(c3d, label) for c3d in files]) for label in labels]
    )


def _hand_position(files: Sequence[C3DFile], robot: Robot) -> tuple[FloatArray, str]:
    """Position of the hand, (N, 2) in the robot's frame, and a sentence on where it is from."""
    side = robot.side.title()
    recorded = _recorded_hand(files, f"{side}_Hand")
    links = (f"{side}_L1Ang", f"{side}_L2Ang")
    from_links = None
    if all(label in c3d.analog_labels for label in links for c3d in files):
        from_links = robot.hand_position(*_channels(files, *links).T)
    if recorded is None:
        if from_links is None:
            problem = "neither the hand nor the link angles with the links' lengths are there"
            raise InputError(problem, file=files[0].name, expected=f"{side}_Hand")
        return from_links, "Hand position: from the link angles, with no recorded hand to check."
    if from_links is None:
        return recorded, "Hand position: as recorded (the links' lengths are not known)."
    apart_m = float(np.linalg.norm(from_links - recorded, axis=1).max())
    if apart_m > HAND_TOLERANCE_M:
        return recorded, (
            "Hand position: as recorded; the one from the link angles is up to "
            f"{1e3 * apart_m:.3g} mm away, so that the links' lengths cannot be right."
        )
    return from_links, (
        f"Hand position: from the link angles, within {1e3 * apart_m:.2g} mm of the recorded hand."
    )


def _recorded_hand(files: Sequence[C3DFile], label: str) -> FloatArray | None:
    """The recorded hand, (N, 2) in m; None where it is absent or zero throughout."""
    if any(label not in c3d.point_labels for c3d in files):
        return None
    hands = [c3d.points[:, c3d.point_labels.index(label), :2] for c3d in files]
    for c3d, hand in zip(files, hands, strict=True):
        _check_finite(c3d, label, hand)
    hand = np.concatenate(hands)
    return hand if hand.any() else None


def _joint_angles(files: Sequence[C3DFile], side: Side) -> FloatArray:
    """Shoulder and elbow, (N, 2), from links that lie along the arm."""
    # Link angles both count from the x axis; mirrored, a becomes pi - a.
    link1, link2 = _channels(files, f"{side.title()}_L1Ang", f"{side.title()}_L2Ang").T
    if side == "left":
        link1, link2 = np.pi - link1, np.pi - link2
    return np.column_stack([link1, link2 - link1])


def _further_channels(
    files: Sequence[C3DFile], side: Side, muscles: Mapping[str, str]
) -> dict[str, FloatArray]:
    """Channels kept as recorded, neither mirrored nor turned, those that are in all trials."""
    wanted = {f"{side.title()}_{name}" for name in KEPT_CHANNELS}
    kept = {}
    for label in files[0].analog_labels:
        analog_input = re.fullmatch(r"ACH\d+", label) and label not in muscles
        if not (label in wanted or analog_input):
            continue
        if all(label in c3d.analog_labels for c3d in files):
            values = _channels(files, label)[:, 0]
            if values.any():
                kept[label] = values
    return kept


def _personal(common: C3DFile) -> dict[str, str]:
    """The texts of the group EXPERIMENT: subject, study, task."""
    texts = {
        name: common.text("EXPERIMENT", name) for name in common.parameters.get("EXPERIMENT", {})
    }
    return {name: text for name, text in texts.items() if text}


def _subject(personal: Mapping[str, str]) -> Subject:
    named = [personal[n] for n in ("SUBJECT_ID", "SUBJECT", "SUBJECT_NAME") if n in personal]
    return Subject(id=named[0]) if named else Subject()


def _provenance(robot: Robot, source: str, force_by: str, n_trials: int) -> list[str]:
    # Neither the file's name nor the subject: exams are often named after people.
    sentences = [
        f"Kinarm exam, {n_trials} trials, {robot.side} arm, robot {robot.version}.",
        source,
        "Force: sensor by the limb on the device, as stated."
        if force_by == "limb"
        else "Force: sensor by the device on the limb, as stated; its sign was turned.",
    ]
    if robot.side == "left":
        sentences.append("Left arm mirrored: x turned, angles from pi - a.")
    if robot.kind != "exoskeleton":
        sentences.append(
            "No joint angles and no shoulder: the links are the robot's, not along the arm."
        )
    return sentences
