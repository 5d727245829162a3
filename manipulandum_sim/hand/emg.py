"""Raw surface EMG: band-limited noise whose rectified mean is activation times MVC."""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from manipulandum_sim.emg_carrier import RUN_IN, in_band

#: Noise of electrodes and amplifier, sd (V).
BASELINE_V: Final = 2e-6
#: Rectified mean of each muscle in its maximum voluntary contraction (V).
MVC_V: Final = np.array([0.40e-3, 0.25e-3, 0.60e-3, 0.45e-3, 0.70e-3, 0.35e-3])
#: Rectified mean of an electrode on a silent muscle (V): mean |N(0, sd)| = sd sqrt(2 / pi).
REST_V: Final = BASELINE_V * np.sqrt(2 / np.pi)


def raw_emg(
    seed: int,
    keys: list[tuple[int, ...]],
    activation: FloatArray,
    samples: int,
    rate_hz: float = 1000.0,
    mvc_V: FloatArray = MVC_V,
) -> FloatArray:
    """EMG (T, S, m) in V at constant activations (T, m).

    The mean of the rectified noise is ``activation mvc_V``, baseline noise comes on top; a trial's
    samples depend on the seed and its key alone.
    """
    white = np.empty((len(keys), len(mvc_V), RUN_IN + samples))
    for t, key in enumerate(keys):
        sequence = np.random.SeedSequence(seed, spawn_key=(*key, 1))
        np.random.default_rng(sequence).standard_normal(out=white[t])
    noise = in_band(white, axis=-1, rate_hz=rate_hz)
    # mean |N(0, sd)| = sd sqrt(2 / pi)
    sd = np.hypot(activation * mvc_V * np.sqrt(np.pi / 2), BASELINE_V)
    noise *= sd[..., None]
    return np.ascontiguousarray(noise.transpose(0, 2, 1))
