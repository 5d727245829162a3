"""Opening any recording: one table of the formats that are known.

A new format is a module with a recogniser and a reader, and one record in `FORMATS`.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, Literal

from armimpedance.errors import InputError
from armimpedance.recordings.kinarm.exam import read_kinarm
from armimpedance.recordings.kinarm.files import is_exam, refuse_new_format
from armimpedance.recordings.kinarm.robot import Side
from armimpedance.recordings.tables.folder import is_recording_folder, read_folder
from armimpedance.records import Recording


@dataclass(frozen=True)
class ReadOptions:
    """What a file does not say itself and its reader has to be told; see `read_kinarm`."""

    force_by: Literal["limb", "device"] | None = None
    side: Side | None = None
    onset_event: str | None = None
    end_event: str | None = None
    emg_channels: Mapping[str, str] = field(default_factory=dict)
    keep_personal: bool = False


@dataclass(frozen=True)
class Format:
    """A file format: its name, how it is known, how it is read."""

    name: str
    recognises: Callable[[Path], bool]
    read: Callable[[Path, ReadOptions], Recording]


def open_recording(path: str | os.PathLike[str], options: ReadOptions | None = None) -> Recording:
    """Read a recording in whichever of the known formats it is.

    Parameters
    ----------
    path : path
    options : ReadOptions, optional

    Raises
    ------
    InputError
        There is nothing at `path`, its format is not known, an option is missing that the format
        needs or was given that it cannot use, or what is there is wrong.
    """
    place = Path(path)
    if not place.exists():
        raise InputError("no such file or folder", file=path, expected="a recording")
    for known in FORMATS:
        if known.recognises(place):
            return known.read(place, options or ReadOptions())
    names = "; ".join(known.name for known in FORMATS)
    raise InputError("is no recording of a known format", file=path, expected=names)


def _open_folder(path: Path, options: ReadOptions) -> Recording:
    if options != ReadOptions():
        raise InputError(
            "a recording's folder states sides, signs and events itself",
            file=path,
            expected="no options of the reading",
        )
    return read_folder(path)


def _open_kinarm(path: Path, options: ReadOptions) -> Recording:
    refuse_new_format(path)
    if options.force_by is None:
        raise InputError(
            "whose force the sensor measures is not stated in the files",
            file=path,
            expected="--force-by limb (by the hand on the robot) or --force-by device",
        )
    return read_kinarm(
        path,
        force_by=options.force_by,
        side=options.side,
        onset_event=options.onset_event,
        end_event=options.end_event,
        emg_channels=options.emg_channels,
        keep_personal=options.keep_personal,
    )


FORMATS: Final = (
    Format("a folder with recording.json", is_recording_folder, _open_folder),
    Format("a Kinarm exam (folder or zip of C3D files)", is_exam, _open_kinarm),
)
