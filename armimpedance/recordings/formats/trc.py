"""Markers of OpenSim and Motion Analysis in a `.trc` file, one trial a file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from armimpedance.core.motion import MarkerRecording
from armimpedance.recordings.motion.moving_metadata import Y_UP
from armimpedance.recordings.motion.trc import read_trc, with_ground_forces
from armimpedance.recordings.reading import Format, ReadOptions


def _read(path: Path, options: ReadOptions) -> MarkerRecording:
    axes = options.axes or Y_UP
    markers = replace(read_trc(path, axes=axes), skeleton=options.skeleton)
    return markers if options.forces is None else with_ground_forces(markers, options.forces, axes)


FORMAT = Format(
    name="motion capture in a .trc file",
    recognises=lambda path: path.suffix.lower() == ".trc" and path.is_file(),
    read=_read,
    options=("axes", "skeleton", "forces"),
)
