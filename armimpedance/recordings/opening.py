"""Opening any recording by the table of formats, who was recorded, and writing one as a folder.

A new format is a file in the folder `formats` with a recogniser and a reader, in one record.
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

#: The default comes first: looking at a recording's own folder imports no other reader.
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
    """Read a recording in whichever of the known formats it is.

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
        There is nothing at `path`, its format is not known, an option is missing that the format
        needs or was given that it cannot use, what is there is wrong, or it changed meanwhile.
    """
    wanted = options or ReadOptions()
    known = format_of(path, wanted)
    with unchanged(path, wanted.mapping, wanted.forces):
        recording = _read(known, Path(path), wanted)
    if wanted.where is None or "where" in known.options:
        return recording
    return with_where(recording, wanted.where, path)


def _read(known: Format, path: Path, wanted: ReadOptions) -> AnyRecording:
    """What is at a path; what a record refuses names the path too."""
    try:
        return with_one_name_each(known.read(path, wanted))
    except RecordError as error:
        if error.file is not None:
            raise
        raise InputError(
            error.problem, file=path, column=error.column, expected=error.expected
        ) from None


def format_of(path: str | os.PathLike[str], options: ReadOptions) -> Format:
    """The format of what is at a path, which can use all options that are given.

    Raises InputError: there is nothing at `path`, its format is not known, or it cannot use an
    option.
    """
    place = Path(path)
    if not place.exists():
        raise InputError("no such file or folder", file=path, expected="a recording")
    known = next((each for each in FORMATS.values() if each.recognises(place)), None)
    if known is None:
        names = "; ".join(each.name for each in FORMATS.values())
        raise InputError("is no recording of a known format", file=path, expected=names)
    if options.where is not None:
        parse_where(options.where)
    for name in options.given:
        if name not in (*known.options, "where"):
            allowed = ", ".join(map(_option, known.options)) or "no options of the reading"
            problem = f"{_option(name)} with {known.name}"
            raise InputError(problem, file=path, expected=allowed)
    return known


def is_recording(path: str | os.PathLike[str]) -> bool:
    """Whether what is at a path can be opened without further options.

    A table of any layout counts where a mapping stands beside it or in it.

    Parameters
    ----------
    path : path

    Returns
    -------
    bool
    """
    place = Path(path)
    known = next((each for each in FORMATS.values() if each.recognises(place)), None)
    if known is not FORMATS["mapped"]:
        return known is not None
    return ((place if place.is_dir() else place.parent) / MAPPING_FILE).is_file()


def _option(name: str) -> str:
    return "--" + _OPTIONS.get(name, name).replace("_", "-")


# Who was recorded, of any format, without reading the samples where that can be avoided.


def read_subject(
    path: str | os.PathLike[str], options: ReadOptions | None = None
) -> RecordedSubject:
    """The subject and the muscles of a recording in any of the known formats.

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
        There is nothing at `path`, its format is not known, or what is there is wrong.
    """
    wanted = options or ReadOptions()
    known = format_of(path, wanted)
    if known.read_subject is not None:
        return known.read_subject(Path(path), wanted)
    with unchanged(path, wanted.mapping, wanted.forces):
        recording = known.read(Path(path), wanted)
    if isinstance(recording, Recording):
        muscles = recording.muscles or None
        return RecordedSubject(recording.subject, muscles, recording.gravity_m_s2)
    emg = recording.emg
    return RecordedSubject(recording.subject, None if emg is None else emg.muscles)


# Writing a recording of any kind as a folder.

#: What the folder of a recording of any kind may hold.
FOLDER_FILES: Final = (*RECORDING_FILES, *EMG_FILES, SKELETON_FILE)


def write_recording(
    recording: AnyRecording, path: str | os.PathLike[str], table: TableForm = "parquet"
) -> None:
    """Write a recording to a folder that appears only when it is complete.

    `open_recording` gives the same recording back, bit by bit.

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
