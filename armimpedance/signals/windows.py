"""Cut equal windows around each onset, as wide as every trial allows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armimpedance.errors import InputError
from armimpedance.records import FloatArray, IntArray, Recording, Window
from armimpedance.signals.onset import detect_movement

#: State at the onset (position, force, joint angles) is a mean over this much rest before it (s).
REST_BEFORE_ONSET_S = 0.1
#: Ends that were detected rather than given are late by up to this much (s).
MARGIN_S = 0.2


@dataclass(frozen=True)
class Timing:
    """Onset and end of every trial's disturbance, and where they come from.

    Attributes
    ----------
    onset_s, end_s : (T,)
        On each trial's own clock.
    notes : tuple of str
        Says so where times were detected.
    """

    onset_s: FloatArray
    end_s: FloatArray
    notes: tuple[str, ...] = ()


def _column(recording: Recording, name: str) -> FloatArray:
    if name not in recording.trials:
        return np.full(recording.n_trials, np.nan)
    return recording.trials[name].to_numpy(dtype=float, na_value=np.nan)


def disturbance_times(recording: Recording) -> Timing:
    """Onset and end from the trial table; what is missing there is detected from the position.

    Raises
    ------
    InputError
        If a time has to be detected and cannot be; names the trial.
    """
    onset, end = _column(recording, "onset_s").copy(), _column(recording, "end_s").copy()
    missing = np.flatnonzero(np.isnan(onset) | np.isnan(end))
    for row in missing:
        samples = recording.samples_of(int(row))
        try:
            found = detect_movement(recording.position[samples], recording.time_s[samples])
        except InputError as error:
            trial = recording.trials["trial"].iloc[int(row)]
            raise InputError(f"trial {trial}: {error.problem}", expected=error.expected) from error
        onset[row] = found.onset_s if np.isnan(onset[row]) else onset[row]
        end[row] = found.end_s if np.isnan(end[row]) else end[row]
    if not len(missing):
        return Timing(onset, end)
    note = f"onset or end detected from the position in {len(missing)} of {len(onset)} trials"
    return Timing(onset, end, (note,))


def _onset_samples(recording: Recording, timing: Timing) -> IntArray:
    """Number of the onset's sample within each trial: the last one at or before the onset."""
    start = recording.time_s[recording.offsets[:-1]]
    return np.floor((timing.onset_s - start) * recording.sample_rate_hz + 1e-6).astype(np.int64)


def cut_windows(recording: Recording, timing: Timing | None = None) -> Window:
    """Equal windows from 0.2 s before the onset to 0.2 s after the longest disturbance's end.

    Where trials hold less, the window shrinks to what 90 % of them hold; the others are marked
    unusable.

    Parameters
    ----------
    recording : Recording
        Of returning disturbances.
    timing : Timing, optional
        Default: `disturbance_times`.

    Returns
    -------
    Window

    Raises
    ------
    InputError
        If no trial holds its own disturbance.
    """
    timing = timing or disturbance_times(recording)
    rate = recording.sample_rate_hz
    first = _onset_samples(recording, timing)
    lengths = np.diff(recording.offsets)
    duration = timing.end_s - timing.onset_s
    needed = int(np.ceil(duration.max() * rate - 1e-6))
    margin = round(MARGIN_S * rate)
    before = min(margin, int(np.quantile(first, 0.1, method="lower")))
    room = lengths - 1 - first
    after = min(needed + margin, int(np.quantile(room, 0.1, method="lower")))
    usable = (first >= before) & (room >= after)
    if after < needed or not usable.any():
        row = int(np.argmin(room))
        trial = recording.trials["trial"].iloc[row]
        raise InputError(
            f"trial {trial} ends {room[row] / rate:.3f} s after its onset",
            expected=f"at least the disturbance of {needed / rate:.3f} s",
        )
    lag = np.arange(-before, after + 1)
    index = (recording.offsets[:-1] + np.where(usable, first, before))[:, None] + lag
    index = np.where(usable[:, None], index, 0)
    keep = usable[:, None, None]
    rest = _means_before(recording, first, usable)
    return Window(
        sample_rate_hz=rate,
        lag_s=lag / rate,
        position=np.where(keep, recording.position[index], 0.0),
        force=np.where(keep, recording.force[index], 0.0),
        duration_s=duration,
        trial=recording.trials["trial"].to_numpy(dtype=np.int64),
        usable=usable,
        position_at_onset=rest(recording.position),
        force_at_onset=rest(recording.force),
        joint_angles_at_onset=(
            None if recording.joint_angles is None else rest(recording.joint_angles)
        ),
        notes=timing.notes + _left_out(usable),
    )


def _left_out(usable: np.ndarray) -> tuple[str, ...]:
    missing = int((~usable).sum())
    if not missing:
        return ()
    return (f"{missing} of {len(usable)} trials left out: too short around the disturbance",)


def _means_before(recording: Recording, first: IntArray, usable: np.ndarray):  # type: ignore[no-untyped-def]
    """A function that averages a sample array over the rest before each usable trial's onset."""
    width = round(REST_BEFORE_ONSET_S * recording.sample_rate_hz)
    stop = recording.offsets[:-1] + np.where(usable, first, 0) + 1
    start = np.maximum(stop - width, recording.offsets[:-1])

    def means(samples: FloatArray) -> FloatArray:
        sums = np.vstack([np.zeros(samples.shape[1]), np.cumsum(samples, axis=0)])
        return (sums[stop] - sums[start]) / (stop - start)[:, None]

    return means
