"""Surface EMG of muscles at rest, with bursts where somebody does not relax."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from armimpedance.core.errors import InputError
from armimpedance.core.motion import EmgSignals, MotionRecording
from manipulandum_sim.emg_carrier import RATE_HZ, carrier

#: Time in which a burst rises and falls, s.
EDGE_S: Final = 0.05

#: (trial's row, muscle, start s, end s, level %).
Burst = tuple[int, str, float, float, float]


def relaxed_emg(
    motion: MotionRecording,
    muscles: Sequence[str] = ("biceps", "triceps"),
    *,
    percent: float = 2.0,
    bursts: Sequence[Burst] = (),
    seed: int = 0,
) -> EmgSignals:
    """EMG at 1 kHz, normalised to the maximum voluntary contraction.

    Noise of the band 20-450 Hz whose rectified mean is `percent` of the maximum's, on every trial
    from its first frame to its last.

    Parameters
    ----------
    motion : MotionRecording
    muscles : sequence of str
    percent : float
        Level at rest.
    bursts : sequence of (row, muscle, start s, end s, level %)
        Times at which a muscle contracts to a higher level.
    seed : int
        A trial's noise depends on the seed and its number alone.

    Raises
    ------
    InputError
        A negative level, or a burst of an unknown muscle or trial.
    """
    if not (np.isfinite(percent) and percent >= 0):
        raise InputError(f"EMG level {percent} %", expected="0 or more")
    muscles, parts = tuple(muscles), []
    for row, trial in enumerate(motion.trials["trial"]):
        time = motion.time_s[motion.samples_of(row)]
        samples = round((time[-1] - time[0]) * RATE_HZ) + 1
        key = np.random.SeedSequence(seed, spawn_key=(int(trial), 3))
        noise = carrier(np.random.default_rng(key), samples, len(muscles))
        clock = time[0] + np.arange(samples) / RATE_HZ
        level = np.full((samples, len(muscles)), percent / 100)
        for _, muscle, start, end, high in (b for b in bursts if b[0] == row):
            if muscle not in muscles:
                raise InputError(f"no muscle {muscle!r}", expected=" or ".join(muscles))
            inside = np.clip(np.minimum(clock - start, end - clock) / EDGE_S, 0, 1)
            level[:, muscles.index(muscle)] += (high - percent) / 100 * inside
        # mean |N(0, sd)| = sd sqrt(2 / pi)
        parts.append(noise * level * np.sqrt(np.pi / 2))
    if any(not 0 <= b[0] < len(parts) for b in bursts):
        raise InputError("a burst in a trial that there is not", expected=f"0 to {len(parts) - 1}")
    offsets = np.cumsum([0, *(len(p) for p in parts)])
    return EmgSignals(RATE_HZ, offsets, np.concatenate(parts), muscles, "normalised")
