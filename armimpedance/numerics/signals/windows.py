"""Cut equal windows around each onset, as wide as every trial allows."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import BoolArray, FloatArray, IntArray, frozen
from armimpedance.core.conventions import POSITION_UNIT, command_columns
from armimpedance.core.errors import InputError
from armimpedance.core.records import Recording, Window
from armimpedance.numerics.signals.sample_faults import (
    beyond_the_others,
    gone_astray,
    lower_quantile,
)

# Onset and end of a returning disturbance, from the position only.

#: Noise at rest is estimated from this much of a trial's start (s).
REST_S = 0.05
#: A trial moves if its peak is above this many times the largest excursion at rest.
MOVEMENT_FACTOR = 6.0
#: The disturbance has begun above this many times that excursion ...
LEVEL_FACTOR = 1.5
#: ... and above this share of the peak.
PEAK_FRACTION = 0.01
#: It is over within this share of the peak around the trial's end; people drift meanwhile.
END_FRACTION = 0.03


@dataclass(frozen=True)
class FoundMovement:
    """Onset and end of one disturbance on the trial's own clock (s)."""

    onset_s: float
    end_s: float


def detect_movement(position: FloatArray, time_s: FloatArray) -> FoundMovement:
    """Detect onset and end of a disturbance in one trial.

    The distance from rest crosses a level at t1 and eight times that level at t2. Smooth
    disturbances leave rest with the cube of time (bounded jerk), so that the onset is at
    ``2 t1 - t2``. The end is detected in the same way, backwards from the rest at the trial's end.

    `position` (S, d), `time_s` (S,).
    Raises InputError: if the trial is too short, does not rest at its start, or nothing moves.
    """
    rest = int(np.searchsorted(time_s, time_s[0] + REST_S))
    if rest < 5 or len(time_s) < 3 * rest:
        raise InputError(
            f"trial of {len(time_s)} samples is too short to find its onset",
            expected=f"{REST_S * 1e3:.0f} ms of rest, then the disturbance",
        )
    start = position[:rest].mean(axis=0)
    distance = np.linalg.norm(position - start, axis=1)
    noise = float(distance[:rest].max())
    peak = float(distance.max())
    level = max(PEAK_FRACTION * peak, LEVEL_FACTOR * noise)
    if peak < MOVEMENT_FACTOR * noise or peak == 0.0:
        raise InputError(
            f"nothing moves: peak {peak:.3g}, at rest {noise:.3g} (SI)",
            expected="a disturbance well above the noise at rest",
        )
    beyond = np.flatnonzero(distance > level)
    far = np.flatnonzero(distance > min(8 * level, 0.9 * peak))
    onset = 2 * time_s[beyond[0]] - time_s[far[0]]
    to_end = np.linalg.norm(position - position[-rest:].mean(axis=0), axis=1)
    level = max(END_FRACTION * to_end.max(), LEVEL_FACTOR * float(to_end[-rest:].max()))
    beyond = np.flatnonzero(to_end > level)
    far = np.flatnonzero(to_end > min(8 * level, 0.9 * to_end.max()))
    if not len(beyond):
        raise InputError(
            "the hand does not rest at the trial's end",
            expected="rest before and after the disturbance; leave the trial out, or its last rows",
        )
    end = 2 * time_s[beyond[-1]] - time_s[far[-1]]
    return FoundMovement(float(max(onset, time_s[0])), float(min(end, time_s[-1])))


#: Rest before the onset over which position, force and joint angles are averaged (s).
REST_BEFORE_ONSET_S = 0.1
#: Margin before the onset and after the end for smoothing kernels and rest (s).
MARGIN_S = 0.16
#: Trials that end within the disturbance are left out if at least this share of all does not.
MOST_WHOLE = 0.75


@dataclass(frozen=True)
class Timing:
    """Onset and end of every trial's disturbance, and their origin.

    `onset_s`, `end_s` (T,): on each trial's own clock.
    `notes`: states if times were detected.
    """

    onset_s: FloatArray
    end_s: FloatArray
    notes: tuple[str, ...] = ()


class _Table:
    """Columns of a trial table as arrays, each read once for all groups of trials."""

    def __init__(self, recording: Recording) -> None:
        self.recording = recording
        self._held: dict[str, FloatArray] = {}

    def column(self, name: str) -> FloatArray:
        """Numbers of a column (T,); NaN where it has none."""
        if name not in self._held:
            self._held[name] = _column(self.recording, name)
        return self._held[name]

    @cached_property
    def trial(self) -> IntArray:
        """Numbers of the trials (T,)."""
        return np.asarray(self.recording.trials["trial"].to_numpy(dtype=np.int64))

    @cached_property
    def flawed(self) -> BoolArray:
        """Trials marked as errors (T,), see the function `flawed`."""
        return flawed(self.recording)


def _table_of(recording: Recording, timing: Timing) -> _Table:
    """Return the trial table of a recording, which is cached in its timing."""
    table: _Table | None = getattr(timing, "_table", None)
    if table is None or table.recording is not recording:
        table = _Table(recording)
        object.__setattr__(timing, "_table", table)
    return table


def _column(recording: Recording, name: str) -> FloatArray:
    if name not in recording.trials:
        return np.full(recording.n_trials, np.nan)
    return recording.trials[name].to_numpy(dtype=float, na_value=np.nan)


def disturbance_times(recording: Recording) -> Timing:
    """Read onset and end from the trial table; missing times are detected from the position.

    Parameters
    ----------
    recording : Recording
        Recording of returning disturbances.

    Returns
    -------
    Timing
        Onset and end of every trial.

    Raises
    ------
    InputError
        If a time is missing and cannot be detected (the message names the trial), or if the hand
        was pushed while it moved, so that there is no rest before.
    """
    if recording.perturbation == "moving":
        raise InputError(
            "pushes of a hand that moves", expected="disturbances at rest; `movement` takes these"
        )
    onset, end = _column(recording, "onset_s").copy(), _column(recording, "end_s").copy()
    missing = np.flatnonzero(np.isnan(onset) | np.isnan(end))
    for row in missing:
        samples = recording.samples_of(int(row))
        try:
            detected = detect_movement(recording.position[samples], recording.time_s[samples])
        except InputError as error:
            trial = recording.trials["trial"].iloc[int(row)]
            raise InputError(f"trial {trial}: {error.problem}", expected=error.expected) from error
        onset[row] = detected.onset_s if np.isnan(onset[row]) else onset[row]
        end[row] = detected.end_s if np.isnan(end[row]) else end[row]
    if not len(missing):
        return Timing(onset, end)
    note = f"onset or end detected from the position in {len(missing)} of {len(onset)} trials"
    return Timing(onset, end, (note,))


def _onset_samples(recording: Recording, timing: Timing) -> IntArray:
    """Number of the onset's sample within each trial: the last sample at or before the onset."""
    start = recording.time_s[recording.offsets[:-1]]
    return np.floor((timing.onset_s - start) * recording.sample_rate_hz + 1e-6).astype(np.int64)


def _cleared(cut: FloatArray, usable: BoolArray) -> FloatArray:
    """Set the windows of unusable trials to zero."""
    if not usable.all():
        cut[~usable] = 0.0
    return frozen(cut)


def cut_windows(
    recording: Recording, rows: ArrayLike | None = None, timing: Timing | None = None
) -> Window:
    """Cut equal windows from 0.16 s before the onset to 0.16 s after the longest disturbance.

    If trials are shorter, the window shrinks to the extent of 90 % of them. The others are marked
    unusable, as are single trials in which the hand does not return or moves for far longer than in
    the others.

    Parameters
    ----------
    recording : Recording
        Recording of returning disturbances.
    rows : array of int, optional
        Rows of the trial table, from 0; default all.
    timing : Timing, optional
        Timing of all trials of the recording; default: `disturbance_times`.

    Returns
    -------
    Window

    Raises
    ------
    InputError
        If no trial contains its whole disturbance.
    """
    timing = timing or disturbance_times(recording)
    table = _table_of(recording, timing)
    rows = np.arange(recording.n_trials) if rows is None else np.asarray(rows)
    rate, first = recording.sample_rate_hz, _onset_samples(recording, timing)[rows]
    duration = (timing.end_s - timing.onset_s)[rows]
    before, after, usable, notes = _extent(table, rows, first, duration)
    lag = np.arange(-before, after + 1)
    start = np.where(usable, recording.offsets[rows] + first - before, 0)

    place = _stretches(recording.position, start, len(lag))
    end = before + np.round(duration * rate).astype(np.int64)
    astray = gone_astray(place, before, end, usable)
    if astray.any():
        notes += (_exclusion_note(table, rows, astray, "the hand goes away and does not return"),)
        usable = usable & ~astray

    def gather(samples: FloatArray) -> FloatArray:
        return _cleared(_stretches(samples, start, len(lag)), usable)

    position, force = _cleared(place, usable), gather(recording.force)
    commanded = _commanded(recording)
    rest = slice(max(0, before + 1 - round(REST_BEFORE_ONSET_S * rate)), before + 1)
    at_rest = start[:, None] + np.arange(rest.start, rest.stop)
    return Window(
        sample_rate_hz=rate,
        lag_s=lag / rate,
        position=position,
        force=force,
        duration_s=duration,
        trial=table.trial[rows],
        usable=usable,
        position_at_onset=_mean_over_time(position[:, rest]),
        force_at_onset=_mean_over_time(force[:, rest]),
        joint_angles_at_onset=_joint_angles(table, rows, at_rest),
        disturbance=_disturbance(table, rows),
        notes=timing.notes + notes,
        commanded=None if commanded is None else gather(commanded),
    )


def _mean_over_time(signals: FloatArray) -> FloatArray:
    """Means (T, d) of (T, S, d) over time; faster than `numpy.mean` for few axes."""
    return np.asarray(np.einsum("tsd->td", signals) / signals.shape[1])


def _stretches(samples: FloatArray, start: IntArray, length: int) -> FloatArray:
    """Copy `length` samples from each start on, (T, length, d)."""
    # a window over rows is contiguous in memory: no index for each sample is needed
    windows = np.lib.stride_tricks.sliding_window_view(samples, length, axis=0)
    return np.ascontiguousarray(windows.transpose(0, 2, 1)[start])


def _extent(
    table: _Table, rows: np.ndarray, first: IntArray, duration_s: FloatArray
) -> tuple[int, int, np.ndarray, tuple[str, ...]]:
    """Samples before and after the onset, usable trials (T,), and notes on those left out."""
    recording = table.recording
    rate, later = recording.sample_rate_hz, np.diff(recording.offsets)[rows] - 1 - first
    lasting = beyond_the_others(duration_s)
    needed = int(np.ceil(float(duration_s[~lasting].max()) * rate - 1e-6))
    before, after = _common_extent(first, later, needed, rate)
    long_enough = (first >= before) & (later >= after)
    errors = table.flawed[rows]
    if errors.all():
        raise InputError(
            f"all {len(errors)} trials are marked as errors",
            column="is_error",
            expected="one that is not",
        )
    usable = long_enough & ~errors & ~lasting
    if after < needed or not usable.any():
        shortest = int(np.argmin(later))
        trial = table.trial[rows][shortest]
        stated = not np.isnan(_column(recording, "onset_s")[rows][shortest])
        detected = "" if stated else ", which was detected from the position"
        way_out = "" if stated else ", or onset_s in the trial table"
        raise InputError(
            f"trial {trial} ends {later[shortest] / rate:.3f} s after its onset{detected}",
            expected=f"at least the disturbance of {needed / rate:.3f} s{way_out}",
        )
    margins = (
        f"{1e3 * before / rate:.0f} ms before the onset and {1e3 * after / rate:.0f} ms after it"
    )
    short = f"too short around the disturbance: the others hold {margins}; cut trials no shorter"
    notes = _left_out(long_enough | errors | lasting, short)
    notes += _left_out(~errors, "marked as an error when recorded")
    if lasting.any():
        reason = _long_movement(recording, rows[lasting], first[lasting], duration_s[lasting])
        notes += (_exclusion_note(table, rows, lasting, reason),)
    return before, after, usable, notes


def _joint_angles(table: _Table, rows: np.ndarray, at_rest: IntArray) -> FloatArray | None:
    """Arm posture before the onset: from the samples, or from the trial table; None if unknown."""
    measured = table.recording.joint_angles
    if measured is not None:
        return np.asarray(measured[at_rest].mean(axis=1))
    columns = [table.column(name)[rows] for name in ("q_shoulder_rad", "q_elbow_rad")]
    angles = np.column_stack(columns)
    return angles if np.isfinite(angles).all() else None


def _commanded(recording: Recording) -> FloatArray | None:
    """Commanded motion (N, d); None unless every axis has its column."""
    names = command_columns(recording.kind, recording.axes)
    if not all(name in recording.extra for name in names):
        return None
    return np.column_stack([recording.extra[name] for name in names])


def _disturbance(table: _Table, rows: np.ndarray) -> IntArray | None:
    """Number of each trial's disturbance, by direction in the trial table; None if one is unknown.

    In space a direction also has its angle above the plane (column ``elevation_deg``).
    """
    direction = table.column("direction_deg")[rows]
    if not np.isfinite(direction).all():
        return None
    around = np.round(direction % 360.0, 3) % 360.0
    above = np.round(np.nan_to_num(table.column("elevation_deg")[rows]), 3)
    both = np.stack([above, around], axis=1)
    return np.unique(both, axis=0, return_inverse=True)[1].ravel().astype(np.int64)


def _common_extent(
    before: IntArray, after: IntArray, needed: int, sample_rate_hz: float
) -> tuple[int, int]:
    """Samples before and after the onset that 90 % of the trials have, at most the margins.

    If more than a tenth and at most a quarter of the trials end within the disturbance, 90 % of the
    other trials count: one of eight trials may be cut short.
    """
    margin = round(MARGIN_S * sample_rate_hz)
    whole = after >= needed
    if lower_quantile(after, 0.1) < needed and np.mean(whole) >= MOST_WHOLE:
        before, after = before[whole], after[whole]
    return (
        min(margin, int(lower_quantile(before, 0.1))),
        min(needed + margin, int(lower_quantile(after, 0.1))),
    )


def flawed(recording: Recording) -> BoolArray:
    """True for trials that the recording system marked as errors (column ``is_error``)."""
    marks = _column(recording, "is_error")
    return np.asarray(np.nan_to_num(marks) != 0)


def _long_movement(
    recording: Recording, rows: np.ndarray, first: IntArray, duration_s: FloatArray
) -> str:
    """Problem of trials that last far longer than the others, as a sentence."""
    onset = recording.offsets[rows] + first
    end = onset + np.round(duration_s * recording.sample_rate_hz).astype(np.int64)
    last = recording.offsets[rows + 1] - 1
    displacement = recording.position[np.minimum(end, last)] - recording.position[onset]
    far = float(np.linalg.norm(displacement, axis=1).max())
    unit = POSITION_UNIT[recording.kind]
    return (
        f"moves for {duration_s.max():.2g} s, far longer than others, and ends {far:.2g} {unit} "
        "from its start: not a disturbance"
    )


def _exclusion_note(table: _Table, rows: np.ndarray, out: np.ndarray, reason: str) -> str:
    """Sentence on the trials that are left out, with their numbers and the reason."""
    numbers = table.trial[rows][out]
    first = ", ".join(map(str, numbers[:5])) + (", ..." if len(numbers) > 5 else "")
    return f"{len(numbers)} of {len(out)} trials left out (trial {first}): {reason}"


def _left_out(kept: np.ndarray, reason: str) -> tuple[str, ...]:
    missing = int((~kept).sum())
    return (f"{missing} of {len(kept)} trials left out: {reason}",) if missing else ()
