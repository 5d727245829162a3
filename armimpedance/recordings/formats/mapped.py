"""Files of any layout with a mapping of their columns."""

from __future__ import annotations

from pathlib import Path

from armimpedance.core.records import Recording
from armimpedance.recordings.bids.dataset import is_bids
from armimpedance.recordings.mapped.apply import mapped_recording
from armimpedance.recordings.mapped.columns_toml import read_mapping
from armimpedance.recordings.mapped.door import (
    files_of,
    is_mapped,
    mapping_of,
    read_files,
    read_table,
)
from armimpedance.recordings.mapped.joined import with_tables
from armimpedance.recordings.reading import Format, ReadOptions, RecordedSubject
from armimpedance.recordings.tables.folder import is_recording_folder


def _read(path: Path, options: ReadOptions) -> Recording:
    mapping = read_mapping(mapping_of(path, _stated(options)))
    files = files_of(path, mapping.files)
    pattern = mapping.trials.pattern
    raw = with_tables(read_files(files, mapping.wants), mapping.tables, read_table, pattern)
    return mapped_recording(raw, mapping, path, strict=options.strict, where=options.where)


def _read_subject(path: Path, options: ReadOptions) -> RecordedSubject:
    metadata = read_mapping(mapping_of(path, _stated(options))).metadata
    return RecordedSubject(metadata.subject, metadata.muscles, metadata.gravity_m_s2)


def _stated(options: ReadOptions) -> Path | None:
    return None if options.mapping is None else Path(options.mapping)


FORMAT = Format(
    name="a table with a mapping of its columns (.csv, .mat, ...)",
    # a folder of BIDS is read without a mapping for its points, and with one for the rest
    recognises=lambda path: not (is_recording_folder(path) or is_bids(path)) and is_mapped(path),
    read=_read,
    options=("mapping", "strict", "where"),
    read_subject=_read_subject,
)
