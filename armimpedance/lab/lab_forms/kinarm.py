"""An exam as Dexterit-E keeps it: a `.kinarm` archive."""

from __future__ import annotations

from pathlib import Path

from armimpedance.core.records import Recording
from armimpedance.lab.parts.simulation import LabForm


def _write(recording: Recording, folder: Path) -> None:
    from manipulandum_sim.lab_files import write_kinarm_archive

    write_kinarm_archive(recording, folder / "exam.kinarm")


FORM = LabForm("a Kinarm exam, as an archive (.kinarm)", ("hand",), ("exam.kinarm",), _write)
