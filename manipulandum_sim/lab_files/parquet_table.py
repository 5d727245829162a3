"""A session as one Parquet table of all samples, the trial's number and condition in each row."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from armimpedance.core.records import Recording
from manipulandum_sim.lab_files.trial_columns import trials_of


def write_parquet_table(recording: Recording, path: Path) -> None:
    """Write all trials one after another into one table.

    Parameters
    ----------
    recording : Recording
    path : Path
        The file.
    """
    parts = [
        pd.DataFrame(
            {"trial": trial.number, "condition": trial.condition, **trial.facts, **trial.columns}
        )
        for trial in trials_of(recording)
    ]
    pd.concat(parts, ignore_index=True).to_parquet(path, index=False)
