"""Joint angles in a table of OpenSim (`.mot`, `.sto`), one trial a file."""

from __future__ import annotations

from pathlib import Path

from armimpedance.core.errors import InputError
from armimpedance.core.motion import MotionRecording
from armimpedance.recordings.motion.opensim_tables import opensim_motion
from armimpedance.recordings.reading import Format, ReadOptions


def _read(path: Path, options: ReadOptions) -> MotionRecording:
    if options.skeleton is None:
        raise InputError(
            "a table of angles says nothing of the body", file=path, expected="a skeleton"
        )
    return opensim_motion(path, options.skeleton, options.angles, in_degrees=options.in_degrees)


FORMAT = Format(
    name="angles in a .mot or .sto file",
    recognises=lambda path: path.suffix.lower() in (".mot", ".sto") and path.is_file(),
    read=_read,
    options=("skeleton", "angles", "in_degrees"),
)
