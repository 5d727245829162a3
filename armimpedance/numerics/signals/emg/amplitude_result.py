"""EMG amplitudes over time and of segments, with their standard errors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final, Literal

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord, IntArray
from armimpedance.core.errors import RecordError

#: The source's low-pass, Ruiz (2011), section 6.1.
CUTOFF_HZ: Final = 10.0
ORDER: Final = 5


@dataclass(frozen=True)
class EmgAmplitude(FrozenRecord):
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
        Delay of the amplitude, s; 0 for a zero-phase filter or once aligned.
    notes, warnings : tuples of str
    """

    sample_rate_hz: float
    trials: Annotated[tuple[str, ...], "t"]
    muscles: Annotated[tuple[str, ...], "m"]
    offsets: Annotated[IntArray, "t+1"]
    amplitude: Annotated[FloatArray, "n m"]
    sd: Annotated[FloatArray, "n m"]
    relative_noise: Annotated[FloatArray, "m"]
    cutoff_hz: float = CUTOFF_HZ
    order: int = ORDER
    causal: bool = False
    lag_s: float = 0.0
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.amplitude) != self.offsets[-1]:
            raise RecordError(
                f"{len(self.amplitude)} amplitudes", expected=f"{self.offsets[-1]}, one per sample"
            )

    @property
    def noise_sd(self) -> FloatArray:
        """Root mean square of `sd` over all samples, (m,)."""
        return np.sqrt((self.sd**2).mean(axis=0))

    def samples_of(self, row: int) -> slice:
        """The samples of trial `row`, counted from 0."""
        return slice(int(self.offsets[row]), int(self.offsets[row + 1]))


@dataclass(frozen=True)
class SegmentAmplitude(FrozenRecord):
    """One amplitude of each of m muscles for each of L segments.

    Attributes
    ----------
    muscles : tuple of str
    row : (L,) int
        Row of the trial table, from 0.
    start_s, end_s : (L,)
        Start and end of each segment, counted from the trial's first sample, s.
    amplitude, sd : (L, m)
        Parts of the maximum contraction, and the carrier's standard error.
    kind : {"rms", "rectified"}
    notes, warnings : tuples of str
    """

    muscles: Annotated[tuple[str, ...], "m"]
    row: Annotated[IntArray, "l"]
    start_s: Annotated[FloatArray, "l"]
    end_s: Annotated[FloatArray, "l"]
    amplitude: Annotated[FloatArray, "l m"]
    sd: Annotated[FloatArray, "l m"]
    kind: Literal["rms", "rectified"]
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
