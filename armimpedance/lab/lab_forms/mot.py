"""Joint angles, one `.mot` file a trial."""

from __future__ import annotations

from pathlib import Path

from armimpedance.core.motion import MotionRecording
from armimpedance.lab.parts.simulation import LabForm


def _write(recording: MotionRecording, folder: Path) -> None:
    from manipulandum_sim.lab_files import write_mot_files

    write_mot_files(recording, folder / "motion")


FORM = LabForm("joint angles, a .mot file for each trial", ("motion",), ("motion",), _write)
