"""Records of a moving body: its markers, joint motion and EMG. No algorithms.

Frames and signs: see `skeleton`. Sizes: N samples in all trials of a recording, T trials, P
markers, n coordinates, K force plates.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Annotated, Final, Literal

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray, FrozenRecord, IntArray
from armimpedance.core.errors import RecordError
from armimpedance.core.records import Subject
from armimpedance.core.skeleton import Skeleton
from armimpedance.core.trials import InTrials, check_rate, expect_shape

#: A force plate's columns: force, then moment about the plate's origin, in the world's frame.
WRENCH: Final = ("fx", "fy", "fz", "mx", "my", "mz")


@dataclass(frozen=True)
class EmgSignals(FrozenRecord):
    """Raw EMG at its own rate.

    `signals` (Ne, m).
    `offsets` (T + 1,) int: samples of trial t: ``offsets[t]:offsets[t + 1]``; may be empty.
    `unit`: in V, the maximum is in the trial table (``mvc_<muscle>_V``).
    """

    sample_rate_hz: float
    offsets: Annotated[IntArray, "_"]
    signals: Annotated[FloatArray, "_ m"]
    muscles: Annotated[tuple[str, ...], "m"]
    unit: Literal["V", "normalised"] = "normalised"

    def __post_init__(self) -> None:
        super().__post_init__()
        check_rate(self.sample_rate_hz)
        expect_shape("EMG signals", self.signals, (int(self.offsets[-1]), len(self.muscles)))

    def select(self, rows: ArrayLike) -> EmgSignals:
        """Return the signals of these trials only (row numbers from 0, or a mask)."""
        chosen = np.arange(len(self.offsets) - 1)[np.asarray(rows)]
        parts = [self.signals[self.offsets[r] : self.offsets[r + 1]] for r in chosen]
        offsets = np.concatenate([[0], np.cumsum([len(part) for part in parts])])
        signals = np.concatenate([self.signals[:0], *parts])
        return replace(self, offsets=offsets.astype(np.int64), signals=signals)


@dataclass(frozen=True, repr=False)
class MarkerRecording(InTrials):
    """Markers of a motion-capture session, samples of all trials one after another.

    Attributes
    ----------
    sample_rate_hz : float
    trials : DataFrame (T rows)
        ``trial`` (int, unique), ``condition`` (str) and further columns. Not to be changed.
    offsets : (T + 1,) int
    time_s : (N,)
        Each trial's own clock.
    positions : (N, P, 3)
        m, in the world's frame; NaN in all three where a marker was not seen.
    names : tuple of P str
    skeleton : Skeleton or None
        Skeleton of the subject with the markers' places, if it is known.
    wrenches : (N, K, 6) or None
        Force plates at the markers' rate, as in `MotionRecording`.
    plate_origins_m : (K, 3) or None
    emg : EmgSignals or None
    subject : Subject
    provenance : tuple of str

    Examples
    --------
    >>> from manipulandum_sim.passive import simulate_passive
    >>> markers, _ = simulate_passive("release", trials=1, duration_s=2.0)
    >>> markers
    MarkerRecording of 1 trial, 2.0 s at 30 Hz
    conditions: release
    """

    sample_rate_hz: float
    trials: pd.DataFrame
    offsets: Annotated[IntArray, "T+1"]
    time_s: Annotated[FloatArray, "N"]
    positions: Annotated[FloatArray, "N P 3 nan"]
    names: Annotated[tuple[str, ...], "P"]
    skeleton: Skeleton | None = None
    wrenches: Annotated[FloatArray, "N K 6"] | None = None
    plate_origins_m: Annotated[FloatArray, "K 3"] | None = None
    emg: EmgSignals | None = None
    subject: Subject = field(default_factory=Subject)
    provenance: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(set(self.names)) != len(self.names):
            raise RecordError("two markers of one name")
        lost = np.isnan(self.positions).any(axis=2)
        seen = np.isfinite(self.positions[~lost]).all()
        if not (np.isnan(self.positions[lost]).all() and seen):
            raise RecordError(
                "a marker with a part of its coordinates", expected="three finite numbers or none"
            )
        _check_beside(self)

    def select(self, rows: ArrayLike) -> MarkerRecording:
        """Return the recording with these trials only (row numbers from 0, or a mask)."""
        index, changes = self._chosen(rows)
        return replace(
            self,
            **changes,
            positions=self.positions[index],
            wrenches=None if self.wrenches is None else self.wrenches[index],
            emg=None if self.emg is None else self.emg.select(rows),
        )


@dataclass(frozen=True, repr=False)
class MotionRecording(InTrials):
    """Joint motion of a skeleton, with force plates, torque and EMG.

    Attributes
    ----------
    sample_rate_hz : float
    trials : DataFrame (T rows)
        Table of the trials, the same as in `MarkerRecording`.
    offsets : (T + 1,) int
    time_s : (N,)
    coordinates : (N, n)
        In the order of `skeleton.coordinates`; m and rad, angles without jumps of a full turn.
    skeleton : Skeleton
    wrenches : (N, K, 6) or None
        Force (N) and moment (N m) **by each plate on the body**, world frame, the moment about the
        plate's origin.
    plate_origins_m : (K, 3) or None
    torque : (N, n) or None
        Generalised forces by motors or muscles, if they are measured (robots, simulations).
    emg : EmgSignals or None
    subject : Subject
    provenance : tuple of str

    Examples
    --------
    >>> from manipulandum_sim.body import simulate_body
    >>> motion, _ = simulate_body(("all_joints",))
    >>> motion
    MotionRecording of 1 trial, 23.6 s at 100 Hz
    conditions: all_joints
    """

    sample_rate_hz: float
    trials: pd.DataFrame
    offsets: Annotated[IntArray, "T+1"]
    time_s: Annotated[FloatArray, "N"]
    coordinates: Annotated[FloatArray, "N n"]
    skeleton: Skeleton
    wrenches: Annotated[FloatArray, "N K 6"] | None = None
    plate_origins_m: Annotated[FloatArray, "K 3"] | None = None
    torque: Annotated[FloatArray, "N n"] | None = None
    emg: EmgSignals | None = None
    subject: Subject = field(default_factory=Subject)
    provenance: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        shape = (len(self.time_s), len(self.skeleton.coordinates))
        expect_shape("coordinates", self.coordinates, shape)
        _check_beside(self)

    def select(self, rows: ArrayLike) -> MotionRecording:
        """Return motion, plates and torque of these trials only (rows from 0), without EMG."""
        index, changes = self._chosen(rows)
        return replace(
            self,
            **changes,
            coordinates=self.coordinates[index],
            wrenches=None if self.wrenches is None else self.wrenches[index],
            torque=None if self.torque is None else self.torque[index],
            emg=None,
        )


def _check_beside(recording: MarkerRecording | MotionRecording) -> None:
    """Check the signals other than motion: EMG of the same trials, force plates with origins."""
    if recording.emg is not None and len(recording.emg.offsets) != len(recording.offsets):
        raise RecordError("EMG of another number of trials", expected=f"{recording.n_trials}")
    if (recording.wrenches is None) != (recording.plate_origins_m is None):
        raise RecordError("wrenches without the plates' origins, or the other way round")
