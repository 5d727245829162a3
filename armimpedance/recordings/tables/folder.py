"""A recording's folder: `recording.json`, `trials.csv`, `samples.parquet` or `.csv`."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Final, Literal

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet as pq

from armimpedance.core.arrays import FloatArray, IntArray, frozen
from armimpedance.core.conventions import force_columns, position_columns
from armimpedance.core.errors import InputError
from armimpedance.core.outputs import staged_folder
from armimpedance.core.records import Recording
from armimpedance.recordings.tables.metadata import Metadata, metadata_text, read_metadata
from armimpedance.recordings.tables.number_table import NumberTable
from armimpedance.recordings.tables.sample_table import (
    EMG_PREFIX,
    Samples,
    arm_angle_columns,
    read_samples,
    sample_columns,
)
from armimpedance.recordings.tables.trial_table import (
    TrialTable,
    check_onsets,
    read_trials,
    trials_text,
)

METADATA_FILE: Final = "recording.json"
TRIALS_FILE: Final = "trials.csv"


def is_recording_folder(path: Path) -> bool:
    """True if `path` is a folder with a `recording.json`."""
    return (path / METADATA_FILE).is_file()


def read_folder(path: str | os.PathLike[str]) -> Recording:
    """Read a recording from a folder and check it.

    A force exerted by the device is reversed in sign here; the provenance states this and the keys
    and columns that were not read. A folder with both sample files is refused, as they may differ.

    `path`: the folder.
    Raises InputError: the recording is wrong; the error names file, row and column.
    """
    folder = Path(path)
    if not folder.is_dir():
        raise InputError("no such folder", file=path, expected="a recording's folder")
    metadata = read_metadata(folder / METADATA_FILE)
    table = read_trials(folder / TRIALS_FILE)
    samples = read_samples(table_file(folder), metadata)
    order = runs_of_trials(table, samples.table, samples.trials, samples.offsets)
    starts, ends = samples.offsets[order], samples.offsets[order + 1]
    time = samples.table.columns["time_s"]
    check_onsets(table, time[starts], time[ends - 1], 1.0 / metadata.sample_rate_hz)
    return recording_of_tables(metadata, table, samples, order)


def write_folder(
    recording: Recording,
    path: str | os.PathLike[str],
    table: Literal["parquet", "csv"] = "parquet",
) -> None:
    """Write a recording to a folder that appears only when it is complete.

    `read_folder` returns exactly the same recording.

    `path`: a new or empty folder, or an earlier recording, which is replaced.
    `table`: the form of the samples.
    Raises InputError: the folder cannot be written, or a column cannot be stored.
    """
    samples = _sample_arrays(recording)
    with staged_folder(path) as folder:
        (folder / METADATA_FILE).write_text(metadata_text(recording), encoding="utf-8")
        (folder / TRIALS_FILE).write_text(
            trials_text(recording.trials), encoding="utf-8", newline=""
        )
        if table == "parquet":
            pq.write_table(samples, folder / "samples.parquet")
        else:
            write_csv(samples, folder / "samples.csv")


def table_file(folder: Path, stem: str = "samples") -> Path:
    """The table of this name in a folder, Parquet or CSV.

    Raises InputError: there is none, or both.
    """
    names = [f"{stem}.parquet", f"{stem}.csv"]
    existing = [folder / name for name in names if (folder / name).is_file()]
    if len(existing) == 2:
        raise InputError(
            f"holds {' and '.join(names)}, which may differ",
            file=folder,
            expected="one of them",
        )
    if not existing:
        raise InputError(f"no {stem}", file=folder, expected=" or ".join(names))
    return existing[0]


def runs_of_trials(
    table: TrialTable, samples: NumberTable, trials: IntArray, offsets: IntArray
) -> IntArray:
    """The index of the run in the sample table for each row of the trial table.

    Raises InputError: a trial has no samples, or samples have no trial.
    """
    run_of = {int(trial): run for run, trial in enumerate(trials)}
    listed = table.trials["trial"].tolist()
    for row, trial in enumerate(listed):
        if trial not in run_of:
            expected = f"some in {samples.file.name}"
            raise table.error(f"trial {trial} has no samples", row, "trial", expected)
    known = set(listed)
    unknown = [run for trial, run in run_of.items() if trial not in known]
    if unknown:
        raise InputError(
            f"trial {trials[unknown[0]]} is not in {TRIALS_FILE}",
            file=samples.file,
            row=samples.row(int(offsets[unknown[0]])),
            column="trial",
            expected="the number of a trial of that table",
        )
    return np.array([run_of[trial] for trial in listed], dtype=np.int64)


def _in_order(file_offsets: IntArray, order: IntArray) -> tuple[IntArray, IntArray | None]:
    """Offsets of the trials in `order` and the file's rows; None if the order is the file's."""
    lengths = np.diff(file_offsets)[order]
    offsets = np.concatenate([[0], np.cumsum(lengths)])
    if np.array_equal(order, np.arange(len(order))):
        return offsets, None
    return offsets, np.repeat(file_offsets[order] - offsets[:-1], lengths) + np.arange(offsets[-1])


def recording_of_tables(
    metadata: Metadata, table: TrialTable, samples: Samples, order: IntArray
) -> Recording:
    """Build a recording from its three checked tables.

    `order` (T,) int: as from `runs_of_trials`.
    """
    columns = samples.columns
    offsets, index = _in_order(samples.offsets, order)
    sign = -1.0 if metadata.force_by == "device" else 1.0

    def in_its_order(values: FloatArray) -> FloatArray:
        return values if index is None else frozen(values[index])

    def stack(names: tuple[str, ...]) -> FloatArray | None:
        return samples.stack(names, index) if names else None

    known = set(columns.named)
    extra = {k: in_its_order(v) for k, v in samples.table.columns.items() if k not in known}
    return Recording(
        kind=metadata.kind,
        sample_rate_hz=metadata.sample_rate_hz,
        trials=table.trials,
        offsets=offsets,
        time_s=in_its_order(samples.table.columns["time_s"]),
        position=samples.stack(columns.position, index),
        force=samples.stack(columns.force, index, sign),
        joint_angles=stack(columns.joint_angles),
        emg=stack(columns.emg),
        muscles=columns.muscles if columns.emg else metadata.muscles or (),
        emg_unit=metadata.emg_unit,
        perturbation=metadata.perturbation,
        torque=metadata.torque,
        imposed=metadata.imposed,
        handle_mass_kg=metadata.handle_mass_kg,
        force_lowpass_hz=metadata.force_lowpass_hz,
        force_lowpass_order=metadata.force_lowpass_order,
        shoulder_m=None if metadata.shoulder_m is None else np.array(metadata.shoulder_m),
        gravity_m_s2=metadata.gravity_m_s2,
        subject=metadata.subject,
        extra=extra,
        provenance=(*metadata.provenance, *_remarks(metadata, samples)),
    )


def _remarks(metadata: Metadata, samples: Samples) -> list[str]:
    remarks = []
    if metadata.force_by == "device":
        remarks.append("The recorded force was by the device on the limb: its sign was turned.")
    if metadata.ignored:
        remarks.append(f"Not read from {METADATA_FILE}: {', '.join(metadata.ignored)}.")
    if samples.table.dropped:
        names = ", ".join(samples.table.dropped)
        remarks.append(f"Sample columns left out, not finite numbers throughout: {names}.")
    return remarks


def _sample_arrays(recording: Recording) -> pa.Table:
    """The sample table of a recording, with columns in the order of the format."""
    kind, axes = recording.kind, recording.axes
    if kind == "hand" and axes < 2:
        raise InputError("a hand with one axis has no form on disk", expected="x and y")
    numbers = recording.trials["trial"].to_numpy()
    if not np.issubdtype(numbers.dtype, np.integer):
        raise InputError("trial numbers are not integers", column="trial", expected="integers")
    columns = {
        "trial": np.repeat(numbers, np.diff(recording.offsets)),
        "time_s": recording.time_s,
        **_named(position_columns(kind, axes), recording.position),
        **_named(force_columns(kind, axes), recording.force),
    }
    if recording.joint_angles is not None:
        names = arm_angle_columns(kind, recording.joint_angles.shape[1])
        columns |= _named(names, recording.joint_angles)
    if recording.emg is not None:
        columns |= _named(tuple(EMG_PREFIX + m for m in recording.muscles), recording.emg)
    # An extra column must not be mistaken for a known column when it is read back.
    known, written = tuple(columns), tuple(columns) + tuple(recording.extra)
    read_back = sample_columns(written, kind, recording.muscles).named
    clash = set(known) & set(recording.extra) or set(read_back) ^ set(known)
    clash |= {name for name in recording.extra if name != name.strip()}
    if clash:
        expected = "a name without a meaning of its own"
        raise InputError("a further sample column", column=sorted(clash)[0], expected=expected)
    return pa.table(columns | dict(recording.extra))


def _named(names: tuple[str, ...], values: FloatArray) -> dict[str, FloatArray]:
    return dict(zip(names, values.T, strict=True))


def write_csv(samples: pa.Table, file: Path) -> None:
    """Write a table so that every number is read back exactly."""
    # Arrow prints the shortest text that is read back as the same number.
    with file.open("wb") as stream:
        stream.write((",".join(_quoted(name) for name in samples.column_names) + "\n").encode())
        pyarrow.csv.write_csv(samples, stream, pyarrow.csv.WriteOptions(include_header=False))


def _quoted(name: str) -> str:
    plain = not any(mark in name for mark in ',"\n\r')
    return name if plain else '"' + name.replace('"', '""') + '"'
