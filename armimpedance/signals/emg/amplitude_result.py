"""EMG amplitudes over time and of segments, with their standard errors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from armimpedance.arrays import FloatArray, IntArray, frozen_array

#: The source's low-pass, Ruiz (2011), section 6.1.
CUTOFF_HZ: Final = 10.0
ORDER: Final = 5


@dataclass(frozen=True)
class EmgAmplitude:
    """Amplitude of m muscles over time; N samples of T trials, one trial after another.

    Attributes
    ----------
    sample_rate_hz : float
    trials, muscles : tuples of str
    offsets : (T + 1,) int
    amplitude : (N, m)
        Activation, parts of the maximum contraction.
    sd : (N, m)
        Standard error of each value, from the randomness of the carrier; the errors of samples
        closer than the low-pass is wide are related.
    relative_noise : (m,)
        Standard error over amplitude, of the EMG as recorded (electrode's noise included).
    cutoff_hz : float
    order : int
    causal : bool
    lag_s : float
        By which it is late: 0 for zero phase or once aligned.
    notes, warnings : tuples of str
    """

    sample_rate_hz: float
    trials: tuple[str, ...]
    muscles: tuple[str, ...]
    offsets: IntArray
    amplitude: FloatArray
    sd: FloatArray
    relative_noise: FloatArray
    cutoff_hz: float = CUTOFF_HZ
    order: int = ORDER
    causal: bool = False
    lag_s: float = 0.0
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        put, m = object.__setattr__, len(self.muscles)
        offsets = frozen_array(self.offsets, "offsets", (len(self.trials) + 1,), np.int64)
        put(self, "offsets", offsets)
        put(self, "amplitude", frozen_array(self.amplitude, "amplitude", (int(offsets[-1]), m)))
        put(self, "sd", frozen_array(self.sd, "sd", self.amplitude.shape))
        put(self, "relative_noise", frozen_array(self.relative_noise, "relative_noise", (m,)))
        for name in ("trials", "muscles", "notes", "warnings"):
            put(self, name, tuple(getattr(self, name)))

    @property
    def noise_sd(self) -> FloatArray:
        """Root mean square of `sd` over all samples, (m,)."""
        return np.sqrt((self.sd**2).mean(axis=0))

    def samples_of(self, row: int) -> slice:
        """The samples of trial `row`, counted from 0."""
        return slice(int(self.offsets[row]), int(self.offsets[row + 1]))


@dataclass(frozen=True)
class SegmentAmplitude:
    """One amplitude of each of m muscles for each of L segments.

    Attributes
    ----------
    muscles : tuple of str
    row : (L,) int
        Row of the trial table, from 0.
    start_s, end_s : (L,)
        From the trial's first sample.
    amplitude, sd : (L, m)
        Parts of the maximum contraction, and the carrier's standard error.
    kind : {"rms", "rectified"}
    notes, warnings : tuples of str
    """

    muscles: tuple[str, ...]
    row: IntArray
    start_s: FloatArray
    end_s: FloatArray
    amplitude: FloatArray
    sd: FloatArray
    kind: Literal["rms", "rectified"]
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "row", frozen_array(self.row, "row", (None,), np.int64))
        L, m = len(self.row), len(self.muscles)
        for name in ("start_s", "end_s"):
            put(self, name, frozen_array(getattr(self, name), name, (L,)))
        for name in ("amplitude", "sd"):
            put(self, name, frozen_array(getattr(self, name), name, (L, m)))
        for name in ("muscles", "notes", "warnings"):
            put(self, name, tuple(getattr(self, name)))
