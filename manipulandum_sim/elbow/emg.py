"""Raw surface EMG of the elbow's muscles while the exoskeleton moves it, through the converter."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from manipulandum_sim.elbow.device import EMG_INPUT, RATE_HZ
from manipulandum_sim.emg_carrier import carrier

#: A movement artefact has nothing above this, Hz; order of its low-pass.
ARTEFACT_HZ: Final = 15.0
ARTEFACT_ORDER: Final = 4


@dataclass(frozen=True)
class Electrodes:
    """Signals that the electrodes pick up beside the muscle.

    Attributes
    ----------
    noise_V : float
        White, sd.
    hum_V, hum_hz : float
        Amplitude and frequency of the mains.
    artefact : float
        V per rad/s of the elbow.
    crosstalk : float
        Part of every other muscle's EMG (V) in a muscle's channel.
    """

    noise_V: float = 2e-6
    hum_V: float = 2e-6
    hum_hz: float = 50.0
    artefact: float = 1e-5
    crosstalk: float = 0.0

    def __post_init__(self) -> None:
        sizes = (self.noise_V, self.hum_V, self.artefact)
        if not all(np.isfinite(s) and s >= 0 for s in sizes):
            raise InputError(f"noise, hum and artefact of {sizes}", expected="0 or more, finite")
        if not (np.isfinite(self.crosstalk) and -1 < self.crosstalk < 1):
            raise InputError(f"crosstalk of {self.crosstalk}", expected="a part, above -1, below 1")
        if not 0 < self.hum_hz < RATE_HZ / 2:
            raise InputError(f"mains of {self.hum_hz} Hz", expected=f"0 to {RATE_HZ / 2:g} Hz")

    @property
    def rest_V(self) -> float:
        """Mean rectified noise of a silent muscle, hum apart: mean |N(0, sd)|, V."""
        return float(self.noise_V * np.sqrt(2 / np.pi))


def raw_emg(
    rng: np.random.Generator,
    activation: FloatArray,
    mvc_V: FloatArray,
    rate: FloatArray,
    electrodes: Electrodes,
    converted: bool = True,
) -> FloatArray:
    """One trial's EMG (S, m), V, at 1 kHz.

    The mean of the rectified carrier is ``activation mvc_V``; all else, crosstalk too, comes on
    top.

    Parameters
    ----------
    rng : Generator
    activation : (S, m)
    mvc_V : (m,)
        Mean rectified EMG of the maximum voluntary contraction.
    rate : (S,)
        Angular velocity of the elbow, rad/s.
    electrodes : Electrodes
    converted : bool
        Whether the signal passes the 16-bit converter.

    Returns
    -------
    (S, m)
    """
    from scipy.signal import butter, sosfilt

    samples, muscles = activation.shape
    # mean |N(0, sd)| = sd sqrt(2 / pi)
    emg = carrier(rng, samples, muscles) * activation * mvc_V * np.sqrt(np.pi / 2)
    emg += electrodes.crosstalk * (emg.sum(axis=1, keepdims=True) - emg)
    emg += electrodes.noise_V * rng.standard_normal((samples, muscles))
    phase = rng.uniform(0, 2 * np.pi, muscles)
    clock = 2 * np.pi * electrodes.hum_hz * np.arange(samples)[:, None] / RATE_HZ
    emg += electrodes.hum_V * np.sin(clock + phase)
    sos = butter(ARTEFACT_ORDER, ARTEFACT_HZ, fs=RATE_HZ, output="sos")
    # cables swing with the arm, differently at each electrode
    share = rng.uniform(0.5, 1.0, muscles) * rng.choice([-1.0, 1.0], muscles)
    emg += electrodes.artefact * share * sosfilt(sos, rate)[:, None]
    return EMG_INPUT.convert(emg) if converted else emg
