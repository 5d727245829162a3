"""Records of a moving body: markers on it, its joint motion, EMG beside it. No algorithms.

Frames and signs: see `skeleton`. Sizes: N samples in all trials of a recording, T trials, P
markers, n coordinates, K force plates.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final, Literal

import numpy as np
import pandas as pd

from armimpedance.arrays import FloatArray, IntArray, frozen_array
from armimpedance.errors import RecordError
from armimpedance.records import Subject
from armimpedance.skeleton import Skeleton

#: A force plate's columns: force, then moment about the plate's origin, in the world's frame.
WRENCH: Final = ("fx", "fy", "fz", "mx", "my", "mz")


@dataclass(frozen=True)
class EmgSignals:
    """Raw EMG at its own rate.

    Attributes
    ----------
    sample_rate_hz : float
    offsets : (T + 1,) int
        Samples of trial t: ``offsets[t]:offsets[t + 1]``; may be none.
    signals : (Ne, m)
    muscles : tuple of m str
    unit : {"V", "normalised"}
        In V, the maximum is in the trial table (``mvc_<muscle>_V``).
    """

    sample_rate_hz: float
    offsets: IntArray
    signals: FloatArray
    muscles: tuple[str, ...]
    unit: Literal["V", "normalised"] = "normalised"

    def __post_init__(self) -> None:
        put = object.__setattr__
        _check_rate(self.sample_rate_hz)
        put(self, "muscles", tuple(self.muscles))
        put(self, "offsets", frozen_array(self.offsets, "EMG offsets", (None,), np.int64))
        shape = (int(self.offsets[-1]), len(self.muscles))
        put(self, "signals", frozen_array(self.signals, "EMG signals", shape))


class _InTrials:
    """What a recording of samples in trials can say of them."""

    trials: pd.DataFrame
    offsets: IntArray

    @property
    def n_trials(self) -> int:
        """Number of trials T."""
        return len(self.trials)

    def samples_of(self, row: int) -> slice:
        """The samples of the trial in row `row` (from 0) of the trial table."""
        return slice(int(self.offsets[row]), int(self.offsets[row + 1]))


@dataclass(frozen=True)
class MarkerRecording(_InTrials):
    """Markers of a motion-capture session, samples of all trials one after another.

    Attributes
    ----------
    sample_rate_hz : float
    trials : DataFrame (T rows)
        ``trial`` (int, unique), ``condition`` (str) and whatever else is known. Not to be changed.
    offsets : (T + 1,) int
    time_s : (N,)
        Each trial's own clock.
    positions : (N, P, 3)
        m, in the world's frame; NaN in all three where a marker was not seen.
    names : tuple of P str
    skeleton : Skeleton or None
        Of the subject, with the markers' places, where it is known.
    wrenches : (N, K, 6) or None
        Force plates at the markers' rate, as in `MotionRecording`.
    plate_origins_m : (K, 3) or None
    emg : EmgSignals or None
    subject : Subject
    provenance : tuple of str
    """

    sample_rate_hz: float
    trials: pd.DataFrame
    offsets: IntArray
    time_s: FloatArray
    positions: FloatArray
    names: tuple[str, ...]
    skeleton: Skeleton | None = None
    wrenches: FloatArray | None = None
    plate_origins_m: FloatArray | None = None
    emg: EmgSignals | None = None
    subject: Subject = field(default_factory=Subject)
    provenance: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        put = object.__setattr__
        samples = _check_trials(self)
        put(self, "names", tuple(self.names))
        if len(set(self.names)) != len(self.names):
            raise RecordError("two markers of one name")
        put(self, "positions", _with_gaps(self.positions, samples, len(self.names)))
        _check_plates(self, samples)


@dataclass(frozen=True)
class MotionRecording(_InTrials):
    """Joint motion of a skeleton, with what was measured beside it.

    Attributes
    ----------
    sample_rate_hz : float
    trials : DataFrame (T rows)
        As in `MarkerRecording`.
    offsets : (T + 1,) int
    time_s : (N,)
    coordinates : (N, n)
        In the order of `skeleton.coordinates`; m and rad, angles without jumps of a full turn.
    skeleton : Skeleton
    wrenches : (N, K, 6) or None
        Force (N) and moment (Nm) **by each plate on the body**, world frame, the moment about the
        plate's origin.
    plate_origins_m : (K, 3) or None
    torque : (N, n) or None
        Generalised forces by motors or muscles, where they are measured (robots, simulations).
    emg : EmgSignals or None
    subject : Subject
    provenance : tuple of str
    """

    sample_rate_hz: float
    trials: pd.DataFrame
    offsets: IntArray
    time_s: FloatArray
    coordinates: FloatArray
    skeleton: Skeleton
    wrenches: FloatArray | None = None
    plate_origins_m: FloatArray | None = None
    torque: FloatArray | None = None
    emg: EmgSignals | None = None
    subject: Subject = field(default_factory=Subject)
    provenance: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        put = object.__setattr__
        samples = _check_trials(self)
        shape = (samples, len(self.skeleton.coordinates))
        put(self, "coordinates", frozen_array(self.coordinates, "coordinates", shape))
        if self.torque is not None:
            put(self, "torque", frozen_array(self.torque, "torque", shape))
        _check_plates(self, samples)

    def select(self, rows: Sequence[int]) -> MotionRecording:
        """The motion, plates and torque of these trials only (rows from 0); EMG stays behind."""
        parts = [self.samples_of(row) for row in rows]
        index = np.concatenate([np.arange(p.start, p.stop) for p in parts])
        return replace(
            self,
            trials=self.trials.iloc[list(rows)],
            offsets=np.concatenate([[0], np.cumsum([p.stop - p.start for p in parts])]),
            time_s=self.time_s[index],
            coordinates=self.coordinates[index],
            wrenches=None if self.wrenches is None else self.wrenches[index],
            torque=None if self.torque is None else self.torque[index],
            emg=None,
        )


def _check_rate(rate_hz: float) -> None:
    if not (np.isfinite(rate_hz) and rate_hz > 0):
        raise RecordError(f"sample rate {rate_hz} Hz", expected="a positive number")


def _check_trials(recording: Any) -> int:
    """Check the trial table, offsets and clock; the number of samples."""
    put = object.__setattr__
    _check_rate(recording.sample_rate_hz)
    trials = recording.trials.reset_index(drop=True).copy()
    put(recording, "trials", trials)
    for column in ("trial", "condition"):
        if column not in trials:
            raise RecordError("no such column in the trial table", column=column)
    if len(trials) == 0 or trials["trial"].duplicated().any():
        raise RecordError("no trials, or one of them twice", expected="one row per trial")
    offsets = frozen_array(recording.offsets, "offsets", (len(trials) + 1,), np.int64)
    put(recording, "offsets", offsets)
    if offsets[0] != 0 or (np.diff(offsets) <= 0).any():
        raise RecordError("a trial has no samples", expected="rising offsets from 0")
    samples = int(offsets[-1])
    put(recording, "time_s", frozen_array(recording.time_s, "time_s", (samples,)))
    put(recording, "provenance", tuple(recording.provenance))
    if recording.emg is not None and len(recording.emg.offsets) != len(offsets):
        raise RecordError("EMG of another number of trials", expected=f"{len(trials)}")
    return samples


def _check_plates(recording: Any, samples: int) -> None:
    if (recording.wrenches is None) != (recording.plate_origins_m is None):
        raise RecordError("wrenches without the plates' origins, or the other way round")
    if recording.wrenches is None:
        return
    put = object.__setattr__
    origins = frozen_array(recording.plate_origins_m, "plate_origins_m", (None, 3))
    put(recording, "plate_origins_m", origins)
    wrenches = frozen_array(recording.wrenches, "wrenches", (samples, len(origins), 6))
    put(recording, "wrenches", wrenches)


def _with_gaps(values: FloatArray, samples: int, markers: int) -> FloatArray:
    """Read-only copy (N, P, 3); a marker is seen in all three axes or in none."""
    array = np.array(values, dtype=np.float64)
    if array.shape != (samples, markers, 3):
        raise RecordError(
            f"positions have shape {array.shape}", expected=f"shape ({samples}, {markers}, 3)"
        )
    lost = np.isnan(array).any(axis=2)
    if not np.isnan(array[lost]).all() or not np.isfinite(array[~lost]).all():
        raise RecordError(
            "a marker with a part of its coordinates", expected="three finite numbers or none"
        )
    array.flags.writeable = False
    return array
