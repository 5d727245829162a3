"""One CSV file a trial, in a folder with the mapping of their columns."""

from __future__ import annotations

from pathlib import Path

from armimpedance.core.records import Recording
from armimpedance.lab.parts.simulation import LabForm


def _write(recording: Recording, folder: Path) -> None:
    from manipulandum_sim.lab_files import (
        column_name,
        mapping_text,
        numeric_facts,
        write_trial_files,
    )

    write_trial_files(recording, folder / "trials", facts=numeric_facts(recording))
    text = mapping_text(
        recording,
        column_name,
        head=['files = "*.csv"'],
        trials=['pattern = "{condition}_{trial}.csv"'],
        condition=None,
    )
    (folder / "trials" / "columns.toml").write_text(text, encoding="utf-8")


FORM = LabForm("a CSV file for each trial", ("hand", "joint"), ("trials",), _write)
