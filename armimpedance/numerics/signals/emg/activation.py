"""Activation of each muscle before the disturbances, from raw EMG."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from armimpedance.core.arrays import LARGEST, FloatArray, FrozenRecord, IntArray
from armimpedance.core.errors import InputError
from armimpedance.core.records import Recording
from armimpedance.numerics.signals.filters import causal_lowpass, lowpass

# Activation as in the source (section 3.2).

ENVELOPE_HZ = 1.0
ENVELOPE_ORDER = 2


def envelope(
    emg: FloatArray,
    sample_rate_hz: float,
    *,
    cutoff_hz: float = ENVELOPE_HZ,
    order: int = ENVELOPE_ORDER,
    causal: bool = False,
    axis: int = 0,
) -> FloatArray:
    """Envelope of EMG: offset removed, rectified, Butterworth low-pass.

    Parameters
    ----------
    emg : array
        Raw EMG, time along `axis`; at least one period of the cut-off long.
    sample_rate_hz : float
        Sample rate of the EMG, Hz.
    cutoff_hz : float
        Cut-off of the low-pass, Hz.
    order : int
        Order of the low-pass, which runs forward and backward (zero phase) unless `causal`.
    causal : bool
        Run the low-pass forward only; the envelope is late by `numerics.signals.lowpass_delay_s`.
    axis : int
        Axis of time.

    Returns
    -------
    array of the same shape
        The envelope in the unit of `emg`; values below 0 from filter ripple are set to 0.

    Raises
    ------
    InputError
        If the record is shorter than one period of the cut-off.
    """
    samples = emg.shape[axis]
    if samples < sample_rate_hz / cutoff_hz:
        raise InputError(
            f"EMG record of {samples / sample_rate_hz:.2f} s",
            expected=f"at least {1 / cutoff_hz:.2f} s for a low-pass of {cutoff_hz:g} Hz",
        )
    rectified = np.abs(emg - emg.mean(axis=axis, keepdims=True))
    filtered = causal_lowpass if causal else lowpass
    smooth = filtered(rectified, cutoff_hz, sample_rate_hz, order=order, axis=axis)
    return np.clip(smooth, 0.0, None)


def activation(envelope_V: FloatArray, mvc_V: FloatArray) -> FloatArray:
    """Activation ``alpha = envelope / MVC`` of each muscle, expected in 0..1.

    `envelope_V` (..., m).
    `mvc_V` (m,): envelope in the maximum voluntary contraction.
    Raises InputError: an MVC value is not positive, or an activation is above 1.2, so that the MVC
    was not maximal. Values in 1..1.2, due to scatter of the MVC between trials, are clipped to 1.
    """
    mvc_V = np.asarray(mvc_V, dtype=float)
    if not (np.isfinite(mvc_V).all() and (mvc_V > 1 / LARGEST).all()):
        raise InputError(f"MVC values {mvc_V.tolist()} V", expected="positive numbers")
    alpha = envelope_V / mvc_V
    if alpha.size and alpha.max() > 1.2:
        muscle = int(np.unravel_index(int(alpha.argmax()), alpha.shape)[-1]) + 1
        raise InputError(
            f"activation {alpha.max():.2f} of muscle {muscle}",
            expected="0..1; is the MVC that of this muscle and in the same unit?",
        )
    return np.clip(alpha, 0.0, 1.0)


#: Least rest before the onset from which activity is estimated, s.
LEAST_REST_S = 0.1


@dataclass(frozen=True)
class MeanActivation(FrozenRecord):
    """Activation of the m muscles of a recording, the mean over trials.

    `muscles` (m,) tuple of str.
    `mean` (m,): 0..1.
    `sd` (m,) or None: standard error from the scatter between trials; None for a single trial.
    `notes`: method of the estimate.
    """

    mean: Annotated[FloatArray, "m"]
    sd: Annotated[FloatArray, "m"] | None
    muscles: Annotated[tuple[str, ...], "m"]
    notes: tuple[str, ...] = ()


def mvc_column(muscle: str) -> str:
    """Name of the trials.csv column with a muscle's mean rectified EMG in maximum contraction.

    Parameters
    ----------
    muscle : str

    Returns
    -------
    str
        Name of the column; its values are in V.
    """
    return f"mvc_{muscle}_V"


def rest_column(muscle: str) -> str:
    """Name of the optional trials.csv column with the mean rectified EMG of a silent muscle.

    Parameters
    ----------
    muscle : str

    Returns
    -------
    str
        Name of the column; its values are in V.
    """
    return f"rest_{muscle}_V"


def mean_activation(
    recording: Recording, rows: IntArray, onset_s: FloatArray
) -> MeanActivation | None:
    """Activation over the rest before each onset, as the source's 1 Hz envelope measures it.

    A low-pass of 1 Hz averages about a second, as long as a trial lasts. Over the rest before the
    onset it equals the mean of the rectified EMG, which needs no longer record. The disturbance and
    its response are excluded. Noise of electrode and amplifier is independent of the muscle's own
    EMG, ``level^2 = muscle^2 + rest^2``; it is subtracted if the level of the silent muscle is
    known.

    Parameters
    ----------
    recording : Recording
        Recording with EMG. Unless the EMG is normalised, the trial table holds its MVC
        (`mvc_column`). A level at rest (`rest_column`) is optional.
    rows : (T,) int
        Rows of the trial table, from 0.
    onset_s : (trials of the recording,)
        Onsets on each trial's own clock.

    Returns
    -------
    MeanActivation or None
        None without EMG or MVC, or if no trial has a long enough rest.

    Raises
    ------
    InputError
        An MVC is not positive, or activation is far above 1 (`numerics.signals.emg.activation`).
    """
    mvc = _mvc(recording, rows)
    if recording.emg is None or mvc is None:
        return None
    level = np.array([_before(recording, int(row), onset_s[row]) for row in rows])
    rested = np.isfinite(level).all(axis=1)
    if not rested.any():
        return None
    try:
        alpha = activation(level[rested], mvc[rested])
    except InputError as error:
        raise InputError(f"EMG: {error.problem}", expected=error.expected) from error
    count = len(alpha)
    mean, sd = alpha.mean(axis=0), alpha.std(axis=0, ddof=min(count - 1, 1)) / np.sqrt(count)
    note = f"activation from the EMG before the onset of {count} trials"
    rest = _table(recording, rows, rest_column)
    if rest is not None:
        mean, sd = without_rest(mean, sd, (rest[rested] / mvc[rested]).mean(axis=0))
        note += ", noise of the silent muscle taken off"
    return MeanActivation(mean, sd if count > 1 else None, recording.muscles, (note,))


def without_rest(
    level: FloatArray, sd: FloatArray, rest: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The muscle's own part of a level, ``sqrt(level^2 - rest^2)``, and its standard error.

    Noise of electrode and amplifier is independent of the muscle's EMG.

    Parameters
    ----------
    level, sd : (..., m)
        Level of the EMG and its standard error.
    rest : (..., m)
        Level of the silent muscle, in the same unit.

    Returns
    -------
    own, own_sd : (..., m)
    """
    active = np.sqrt(np.maximum(level**2 - rest**2, 0.0))
    # d active = level / active d level is infinite at 0, where active^2 has an error of level sd
    return active, level * sd / np.maximum(
        np.maximum(active, np.sqrt(level * sd)), np.finfo(float).tiny
    )


def _mvc(recording: Recording, rows: IntArray) -> FloatArray | None:
    """MVC of each trial and muscle (T, m), in the unit of the EMG; None if one is missing."""
    if recording.emg_unit == "normalised":
        return np.ones((len(rows), len(recording.muscles)))
    return _table(recording, rows, mvc_column)


def _table(
    recording: Recording, rows: IntArray, column_of: Callable[[str], str]
) -> FloatArray | None:
    """Values in the table for each trial and muscle (T, m); None if one is missing."""
    columns = [column_of(muscle) for muscle in recording.muscles]
    if not columns or any(column not in recording.trials for column in columns):
        return None
    table = recording.trials[columns].to_numpy(dtype=float)[rows]
    return table if np.isfinite(table).all() else None


def _before(recording: Recording, row: int, onset_s: float) -> FloatArray:
    """Mean level (m,) before the onset; nan if the rest is too short."""
    first, last = recording.offsets[row], recording.offsets[row + 1]
    rest = int(np.searchsorted(recording.time_s[first:last], onset_s, side="right"))
    emg = np.asarray(recording.emg)[first : first + rest]
    if rest < LEAST_REST_S * recording.sample_rate_hz:
        return np.full(emg.shape[1], np.nan)
    if recording.emg_unit == "normalised":
        return np.asarray(emg.mean(axis=0))
    # offset subtracted, rectified; a matrix product is the fastest mean of long columns
    average = np.full(rest, 1 / rest)
    return np.asarray(average @ np.abs(emg - average @ emg))
