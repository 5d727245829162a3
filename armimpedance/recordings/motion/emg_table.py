"""EMG beside a recording of a moving body: a table of its own, at its own rate."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Final, Literal

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.errors import InputError
from armimpedance.core.motion import EmgSignals
from armimpedance.recordings.motion.moving_metadata import MovingMetadata
from armimpedance.recordings.tables.folder import (
    METADATA_FILE,
    runs_of_trials,
    table_file,
    write_csv,
)
from armimpedance.recordings.tables.number_table import NumberTable, column_names, read_numbers
from armimpedance.recordings.tables.sample_clock import check_time
from armimpedance.recordings.tables.sample_table import EMG_PREFIX, trial_runs
from armimpedance.recordings.tables.trial_table import TrialTable

EMG_FILES: Final = ("emg.parquet", "emg.csv")
TableForm = Literal["parquet", "csv"]

#: Columns that every table has.
CLOCK: Final = ("trial", "time_s")


def read_emg(
    folder: Path, table: TrialTable, metadata: MovingMetadata, starts_s: FloatArray
) -> EmgSignals | None:
    """EMG of the trials, where the folder holds any; a trial may have none.

    Parameters
    ----------
    folder : Path
    table : TrialTable
    metadata : MovingMetadata
        Metadata of the folder, with the sample rate.
    starts_s : (T,)
        First time of each trial: its EMG starts within a frame of it.

    Raises
    ------
    InputError
    """
    rate = metadata.emg_rate_hz
    if not any((folder / name).is_file() for name in EMG_FILES):
        if rate is not None:
            expected = " or ".join(EMG_FILES)
            raise InputError("a rate of EMG, but no EMG", file=folder, expected=expected)
        return None
    if rate is None:
        file = folder / METADATA_FILE
        raise InputError("is missing", file=file, column="emg_rate_hz", expected="EMG's rate")
    file = table_file(folder, "emg")
    columns = [n for n in column_names(file) if n.startswith(EMG_PREFIX) and n != EMG_PREFIX]
    if not columns:
        expected = f"{EMG_PREFIX}<muscle>"
        raise InputError("no column of EMG", file=file, row=1, expected=expected)
    numbers = read_numbers(file, (*CLOCK, *columns))
    runs, begins = trial_runs(numbers)
    check_time(numbers, begins, rate)
    measured = table.trials["trial"].isin(runs).to_numpy()
    order = runs_of_trials(_some(table, measured), numbers, runs, begins)
    _check_starts(numbers, begins[order], starts_s[measured], 1.0 / metadata.sample_rate_hz)
    lengths = np.zeros(len(measured), np.int64)
    lengths[measured] = np.diff(begins)[order]
    rows = np.concatenate([np.arange(begins[run], begins[run + 1]) for run in order])
    return EmgSignals(
        sample_rate_hz=rate,
        offsets=np.concatenate([[0], np.cumsum(lengths)]),
        signals=np.column_stack([numbers.columns[n] for n in columns])[rows],
        muscles=tuple(n.removeprefix(EMG_PREFIX) for n in columns),
        unit=metadata.emg_unit,
    )


def emg_columns(emg: EmgSignals, trial: IntArray, starts_s: FloatArray) -> dict[str, FloatArray]:
    """The columns of the table of EMG; each trial's clock starts with the trial."""
    lengths = np.diff(emg.offsets)
    index = np.arange(emg.offsets[-1]) - np.repeat(emg.offsets[:-1], lengths)
    time = np.repeat(starts_s, lengths) + index / emg.sample_rate_hz
    signals = {EMG_PREFIX + muscle: emg.signals[:, i] for i, muscle in enumerate(emg.muscles)}
    return {"trial": np.repeat(trial, lengths), "time_s": time, **signals}


def _some(table: TrialTable, chosen: np.ndarray) -> TrialTable:
    """Some rows of a trial table."""
    lines = tuple(line for line, has in zip(table.lines, chosen, strict=True) if has)
    return TrialTable(table.file, table.trials[chosen].reset_index(drop=True), lines)


def _check_starts(
    numbers: NumberTable, first: IntArray, starts_s: FloatArray, frame_s: float
) -> None:
    """EMG has no clock in a recording: it must start with its trial."""
    late = numbers.columns["time_s"][first] - starts_s
    wrong = np.flatnonzero(np.abs(late) > frame_s)
    if len(wrong):
        row = int(first[wrong[0]])
        trial = int(numbers.columns["trial"][row])
        raise InputError(
            f"EMG of trial {trial} starts {late[wrong[0]]:.4g} s after the trial",
            file=numbers.file,
            row=numbers.row(row),
            column="time_s",
            expected="the trial's own start, within a frame",
        )


def write_table(
    columns: Mapping[str, FloatArray], folder: Path, stem: str, table: TableForm
) -> None:
    """Write a table as Parquet or CSV; a lost value is an empty cell."""
    arrays = {name: pa.array(values, from_pandas=True) for name, values in columns.items()}
    if table == "parquet":
        pq.write_table(pa.table(arrays), folder / f"{stem}.parquet")
    else:
        write_csv(pa.table(arrays), folder / f"{stem}.csv")
