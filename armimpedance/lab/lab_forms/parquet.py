"""One Parquet table of all samples, with the mapping of its columns beside it."""

from __future__ import annotations

from pathlib import Path

from armimpedance.core.records import Recording
from armimpedance.lab.parts.simulation import LabForm


def _write(recording: Recording, folder: Path) -> None:
    from manipulandum_sim.lab_files import mapping_text, write_parquet_table

    write_parquet_table(recording, folder / "session.parquet")
    text = mapping_text(recording, trials=['by = "column"', 'column = "trial"'])
    (folder / "columns.toml").write_text(text, encoding="utf-8")


FORM = LabForm(
    "one Parquet table of all samples",
    ("hand", "joint"),
    ("session.parquet", "columns.toml"),
    _write,
)
