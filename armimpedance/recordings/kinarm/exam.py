"""Kinarm exams (Dexterit-E, C3D or `.kinarm`) as recordings of the hand."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from armimpedance.core.arrays import FloatArray, frozen
from armimpedance.core.errors import InputError
from armimpedance.core.findings import Finding, not_taken
from armimpedance.core.records import Recording, Subject
from armimpedance.recordings.c3d.c3d_file import muscles_of
from armimpedance.recordings.kinarm.channels import (
    channels,
    channels_not_taken,
    force_labels,
    further_channels,
    labels_there,
    link_labels,
    sound_trials,
    wanted_channels,
)
from armimpedance.recordings.kinarm.exam_file import ExamFile, joined
from armimpedance.recordings.kinarm.files import (
    left_out_findings,
    none_left,
    read_common,
    read_exam,
)
from armimpedance.recordings.kinarm.force_balance import (
    Balance,
    ForceBy,
    force_balance,
    force_findings,
)
from armimpedance.recordings.kinarm.hand import hand_position
from armimpedance.recordings.kinarm.robot import Robot, Side, choose_side, robot_of, with_own_names
from armimpedance.recordings.kinarm.trials import (
    Choice,
    chosen_trials,
    trial_table,
    with_direction,
    with_onsets,
)


def read_kinarm(
    path: str | os.PathLike[str],
    *,
    force_by: ForceBy | None = None,
    side: Side | None = None,
    choice: Choice | None = None,
    emg_channels: Mapping[str, str] | None = None,
    keep_personal: bool = False,
) -> Recording:
    """Read an exam as Dexterit-E writes it, C3D files or a `.kinarm` archive.

    The hand's position is computed from the link angles if the links' lengths are known and agree
    with the recorded hand, since encoders have the least noise; otherwise it is the recorded hand.
    A left arm is mirrored (x to -x, angles a to pi - a), so that the conventions of a right arm
    hold. An exoskeleton's links lie along the arm and give joint angles and the shoulder. An
    endpoint robot's do not: its angles are kept as further columns only.

    Trials that have no samples, are broken or differ from the others are left out; the provenance
    and the `findings` state their number and names, and why.

    `path`: a `.kinarm` archive; a folder or zip with `common.c3d` and `BB_TT_RR.c3d`, at most two
    folders deep; or one trial's file with `common.c3d` beside it.
    `force_by`: whether the sensor's channels hold the force by the limb or by the device, which the
    files do not state. None: determined from the robot's own inertias and motor torques
    (`force_balance`), if they show it.
    `side`: needed if both arms have a force sensor.
    `choice`: which trials, and the events at which the disturbance begins and is back.
    `emg_channels`: analog input -> muscle, such as ``{"ACH0": "biceps_long"}``.
    `keep_personal`: keep subject, experiment, dates and times, which identify a person.
    Returns: a recording of kind "hand". Trial columns: `trial`, `condition` (the protocol's name,
    or its settings without the direction), `set` (block), `protocol`, `repetition`, `is_error`,
    `event_<label>_s` (first occurrence), and settings from the exam's tables: see
    `Protocol.columns`.
    Raises InputError: the exam cannot be read, lacks something that is needed, holds both arms and
    no side was chosen, or the sign of the force was neither stated nor can be determined.
    """
    muscles = muscles_of(emg_channels)
    session = _session(path, side, muscles, choice or Choice(), keep_personal)
    personal = _personal(session.common) if keep_personal else {}
    return _recording(session, force_by, muscles, personal, path)


@dataclass(frozen=True)
class _Session:
    """Trials of a recording, their files in a list, and data common to all.

    Channels are removed from the list as they are read: a long exam is hundreds of megabytes.
    """

    side: Side
    common: ExamFile
    trials: pd.DataFrame
    files: list[ExamFile]
    findings: list[Finding]
    remarks: list[str]
    beside: tuple[str, ...]


def _session(
    path: str | os.PathLike[str],
    side: Side | None,
    muscles: Mapping[str, str],
    choice: Choice,
    keep_personal: bool,
) -> _Session:
    """Read the valid and requested trials.

    Raises InputError: there are none.
    """
    exam, renamed = with_own_names(read_exam(path, wanted_channels(muscles)))
    side = choose_side(exam, side, path)
    sound, broken = sound_trials(exam.trials, side, muscles)
    left_out = [*exam.left_out, *broken]
    if not sound:
        raise none_left(left_out, path)
    table, counted = trial_table(sound, exam.common, side, keep_personal)
    wanted, chosen = chosen_trials(table, choice, path)
    timed, untimed = with_onsets(wanted, sound, choice)
    left_out += untimed
    if timed.empty:
        raise none_left(untimed, path)
    directed, direction = with_direction(timed)
    files = [sound[int(i)].file for i in directed.pop("file_index")]
    findings = left_out_findings(left_out, exam)
    remarks = [*renamed, *counted, *chosen, *direction]
    return _Session(side, exam.common, directed, files, findings, remarks, exam.beside)


def _recording(
    session: _Session,
    force_by: ForceBy | None,
    muscles: Mapping[str, str],
    personal: Mapping[str, str],
    path: object,
) -> Recording:
    """Build the recording of a session, and remove the channels from its files."""
    side, files = session.side, session.files
    frames, rate_hz = [file.frames for file in files], files[0].rate_hz
    labels = labels_there(files)
    hand = hand_position(files, robot_of(session.common, side))
    robot, along = hand.robot, hand.robot.kind == "exoskeleton"
    balance = force_balance(files, session.common, robot)
    whose = _force_by(force_by, balance, path)
    findings = (*session.findings, *force_findings(force_by, balance))
    mirror = np.array([-1.0 if side == "left" else 1.0, 1.0])
    position, force = hand.position, channels(files, *force_labels(side))
    position *= mirror
    force *= -mirror if whose == "device" else mirror
    joint_angles = _joint_angles(files, side) if along else None
    emg = channels(files, *muscles) if muscles else None
    further, dropped = further_channels(files, side, muscles)
    source = [hand.source, _force_sentence(whose, "found" if force_by is None else "stated")]
    remarks = (
        *session.remarks,
        *dropped,
        *channels_not_taken(labels, side, {*muscles, *further}),
        *not_taken(session.beside, "beside the trials"),
        *(f"{name}: {text}" for name, text in personal.items()),
    )
    return Recording(
        kind="hand",
        sample_rate_hz=rate_hz,
        trials=session.trials,
        offsets=np.concatenate([[0], np.cumsum(frames)]),
        time_s=frozen(joined(frames, (np.arange(n) / rate_hz for n in frames))),
        position=frozen(position),
        force=frozen(force),
        joint_angles=joint_angles,
        emg=None if emg is None else frozen(emg),
        muscles=tuple(muscles.values()),
        shoulder_m=robot.shoulder_m * mirror if along and robot.shoulder_m is not None else None,
        subject=_subject(personal),
        extra=further,
        provenance=(*_provenance(robot, source, findings, len(frames)), *remarks),
        findings=findings,
    )


def _force_by(stated: ForceBy | None, balance: Balance, path: object) -> ForceBy:
    """Return whose force the sensor holds: as stated, else as determined from the balance.

    Raises InputError: it was not stated and cannot be determined.
    """
    whose = stated or balance.force_by
    if whose is not None:
        return whose
    raise InputError(
        "whose force the sensor measures is not stated in the files, and the robot's own dynamics "
        f"do not show it: {balance.evidence}",
        file=path,
        expected="--force-by limb (by the hand on the robot) or --force-by device",
    )


def exam_subject(path: str | os.PathLike[str], keep_personal: bool) -> Subject:
    """Return the subject of an exam; without `keep_personal` an unknown subject.

    Raises InputError: the exam cannot be read.
    """
    if not keep_personal:
        return Subject()
    return _subject(_personal(read_common(path)))


def _joint_angles(files: Sequence[ExamFile], side: Side) -> FloatArray:
    """Angles of shoulder and elbow (N, 2), rad, from links that lie along the arm."""
    # both link angles are measured from the x axis; mirrored, a becomes pi - a
    link1, link2 = channels(files, *link_labels(side)).T
    if side == "left":
        link1, link2 = np.pi - link1, np.pi - link2
    return np.column_stack([link1, link2 - link1])


def _personal(common: ExamFile) -> dict[str, str]:
    """Texts of the group EXPERIMENT: subject, study, task."""
    texts = {
        name: common.parameters.text("EXPERIMENT", name)
        for name in common.parameters.groups.get("EXPERIMENT", {})
    }
    return {name: text for name, text in texts.items() if text}


def _subject(personal: Mapping[str, str]) -> Subject:
    named = [personal[n] for n in ("SUBJECT_ID", "SUBJECT", "SUBJECT_NAME") if n in personal]
    return Subject(id=named[0]) if named else Subject()


def _force_sentence(whose: ForceBy, reason: str) -> str:
    if whose == "limb":
        return f"Force: sensor by the limb on the device, as {reason}."
    return f"Force: sensor by the device on the limb, as {reason}; its sign was turned."


def _provenance(
    robot: Robot, sources: Sequence[str], findings: Sequence[Finding], n_trials: int
) -> list[str]:
    # neither the file's name nor the subject: exams are often named after people
    of = f"{n_trials} trials, {robot.side} arm, robot {robot.version}"
    sentences = [f"Kinarm exam, {of}.", *sources]
    if robot.side == "left":
        sentences.append("Left arm mirrored: x turned, angles from pi - a.")
    if robot.kind != "exoskeleton":
        sentences.append(
            "No joint angles and no shoulder: the links are the robot's, not along the arm."
        )
    return [
        *sentences,
        *(f"{finding.name.capitalize()}: {finding.message}." for finding in findings),
    ]
