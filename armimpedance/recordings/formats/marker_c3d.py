"""Markers of motion capture in a C3D file, one trial a file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from armimpedance.core.motion import MarkerRecording
from armimpedance.recordings.kinarm.files import is_exam_file
from armimpedance.recordings.motion.marker_c3d import read_marker_c3d
from armimpedance.recordings.reading import Format, ReadOptions


def _read(path: Path, options: ReadOptions) -> MarkerRecording:
    markers = read_marker_c3d(
        path,
        prefix=options.prefix,
        emg_channels=options.emg_channels,
        axes=options.axes,
        force_by=options.force_by,
    )
    return replace(markers, skeleton=options.skeleton)


def _is_motion_capture(path: Path) -> bool:
    # A trial of a Kinarm exam would read as two markers, without its force.
    return path.suffix.lower() == ".c3d" and path.is_file() and not is_exam_file(path)


FORMAT = Format(
    name="motion capture in a .c3d file",
    recognises=_is_motion_capture,
    read=_read,
    options=("prefix", "emg_channels", "axes", "force_by", "skeleton"),
)
