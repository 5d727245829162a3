"""Opening any recording of a moving body."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final

from armimpedance.errors import InputError
from armimpedance.motion import MarkerRecording, MotionRecording
from armimpedance.recordings.kind import recording_kind
from armimpedance.recordings.motion.lab_axes import Y_UP, Z_UP
from armimpedance.recordings.motion.marker_c3d import read_marker_c3d
from armimpedance.recordings.motion.marker_folder import read_markers
from armimpedance.recordings.motion.motion_folder import read_motion
from armimpedance.recordings.motion.opensim_table import opensim_motion
from armimpedance.recordings.motion.trc import read_trc
from armimpedance.skeleton import Skeleton

#: Files of one trial that are read, by their suffix.
SUFFIXES: Final = (".c3d", ".trc", ".mot", ".sto")


@dataclass(frozen=True)
class CaptureOptions:
    """What a file does not say itself.

    Attributes
    ----------
    axes : three str or None
        The file's axes that point forward, left and up; None: z up in C3D, OpenSim's in `.trc`.
    prefix : str or None
    emg_channels : mapping
        See `read_marker_c3d`.
    skeleton : Skeleton or None
        Of markers; of a table of angles, which needs one.
    angles : mapping
    in_degrees : bool or None
        See `opensim_motion`.
    """

    axes: Sequence[str] | None = None
    prefix: str | None = None
    emg_channels: Mapping[str, str] = field(default_factory=dict)
    skeleton: Skeleton | None = None
    angles: Mapping[str, str] = field(default_factory=dict)
    in_degrees: bool | None = None


def open_motion_capture(
    path: str | os.PathLike[str], options: CaptureOptions | None = None
) -> MarkerRecording | MotionRecording:
    """Read markers or joint motion from a folder, a C3D, a `.trc`, a `.mot` or a `.sto`.

    Parameters
    ----------
    path : path
    options : CaptureOptions, optional
        A folder states all but a skeleton itself.

    Raises
    ------
    InputError
        There is nothing at `path`, its format is not known, or what is there is wrong.
    """
    place, wanted = Path(path), options or CaptureOptions()
    if not place.exists():
        raise InputError("no such file or folder", file=path, expected="a recording")
    if place.is_dir():
        return _open_folder(place, wanted)
    suffix = place.suffix.lower()
    if suffix in (".mot", ".sto"):
        if wanted.skeleton is None:
            raise InputError(
                "a table of angles says nothing of the body", file=path, expected="a skeleton"
            )
        return opensim_motion(place, wanted.skeleton, wanted.angles, in_degrees=wanted.in_degrees)
    if suffix == ".trc":
        markers = read_trc(place, axes=wanted.axes or Y_UP)
    elif suffix == ".c3d":
        markers = read_marker_c3d(
            place,
            prefix=wanted.prefix,
            emg_channels=wanted.emg_channels,
            axes=wanted.axes or Z_UP,
        )
    else:
        raise InputError("is no known format", file=path, expected=f"one of {', '.join(SUFFIXES)}")
    return replace(markers, skeleton=wanted.skeleton)


def _open_folder(folder: Path, options: CaptureOptions) -> MarkerRecording | MotionRecording:
    if replace(options, skeleton=None) != CaptureOptions():
        raise InputError(
            "a recording's folder states axes, units and EMG itself",
            file=folder,
            expected="no options of the reading",
        )
    if recording_kind(folder) == "motion":
        return read_motion(folder)
    markers = read_markers(folder)
    return markers if options.skeleton is None else replace(markers, skeleton=options.skeleton)
