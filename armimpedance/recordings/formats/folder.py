"""The toolkit's own format: a folder with `recording.json`, of any kind."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from armimpedance.core.errors import InputError
from armimpedance.recordings.motion.marker_and_motion_folder import read_markers, read_motion
from armimpedance.recordings.reading import (
    AnyRecording,
    Format,
    ReadOptions,
    RecordedSubject,
    recording_kind,
)
from armimpedance.recordings.tables.folder import METADATA_FILE, is_recording_folder, read_folder
from armimpedance.recordings.tables.metadata import read_metadata, recording_fields, subject_of


def _read(path: Path, options: ReadOptions) -> AnyRecording:
    kind = recording_kind(path)
    if kind == "markers":
        markers = read_markers(path)
        return markers if options.skeleton is None else replace(markers, skeleton=options.skeleton)
    if options.skeleton is not None:
        raise InputError(f"--skeleton with a recording of kind {kind!r}", file=path)
    return read_motion(path) if kind == "motion" else read_folder(path)


def _read_subject(path: Path, _options: ReadOptions) -> RecordedSubject:
    file = path / METADATA_FILE
    if recording_kind(path) in ("markers", "motion"):
        return RecordedSubject(subject_of(recording_fields(file)), None)
    metadata = read_metadata(file)
    return RecordedSubject(metadata.subject, metadata.muscles, metadata.gravity_m_s2)


FORMAT = Format(
    name="a folder with recording.json",
    recognises=is_recording_folder,
    read=_read,
    options=("skeleton",),
    read_subject=_read_subject,
)
