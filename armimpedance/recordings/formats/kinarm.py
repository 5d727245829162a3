"""A Kinarm exam: a folder or zip of C3D files, or one trial of it."""

from __future__ import annotations

from pathlib import Path

from armimpedance.recordings.kinarm.exam import exam_subject, read_kinarm
from armimpedance.recordings.kinarm.files import is_exam, refuse_new_format
from armimpedance.recordings.kinarm.trials import Choice
from armimpedance.recordings.reading import Format, ReadOptions, RecordedSubject
from armimpedance.records import Recording


def _read(path: Path, options: ReadOptions) -> Recording:
    refuse_new_format(path)
    choice = Choice(
        onset_event=options.onset_event,
        end_event=options.end_event,
        protocols=tuple(options.protocols),
        events=tuple(options.events),
        without_errors=options.without_errors,
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
    name="a Kinarm exam (folder or zip of C3D files, or a trial beside common.c3d)",
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
    ),
    read_subject=_read_subject,
)
