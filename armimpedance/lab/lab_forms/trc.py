"""Filmed markers, one `.trc` file a trial, and the skeleton that they sit on."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Final

from armimpedance.core.motion import MarkerRecording
from armimpedance.lab.parts.simulation import LabForm

_SKELETON: Final = "skeleton.json"


def _write(recording: MarkerRecording, folder: Path) -> None:
    from armimpedance.recordings import write_recording
    from manipulandum_sim.lab_files import write_trc_files

    write_trc_files(recording, folder / "markers")
    if recording.skeleton is not None:
        whole = folder / "recording"
        write_recording(recording, whole)
        (whole / _SKELETON).rename(folder / _SKELETON)
        shutil.rmtree(whole)


FORM = LabForm("markers, a .trc file for each trial", ("markers",), ("markers", _SKELETON), _write)
