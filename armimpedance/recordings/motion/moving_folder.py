"""The shared files of moving-body recordings: trials, samples, force plates and EMG.

A folder of `recording.json`, `trials.csv`, `samples.parquet` or `.csv` and, where there are any,
`emg.parquet` or `.csv` (at its own rate) and `skeleton.json`.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.errors import InputError
from armimpedance.core.motion import WRENCH, EmgSignals, MarkerRecording, MotionRecording
from armimpedance.core.outputs import RECORDING_FILES, staged_folder
from armimpedance.recordings.motion.moving_metadata import (
    MovingKind,
    MovingMetadata,
    moving_metadata_text,
    read_moving_metadata,
)
from armimpedance.recordings.motion.skeleton_json import SKELETON_FILE, skeleton_text
from armimpedance.recordings.tables.folder import (
    METADATA_FILE,
    TRIALS_FILE,
    runs_of_trials,
    table_file,
    write_csv,
)
from armimpedance.recordings.tables.number_table import NumberTable, column_names, read_numbers
from armimpedance.recordings.tables.sample_table import EMG_PREFIX, check_time, trial_runs
from armimpedance.recordings.tables.trial_table import (
    TrialTable,
    check_onsets,
    read_trials,
    trials_text,
)

# EMG of a recording of a moving body: a separate table with its own rate.

EMG_FILES: Final = ("emg.parquet", "emg.csv")
TableForm = Literal["parquet", "csv"]

#: The columns of every table.
CLOCK: Final = ("trial", "time_s")


def read_emg(
    folder: Path, table: TrialTable, metadata: MovingMetadata, starts_s: FloatArray
) -> EmgSignals | None:
    """Read the trials' EMG, where the folder holds any; a trial may have none.

    `metadata`: metadata of the folder, with the sample rate.
    `starts_s` (T,): first time of each trial, from which its EMG may start at most a frame away.
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
    """The columns of the EMG table; each trial's clock starts with the trial."""
    lengths = np.diff(emg.offsets)
    index = np.arange(emg.offsets[-1]) - np.repeat(emg.offsets[:-1], lengths)
    time = np.repeat(starts_s, lengths) + index / emg.sample_rate_hz
    signals = {EMG_PREFIX + muscle: emg.signals[:, i] for i, muscle in enumerate(emg.muscles)}
    return {"trial": np.repeat(trial, lengths), "time_s": time, **signals}


def _some(table: TrialTable, chosen: np.ndarray) -> TrialTable:
    """Some rows of a trial table."""
    lines = tuple(line for line, is_chosen in zip(table.lines, chosen, strict=True) if is_chosen)
    return TrialTable(table.file, table.trials[chosen].reset_index(drop=True), lines)


def _check_starts(
    numbers: NumberTable, first: IntArray, starts_s: FloatArray, frame_s: float
) -> None:
    """Check that EMG starts with its trial, as it has no clock in a recording."""
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
    """Write a table as Parquet or CSV; a missing value is an empty cell."""
    arrays = {name: pa.array(values, from_pandas=True) for name, values in columns.items()}
    if table == "parquet":
        pq.write_table(pa.table(arrays), folder / f"{stem}.parquet")
    else:
        write_csv(pa.table(arrays), folder / f"{stem}.csv")


@dataclass(frozen=True)
class MovingTables:
    """The tables of a folder, the samples in the order of the trial table.

    `trials` DataFrame (T rows), `offsets` (T + 1,) int, `wrenches` (N, K, 6) or None.
    `table`: the samples in the order of the file, for messages.
    `columns` mapping str -> (N,): all known columns.
    `remarks`: sentences on columns that were left out.
    """

    table: NumberTable
    trials: pd.DataFrame
    offsets: IntArray
    columns: Mapping[str, FloatArray]
    wrenches: FloatArray | None
    emg: EmgSignals | None
    remarks: tuple[str, ...]

    def stack(self, names: tuple[str, ...]) -> FloatArray:
        """These columns side by side, (N, len(names))."""
        return np.column_stack([self.columns[name] for name in names])


def open_folder(folder: Path, kind: MovingKind) -> tuple[MovingMetadata, Path]:
    """The checked metadata of a folder of this kind, and its samples' file."""
    if not folder.is_dir():
        raise InputError("no such folder", file=folder, expected="a recording's folder")
    return read_moving_metadata(folder / METADATA_FILE, kind), table_file(folder)


def read_tables(
    folder: Path, metadata: MovingMetadata, wanted: Collection[str], *, gaps: bool
) -> MovingTables:
    """Read the tables of a recording.

    `wanted`: the columns of this kind of recording.
    `gaps`: whether these columns may have gaps.
    """
    table = read_trials(folder / TRIALS_FILE)
    file = table_file(folder)
    names = column_names(file)
    plates = _plate_columns(file, names, metadata)
    numbers = read_numbers(file, (*CLOCK, *wanted, *plates), gaps=wanted if gaps else ())
    index, offsets = _in_order(table, numbers, metadata.sample_rate_hz)
    columns = {n: numbers.columns[n][index] for n in (*CLOCK, *wanted, *plates)}
    time = columns["time_s"]
    step = 1.0 / metadata.sample_rate_hz
    check_onsets(table, time[offsets[:-1]], time[offsets[1:] - 1], step)
    wrenches = None
    if metadata.plate_origins_m is not None:
        stacked = np.column_stack([columns[n] for n in plates])
        wrenches = stacked.reshape(len(time), -1, len(WRENCH))
    emg = read_emg(folder, table, metadata, time[offsets[:-1]])
    left_out = [n for n in names if n not in columns]
    remarks = (f"Sample columns left out: {', '.join(left_out)}.",) if left_out else ()
    return MovingTables(numbers, table.trials, offsets, columns, wrenches, emg, remarks)


def write_tables(
    recording: MarkerRecording | MotionRecording,
    path: Path,
    columns: Mapping[str, FloatArray],
    table: TableForm,
) -> None:
    """Write a recording's folder, which appears only when it is complete.

    Raises InputError: the folder cannot be written, or a name has no form on disk.
    """
    for name in columns:
        if name != name.strip() or not name.isprintable():
            raise InputError("cannot be a column's name", column=ascii(name).strip("'"))
    trial = _trial_numbers(recording.trials)
    samples: dict[str, FloatArray] = {
        "trial": np.repeat(trial, np.diff(recording.offsets)),
        "time_s": recording.time_s,
        **columns,
    }
    if recording.wrenches is not None:
        names = plate_columns(recording.wrenches.shape[1])
        flat = recording.wrenches.reshape(len(recording.time_s), -1)
        samples |= dict(zip(names, flat.T, strict=True))
    known = (*RECORDING_FILES, *EMG_FILES, SKELETON_FILE)
    with staged_folder(path, known=known) as folder:
        (folder / METADATA_FILE).write_text(moving_metadata_text(recording), encoding="utf-8")
        text = trials_text(recording.trials)
        (folder / TRIALS_FILE).write_text(text, encoding="utf-8", newline="")
        write_table(samples, folder, "samples", table)
        if recording.emg is not None:
            starts = recording.time_s[recording.offsets[:-1]]
            write_table(emg_columns(recording.emg, trial, starts), folder, "emg", table)
        if recording.skeleton is not None:
            text = skeleton_text(recording.skeleton)
            (folder / SKELETON_FILE).write_text(text, encoding="utf-8")


def refuse_beyond(
    table: NumberTable, names: Collection[str], limit: float, looks_like: str, expected: str
) -> None:
    """Refuse the first column with a value beyond +-`limit`; missing values pass."""
    for name in names:
        values = table.columns[name]
        beyond = np.flatnonzero(np.abs(values) > limit)
        if len(beyond):
            i = int(beyond[0])
            raise InputError(
                f"{values[i]:.6g} looks like {looks_like}",
                file=table.file,
                row=table.row(i),
                column=name,
                expected=expected,
            )


def plate_columns(plates: int) -> tuple[str, ...]:
    """Columns of K force plates: ``plate1_fx_N … plate1_mz_Nm``, then the next plate's."""
    units = ["N" if name.startswith("f") else "Nm" for name in WRENCH]
    return tuple(
        f"plate{k}_{name}_{unit}"
        for k in range(1, plates + 1)
        for name, unit in zip(WRENCH, units, strict=True)
    )


def _plate_columns(file: Path, names: tuple[str, ...], metadata: MovingMetadata) -> tuple[str, ...]:
    """The plates' columns in a table, which must be those that `recording.json` lists."""
    origins = metadata.plate_origins_m
    wanted = plate_columns(0 if origins is None else len(origins))
    possible = set(plate_columns(len(names)))
    unlisted = [n for n in names if n in possible and n not in wanted]
    if unlisted:
        listed = 0 if origins is None else len(origins)
        raise InputError(
            f"a force plate that {METADATA_FILE} does not list (it lists {listed})",
            file=file,
            column=unlisted[0],
            expected='"plates" with the origin of each',
        )
    return wanted


def _in_order(
    table: TrialTable, numbers: NumberTable, rate_hz: float
) -> tuple[slice | IntArray, IntArray]:
    """Sample indices in the order of the trial table, and each trial's start there."""
    runs, starts = trial_runs(numbers)
    check_time(numbers, starts, rate_hz)
    order = runs_of_trials(table, numbers, runs, starts)
    lengths = np.diff(starts)[order]
    offsets = np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64)
    if np.array_equal(order, np.arange(len(order))):
        return slice(None), offsets
    index = np.repeat(starts[order] - offsets[:-1], lengths) + np.arange(offsets[-1])
    return index, offsets


def _trial_numbers(trials: pd.DataFrame) -> IntArray:
    numbers = trials["trial"].to_numpy()
    if not np.issubdtype(numbers.dtype, np.integer):
        raise InputError("trial numbers are not integers", column="trial", expected="integers")
    return np.asarray(numbers, np.int64)
