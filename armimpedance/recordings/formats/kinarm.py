"""A Kinarm exam: a folder or zip of C3D files, a `.kinarm` archive, or one trial's C3D file."""

from __future__ import annotations

from pathlib import Path

from armimpedance.core.records import Recording
from armimpedance.recordings.kinarm.exam import exam_subject, read_kinarm
from armimpedance.recordings.kinarm.files import is_exam
from armimpedance.recordings.kinarm.trials import Choice
from armimpedance.recordings.reading import Format, ReadOptions, RecordedSubject


def _read(path: Path, options: ReadOptions) -> Recording:
    choice = Choice(
        onset_event=options.onset_event,
        end_event=options.end_event,
        protocols=tuple(options.protocols),
        events=tuple(options.events),
        without_errors=options.without_errors,
        where=options.where,
    )
    return read_kinarm(
        path,
        force_by=options.force_by,
        side=options.side,
        choice=choice,
        emg_channels=options.emg_channels,
        keep_personal=options.keep_personal,
    )


def _read_subject(path: Path, options: ReadOptions) -> RecordedSubject:
    muscles = tuple(options.emg_channels.values()) or None
    return RecordedSubject(exam_subject(path, options.keep_personal), muscles)


FORMAT = Format(
    name="a Kinarm exam (.kinarm, folder or zip of C3D)",
    recognises=is_exam,
    read=_read,
    options=(
        "force_by",
        "side",
        "onset_event",
        "end_event",
        "protocols",
        "events",
        "without_errors",
        "emg_channels",
        "keep_personal",
        "where",
    ),
    read_subject=_read_subject,
)
