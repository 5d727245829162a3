"""An exam as Dexterit-E exports it: a zip of C3D files."""

from __future__ import annotations

from pathlib import Path

from armimpedance.core.records import Recording
from armimpedance.lab.parts.simulation import LabForm


def _write(recording: Recording, folder: Path) -> None:
    from manipulandum_sim.lab_files import write_kinarm_c3d

    write_kinarm_c3d(recording, folder / "exam.zip")


FORM = LabForm("a Kinarm exam, as a zip of C3D files", ("hand",), ("exam.zip",), _write)
