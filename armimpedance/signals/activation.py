"""How active each muscle was before the disturbances of a group of trials."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armimpedance.errors import InputError
from armimpedance.records import FloatArray, IntArray, Recording, frozen_array
from armimpedance.signals.emg import activation

#: Less rest than this before the onset says little of a muscle's activity.
LEAST_REST_S = 0.1


@dataclass(frozen=True)
class MeanActivation:
    """Activation of the m muscles of a recording, the mean over trials.

    Attributes
    ----------
    mean : (m,)
        0..1.
    sd : (m,) or None
        Standard error from the scatter between trials; None for a single trial.
    notes : tuple of str
        How it was found.
    """

    mean: FloatArray
    sd: FloatArray | None
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "mean", frozen_array(self.mean, "activation", (None,)))
        if self.sd is not None:
            sd = frozen_array(self.sd, "sd of the activation", self.mean.shape)
            object.__setattr__(self, "sd", sd)


def mvc_column(muscle: str) -> str:
    """The column of trials.csv with a muscle's envelope in its maximum voluntary contraction."""
    return f"mvc_{muscle}_V"


def mean_activation(
    recording: Recording, rows: IntArray, onset_s: FloatArray
) -> MeanActivation | None:
    """Activation over the rest before each onset: what the source's 1 Hz envelope shows there.

    A low-pass of 1 Hz averages about a second, as long as a trial lasts: over the rest before the
    onset it is the mean of the rectified EMG, which needs no record longer than that. The
    disturbance and what it evokes are left out.

    Parameters
    ----------
    recording : Recording
        With EMG, and its MVC in the trial table (`mvc_column`) unless the EMG is normalised.
    rows : (T,) int
        Rows of the trial table, from 0.
    onset_s : (trials of the recording,)
        On each trial's own clock.

    Returns
    -------
    MeanActivation or None
        None where there is no EMG, no MVC, or no trial that rests long enough.

    Raises
    ------
    InputError
        An MVC is not positive, or activation is far above 1 (`signals.emg.activation`).
    """
    mvc = _mvc(recording, rows)
    if recording.emg is None or mvc is None:
        return None
    level = np.array([_before(recording, int(row), onset_s[row]) for row in rows])
    held = np.isfinite(level).all(axis=1)
    if not held.any():
        return None
    try:
        alpha = activation(level[held], mvc[held])
    except InputError as error:
        raise InputError(f"EMG: {error.problem}", expected=error.expected) from error
    count = len(alpha)
    sd = alpha.std(axis=0, ddof=1) / np.sqrt(count) if count > 1 else None
    note = f"activation from the EMG before the onset of {count} trials"
    return MeanActivation(alpha.mean(axis=0), sd, (note,))


def _mvc(recording: Recording, rows: IntArray) -> FloatArray | None:
    """MVC of each trial and muscle (T, m), in the unit of the EMG; None where it is missing."""
    if recording.emg_unit == "normalised":
        return np.ones((len(rows), len(recording.muscles)))
    columns = [mvc_column(muscle) for muscle in recording.muscles]
    if not columns or any(column not in recording.trials for column in columns):
        return None
    mvc = recording.trials[columns].to_numpy(dtype=float)[rows]
    return mvc if np.isfinite(mvc).all() else None


def _before(recording: Recording, row: int, onset_s: float) -> FloatArray:
    """Mean level (m,) before the onset; nan where the rest is too short."""
    samples = recording.samples_of(row)
    emg = np.asarray(recording.emg)[samples]
    at_rest = recording.time_s[samples] <= onset_s
    if at_rest.sum() < LEAST_REST_S * recording.sample_rate_hz:
        return np.full(emg.shape[1], np.nan)
    if recording.emg_unit == "V":
        # the electrode's offset is that of the whole trial
        emg = np.abs(emg - emg.mean(axis=0))
    return np.asarray(emg[at_rest].mean(axis=0))
