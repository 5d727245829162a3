"""One MATLAB file with a struct array of trials, and the mapping of its fields beside it."""

from __future__ import annotations

from pathlib import Path

from armimpedance.core.records import Recording
from armimpedance.lab.parts.simulation import LabForm


def _field(name: str) -> str:
    return f"trials.{name}"


def _write(recording: Recording, folder: Path) -> None:
    from manipulandum_sim.lab_files import mapping_text, write_matlab_trials

    write_matlab_trials(recording, folder / "session.mat")
    text = mapping_text(recording, _field, condition=_field("condition"), facts=_field)
    (folder / "columns.toml").write_text(text, encoding="utf-8")


FORM = LabForm(
    "a MATLAB file with a struct array of trials",
    ("hand", "joint"),
    ("session.mat", "columns.toml"),
    _write,
)
