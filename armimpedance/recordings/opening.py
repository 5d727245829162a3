"""Open recordings of any known format, read their subjects, and write them as folders.

A new format is a file in the folder `formats` with one record of a recogniser and a reader.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Final

from armimpedance.core.errors import InputError, RecordError
from armimpedance.core.inputs import unchanged
from armimpedance.core.method_table import MethodTable
from armimpedance.core.motion import MarkerRecording
from armimpedance.core.outputs import RECORDING_FILES
from armimpedance.core.records import Recording
from armimpedance.recordings.mapped.columns_toml import MAPPING_FILE
from armimpedance.recordings.motion.marker_and_motion_folder import write_markers, write_motion
from armimpedance.recordings.motion.moving_folder import EMG_FILES, TableForm
from armimpedance.recordings.motion.skeleton_json import SKELETON_FILE
from armimpedance.recordings.reading import (
    AnyRecording,
    Format,
    ReadOptions,
    RecordedSubject,
    with_one_name_each,
)
from armimpedance.recordings.tables.folder import write_folder
from armimpedance.recordings.where import parse_where, with_where

#: The default comes first, so that recognising a recording's folder imports no other reader.
FORMATS: Final = MethodTable[Format](
    "armimpedance.recordings.formats", "FORMAT", "format", default="folder"
)

#: Options of the commands whose names differ from their fields in `ReadOptions`.
_OPTIONS: Final = {
    "emg_channels": "emg",
    "angles": "angle",
    "protocols": "protocol",
    "events": "event",
}


def open_recording(
    path: str | os.PathLike[str], options: ReadOptions | None = None
) -> AnyRecording:
    """Read a recording in any of the known formats.

    Parameters
    ----------
    path : path
    options : ReadOptions, optional

    Returns
    -------
    Recording, MarkerRecording or MotionRecording

    Raises
    ------
    InputError
        `path` does not exist, its format is not known, an option is missing or not usable with
        the format, the content is wrong, or it changed during reading.
    """
    wanted = options or ReadOptions()
    format_ = format_of(path, wanted)
    with unchanged(path, wanted.mapping, wanted.forces):
        recording = _read(format_, Path(path), wanted)
    if wanted.where is None or "where" in format_.options:
        return recording
    return with_where(recording, wanted.where, path)


def _read(format_: Format, path: Path, wanted: ReadOptions) -> AnyRecording:
    """Read a path; the record's errors get the path as their file."""
    try:
        return with_one_name_each(format_.read(path, wanted))
    except RecordError as error:
        if error.file is not None:
            raise
        raise InputError(
            error.problem, file=path, column=error.column, expected=error.expected
        ) from None


def format_of(path: str | os.PathLike[str], options: ReadOptions) -> Format:
    """The format at a path, which must be able to use all given options.

    Raises InputError: `path` does not exist, its format is not known, or it cannot use an option.
    """
    location = Path(path)
    if not location.exists():
        raise InputError("no such file or folder", file=path, expected="a recording")
    format_ = next(
        (candidate for candidate in FORMATS.values() if candidate.recognises(location)), None
    )
    if format_ is None:
        names = "; ".join(candidate.name for candidate in FORMATS.values())
        raise InputError("is no recording of a known format", file=path, expected=names)
    if options.where is not None:
        parse_where(options.where)
    for name in options.given:
        if name not in (*format_.options, "where"):
            allowed = ", ".join(map(_option, format_.options)) or "no options of the reading"
            problem = f"{_option(name)} with {format_.name}"
            raise InputError(problem, file=path, expected=allowed)
    return format_


def is_recording(path: str | os.PathLike[str]) -> bool:
    """True if the file or folder at a path can be opened without further options.

    A table of any layout counts if it has a mapping, beside it or in its folder.

    Parameters
    ----------
    path : path

    Returns
    -------
    bool
    """
    location = Path(path)
    format_ = next(
        (candidate for candidate in FORMATS.values() if candidate.recognises(location)), None
    )
    if format_ is not FORMATS["mapped"]:
        return format_ is not None
    return ((location if location.is_dir() else location.parent) / MAPPING_FILE).is_file()


def _option(name: str) -> str:
    return "--" + _OPTIONS.get(name, name).replace("_", "-")


# The subject of a recording in any format, if possible without reading the samples.


def read_subject(
    path: str | os.PathLike[str], options: ReadOptions | None = None
) -> RecordedSubject:
    """Read the subject and the muscles of a recording in any of the known formats.

    Only `recording.json` of a recording's folder is read. A Kinarm exam needs no `force_by` here.

    Parameters
    ----------
    path : path
    options : ReadOptions, optional

    Returns
    -------
    RecordedSubject

    Raises
    ------
    InputError
        `path` does not exist, its format is not known, or its content is wrong.
    """
    wanted = options or ReadOptions()
    format_ = format_of(path, wanted)
    if format_.read_subject is not None:
        return format_.read_subject(Path(path), wanted)
    with unchanged(path, wanted.mapping, wanted.forces):
        recording = format_.read(Path(path), wanted)
    if isinstance(recording, Recording):
        muscles = recording.muscles or None
        return RecordedSubject(recording.subject, muscles, recording.gravity_m_s2)
    emg = recording.emg
    return RecordedSubject(recording.subject, None if emg is None else emg.muscles)


# Writing a recording of any kind as a folder.

#: The possible files in a recording's folder.
FOLDER_FILES: Final = (*RECORDING_FILES, *EMG_FILES, SKELETON_FILE)


def write_recording(
    recording: AnyRecording, path: str | os.PathLike[str], table: TableForm = "parquet"
) -> None:
    """Write a recording to a folder that appears only when it is complete.

    `open_recording` returns exactly the same recording.

    Parameters
    ----------
    recording : Recording, MarkerRecording or MotionRecording
        Trials of the hand or of joints; markers; joint motion.
    path : path
        A new or empty folder, or an earlier recording of this kind, which is replaced.
    table : {"parquet", "csv"}
        The form of the samples.

    Raises
    ------
    InputError
        The folder cannot be written, or a name in the recording has no form on disk.

    Examples
    --------
    >>> import tempfile
    >>> from armimpedance.recordings import open_recording, write_recording
    >>> from manipulandum_sim.hand import simulate
    >>> recording, _ = simulate("cocontraction", seed=1, sets=1, conditions=["cocontraction_10"])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_recording(recording, f"{folder}/session")
    ...     bool((open_recording(f"{folder}/session").force == recording.force).all())
    True
    """
    if isinstance(recording, Recording):
        write_folder(recording, path, table)
    elif isinstance(recording, MarkerRecording):
        write_markers(recording, path, table)
    else:
        write_motion(recording, path, table)
