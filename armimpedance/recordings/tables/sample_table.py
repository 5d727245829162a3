"""The sample table of a recording: its columns, checks of their values, and its clock."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray, IntArray, frozen
from armimpedance.core.conventions import (
    AXES,
    LARGEST_ANGLE_RAD,
    Kind,
    force_columns,
    position_columns,
)
from armimpedance.core.errors import InputError
from armimpedance.recordings.tables.metadata import LARGEST_COORDINATE_M, Metadata
from armimpedance.recordings.tables.number_table import NumberTable, column_names, read_numbers

# The clock of a sample table: time increases in steps of 1 / rate.

#: The largest deviation of a step from 1 / rate, relative to it (jitter of the clock)...
STEP_TOLERANCE: Final = 0.1
#: ... and of the time since the trial's start: half a sample and the inaccuracy of a quartz clock.
DRIFT_TOLERANCE_SAMPLES: Final = 0.5
CLOCK_TOLERANCE: Final = 1e-4
#: Samples that are checked together, few enough to need little memory in a long recording.
TOGETHER: Final = 1 << 18


def check_time(table: NumberTable, offsets: IntArray, rate_hz: float) -> None:
    """Check that time increases in steps of 1 / rate.

    Times are printed with a number of decimals: if the step is not a multiple of the last decimal,
    rounding may shift each time by one unit of it, and the tolerances grow by this amount. If this
    unit is longer than a step, several samples may have the same printed time.
    """
    time, dt = table.columns["time_s"], 1.0 / rate_hz
    _check_finite(table, time)
    rounding = _rounding(time[:2000], dt)
    # the first sample that breaks each rule, in the order of reporting
    wrong: dict[int, tuple[int, str]] = {}
    for piece in _pieces(time, offsets, dt):
        for rule, (broken, problem) in enumerate(_rules(piece, dt, rounding)):
            if rule not in wrong and broken.any():
                at = int(np.argmax(broken))
                message = problem.format(step=piece.step[at], elapsed=piece.elapsed[at])
                wrong[rule] = (piece.first + at, message)
    if wrong:
        sample, message = wrong[min(wrong)]
        expected = f"steps of {dt:.6g} s at {rate_hz:g} Hz"
        row = table.row(sample)
        raise InputError(message, file=table.file, row=row, column="time_s", expected=expected)


def _check_finite(table: NumberTable, time: FloatArray) -> None:
    """Refuse infinite times, whose differences are NaN and would pass every rule."""
    if time.size == 0 or np.isfinite([time.min(), time.max()]).all():
        return
    sample = int(np.argmin(np.isfinite(time)))
    problem, row = f"{time[sample]:g} is no time", table.row(sample)
    raise InputError(problem, file=table.file, row=row, column="time_s", expected="seconds")


@dataclass(frozen=True)
class _Piece:
    """Samples from `first` on, each with its step, and time and samples since its trial began."""

    first: int
    step: FloatArray
    elapsed: FloatArray
    index: IntArray


def _pieces(time: FloatArray, offsets: IntArray, dt: float) -> Iterator[_Piece]:
    for first in range(0, len(time), TOGETHER):
        last = min(first + TOGETHER, len(time))
        step = np.diff(time[first:last], prepend=time[first - 1] if first else time[0] - dt)
        # the trials with samples in this piece, and their numbers of samples
        low = int(np.searchsorted(offsets, first, side="right")) - 1
        high = int(np.searchsorted(offsets, last, side="left"))
        starts: IntArray = offsets[low:high]
        lengths = np.asarray(np.diff(offsets[low : high + 1].clip(first, last)), dtype=np.int64)
        step[starts[starts >= first] - first] = dt
        elapsed = time[first:last] - np.repeat(time[starts], lengths)
        yield _Piece(first, step, elapsed, np.arange(first, last) - np.repeat(starts, lengths))


def _rules(piece: _Piece, dt: float, rounding: float) -> Iterator[tuple[BoolArray, str]]:
    """For each rule: the samples (S,) where the clock breaks it, and the message."""
    step, elapsed = piece.step, piece.elapsed
    yield (step < 0) | ((step == 0) & (rounding < dt)), "time does not run forward"
    gaps = np.abs(step - dt) > STEP_TOLERANCE * dt + rounding
    yield gaps, "a step of {step:.6g} s: a gap, or another rate"
    slack = DRIFT_TOLERANCE_SAMPLES * dt + rounding + CLOCK_TOLERANCE * elapsed
    drifts = np.abs(elapsed - piece.index * dt) > slack
    yield drifts, "{elapsed:.6g} s after the trial's start, which disagrees with the rate"


def _rounding(time: FloatArray, dt: float) -> float:
    """The largest rounding of printed times: the last decimal's unit, 0 if steps are exact."""
    for decimals in range(10):
        with np.errstate(over="ignore", invalid="ignore"):
            scaled = time * 10.0**decimals
            off = np.abs(scaled - np.round(scaled)).max()
        if off < 1e-6:
            steps = dt * 10.0**decimals
            exact = round(steps) > 0 and abs(steps - round(steps)) < 1e-9 * steps
            return 0.0 if exact else 10.0**-decimals
    return 0.0


ARM_ANGLE_COLUMNS: Final[tuple[str, ...]] = ("q_shoulder_rad", "q_elbow_rad")
EMG_PREFIX: Final = "emg_"

#: A hand's workspace is a disc of at most twice the arm's length, about 0.9 m in a tall person. A
#: 5 mm disturbance given in mm spans 5 "m" even if positions are relative to its start.
LARGEST_SPAN_M: Final = 2.5

#: From shoulder to hand: the arm's length of 0.9 m and a margin for an inexact seat.
LARGEST_REACH_M: Final = 3.0


@dataclass(frozen=True)
class SampleColumns:
    """The names of a sample table's columns by meaning."""

    position: tuple[str, ...]
    force: tuple[str, ...]
    joint_angles: tuple[str, ...]
    emg: tuple[str, ...]
    muscles: tuple[str, ...]

    @property
    def named(self) -> tuple[str, ...]:
        """All known columns; the rest is `Recording.extra`."""
        kinematics = (*self.position, *self.force, *self.joint_angles)
        return ("trial", "time_s", *kinematics, *self.emg)


@dataclass(frozen=True)
class Samples:
    """All samples in the order of the file, with one run of samples per trial.

    `trials` (T,) int: trial numbers in the order of their samples.
    `offsets` (T + 1,) int: first sample of each trial.
    """

    table: NumberTable
    columns: SampleColumns
    trials: IntArray
    offsets: IntArray

    def stack(
        self, names: tuple[str, ...], order: IntArray | None = None, sign: float = 1.0
    ) -> FloatArray:
        """These columns side by side, (N, len(names)), times `sign`; read-only.

        `order` (N,), if given, are the sample indices in the wanted order.
        """
        stacked = np.empty((len(self.table.columns["time_s"]), len(names)))
        for number, name in enumerate(names):
            values = self.table.columns[name]
            np.multiply(values if order is None else values[order], sign, out=stacked[:, number])
        return frozen(stacked)


def read_samples(file: Path, metadata: Metadata) -> Samples:
    """Read the sample table and check it as far as possible without the trial table.

    Raises InputError: a column is missing, a cell is not a finite number, a trial's samples are not
    contiguous, time disagrees with the rate, or values cannot have the unit of their column.
    """
    columns = sample_columns(column_names(file), metadata.kind, metadata.muscles)
    table = read_numbers(file, columns.named)
    trials, offsets = trial_runs(table)
    samples = Samples(table, columns, trials, offsets)
    check_axes(samples, metadata, file.with_name("recording.json"))
    check_samples(samples, metadata)
    return samples


def check_axes(samples: Samples, metadata: Metadata, stated_in: Path) -> None:
    """Check that metadata stated per axis has as many numbers as there are axes."""
    axes = len(samples.columns.position)
    for key, vector in (("shoulder_m", metadata.shoulder_m), ("gravity", metadata.gravity_m_s2)):
        if vector is not None and len(vector) != axes:
            expected = f"one per axis: {axes}"
            raise InputError(
                f"{len(vector)} numbers", file=stated_in, column=key, expected=expected
            )


def check_samples(samples: Samples, metadata: Metadata) -> None:
    """Check time against the rate, and values against the units of their columns."""
    columns = samples.columns
    check_time(samples.table, samples.offsets, metadata.sample_rate_hz)
    if metadata.kind == "hand":
        _check_metres(samples, metadata)
        angles = columns.joint_angles
    else:
        angles = (*columns.position, *columns.joint_angles)
    _check_radians(samples, angles)


def arm_angle_columns(kind: Kind, joints: int) -> tuple[str, ...]:
    """Names of the columns of the arm's measured joint angles.

    Two joints are shoulder and elbow. With another number of joints a recording of the hand has
    `q1_rad, q2_rad, …`, which in a recording of joints are the names of the positions.
    """
    if joints == len(ARM_ANGLE_COLUMNS):
        return ARM_ANGLE_COLUMNS
    if kind == "joint":
        raise InputError(
            f"a recording of joints with {joints} further joint angles has no form on disk",
            expected="shoulder and elbow",
        )
    return position_columns("joint", joints)


def sample_columns(
    names: Collection[str], kind: Kind, muscles: tuple[str, ...] | None
) -> SampleColumns:
    """The columns of a sample table by meaning.

    `names`: the columns of the table; some columns in the result may be missing among them.
    `muscles`: the muscles that the recording lists; None: as in the table.
    """
    limit = len(AXES) if kind == "hand" else len(names)
    present = [
        position in names or force in names
        for position, force in zip(
            position_columns(kind, limit), force_columns(kind, limit), strict=True
        )
    ]
    axes = max(
        2 if kind == "hand" else 1, *(i for i, exists in enumerate(present, start=1) if exists), 0
    )
    emg = [n for n in names if n.startswith(EMG_PREFIX) and n != EMG_PREFIX]
    recorded = tuple(n.removeprefix(EMG_PREFIX) for n in emg)
    if muscles is None:
        muscles = recorded
    elif not set(muscles) & set(recorded):
        muscles = ()
    return SampleColumns(
        position=position_columns(kind, axes),
        force=force_columns(kind, axes),
        joint_angles=_joint_angle_columns(names, kind),
        emg=tuple(EMG_PREFIX + muscle for muscle in muscles),
        muscles=muscles,
    )


def _joint_angle_columns(names: Collection[str], kind: Kind) -> tuple[str, ...]:
    if set(ARM_ANGLE_COLUMNS) & set(names):
        return ARM_ANGLE_COLUMNS
    if kind == "joint":
        return ()
    numbered = [n for n in range(1, len(names) + 1) if f"q{n}_rad" in names]
    return position_columns("joint", max(numbered, default=0))


def trial_runs(table: NumberTable) -> tuple[IntArray, IntArray]:
    """Trial numbers and the offsets of their samples; every trial must be contiguous.

    Raises InputError: a number is not an integer, or a trial continues after another one.
    """
    trial = table.columns["trial"]
    broken = np.flatnonzero((trial != np.round(trial)) | (np.abs(trial) > 2**53))
    if len(broken):
        raise InputError(
            f"not a whole number: {trial[broken[0]]:g}",
            file=table.file,
            row=table.row(int(broken[0])),
            column="trial",
            expected="the number of a trial",
        )
    starts = np.concatenate([[0], np.flatnonzero(np.diff(trial)) + 1])
    numbers = trial[starts].astype(np.int64)
    seen, first = np.unique(numbers, return_index=True)
    if len(seen) < len(numbers):
        again = int(np.setdiff1d(np.arange(len(numbers)), first)[0])
        raise InputError(
            f"trial {numbers[again]} goes on after other trials",
            file=table.file,
            row=table.row(int(starts[again])),
            column="trial",
            expected="each trial's samples in one piece",
        )
    return numbers, np.append(starts, len(trial)).astype(np.int64)


def _check_metres(samples: Samples, metadata: Metadata) -> None:
    """Refuse positions that no hand can reach; most are in millimetres."""
    columns, shoulder = samples.columns.position, metadata.shoulder_m
    limit = LARGEST_COORDINATE_M if shoulder is None else LARGEST_REACH_M
    for name, origin in zip(columns, shoulder or (0.0,) * len(columns), strict=True):
        _refuse_beyond(samples, name, origin, limit, "metres", "millimetres")
        values = samples.table.columns[name]
        middle = float(values.max() + values.min()) / 2.0
        _refuse_beyond(samples, name, middle, LARGEST_SPAN_M / 2.0, "metres", "millimetres")


def _check_radians(samples: Samples, columns: tuple[str, ...]) -> None:
    for name in columns:
        _refuse_beyond(samples, name, 0.0, LARGEST_ANGLE_RAD, "radians", "degrees")


def _refuse_beyond(
    samples: Samples, column: str, middle: float, limit: float, wanted: str, looks_like: str
) -> None:
    """Refuse a column with a value further than `limit` from `middle`."""
    values = samples.table.columns[column]
    if values.max() <= middle + limit and values.min() >= middle - limit:
        return
    sample = int(np.argmax((values > middle + limit) | (values < middle - limit)))
    raise InputError(
        f"{values[sample]:.6g} looks like {looks_like}",
        file=samples.table.file,
        row=samples.table.row(sample),
        column=column,
        expected=wanted,
    )
