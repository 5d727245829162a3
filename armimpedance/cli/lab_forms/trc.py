"""Filmed markers, one `.trc` file a trial."""

from __future__ import annotations

from pathlib import Path

from armimpedance.cli.parts.lab_form import LabForm
from armimpedance.motion import MarkerRecording


def _write(recording: MarkerRecording, folder: Path) -> None:
    from manipulandum_sim.lab_files import write_trc_files

    write_trc_files(recording, folder / "markers")


FORM = LabForm("markers, a .trc file for each trial", ("markers",), ("markers",), _write)
