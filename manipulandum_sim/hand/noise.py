"""Noise of a measurement: the subject's own unsteadiness and the sensors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError


@dataclass(frozen=True)
class NoiseLevel:
    """A named level of noise; every entry may be 0.

    Attributes
    ----------
    force_sd, force_step : float
        White noise (sd) and resolution of the force sensor.
    encoder_step : float
        Resolution of the hand's position.
    led_sd : float
        Sd of the posture from the LEDs.
    drift_sd : float
        Sd of the constant velocity at which the virtual position drifts, per axis and trial.
    tremor, tremor_hz : float
        Amplitude and frequency of the tremor.
    voluntary_sd, voluntary_time : float
        Sd and time constant of the slow voluntary force (Ornstein-Uhlenbeck).
    """

    name: str
    force_sd: float = 0.0
    force_step: float = 0.0
    encoder_step: float = 0.0
    led_sd: float = 0.0
    drift_sd: float = 0.0
    tremor: float = 0.0
    tremor_hz: float = 9.0
    voluntary_sd: float = 0.0
    voluntary_time: float = 0.4

    @property
    def moves_the_hand(self) -> bool:
        """True if the subject is unsteady at the level of force."""
        return self.tremor > 0 or self.voluntary_sd > 0


SENSOR: Final = NoiseLevel(
    "sensor", force_sd=0.03, force_step=0.05, encoder_step=20e-6, led_sd=0.002
)
#: The force resolution is the source's; with the rest the multiple correlation is near its .979.
NOMINAL: Final = NoiseLevel(
    "nominal",
    force_sd=0.03,
    force_step=0.05,
    encoder_step=20e-6,
    led_sd=0.002,
    drift_sd=0.003,
    tremor=0.08,
    voluntary_sd=0.25,
)
NOISE_LEVELS: Final = {level.name: level for level in (NoiseLevel("none"), SENSOR, NOMINAL)}


def find_noise(noise: str | NoiseLevel) -> NoiseLevel:
    """A level of noise by its name.

    Raises
    ------
    InputError
        If there is no such level.
    """
    if isinstance(noise, NoiseLevel):
        return noise
    if noise not in NOISE_LEVELS:
        raise InputError(f"no noise level {noise!r}", expected=" or ".join(NOISE_LEVELS))
    return NOISE_LEVELS[noise]


class Draws(NamedTuple):
    """Standard random numbers of a batch of trials, the same whatever the level of noise.

    drift, phase, grid: (T, 2), normal, uniform, uniform; white, slow: (T, S, 2) normal;
    led: (T, L, 2) normal.
    """

    drift: FloatArray
    phase: FloatArray
    grid: FloatArray
    white: FloatArray
    slow: FloatArray
    led: FloatArray


#: Samples from one reading of the LEDs to the next.
LED_EVERY: Final = 10


def draw(seed: int, keys: list[tuple[int, ...]], samples: int) -> Draws:
    """Random numbers of each trial from a generator of its own.

    A trial's numbers depend on the seed and its key alone: not on the batch, not on the workers.
    """
    leds = -(-samples // LED_EVERY)
    trials = len(keys)
    pairs = [np.empty((trials, 2)) for _ in range(3)]
    series = [np.empty((trials, n, 2)) for n in (samples, samples, leds)]
    for t, key in enumerate(keys):
        rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))
        pairs[0][t] = rng.standard_normal(2)
        pairs[1][t] = rng.random(2)
        pairs[2][t] = rng.random(2)
        for store in series:
            rng.standard_normal(out=store[t])
    return Draws(*pairs, *series)


def voluntary_force(level: NoiseLevel, draws: Draws, rate_hz: float) -> FloatArray | None:
    """Tremor and slow voluntary force (S, 2, T) of the hand in N; None where there is none."""
    if not level.moves_the_hand:
        return None
    white = np.ascontiguousarray(draws.slow.transpose(1, 2, 0))
    keep = np.exp(-1 / (level.voluntary_time * rate_hz))
    renew = np.sqrt(1 - keep**2)
    force = np.empty_like(white)
    force[0] = white[0]
    for n in range(1, len(white)):
        force[n] = keep * force[n - 1] + renew * white[n]
    force *= level.voluntary_sd
    cycles = level.tremor_hz / rate_hz * np.arange(len(white))[:, None, None] + draws.phase.T
    return force + level.tremor * np.sin(2 * np.pi * cycles)


def quantised(values: FloatArray, step: float, phase: FloatArray | float = 0.0) -> FloatArray:
    """Rounded to a grid of `step` whose origin lies `phase` steps off; step 0 changes nothing."""
    return (np.round(values / step + phase) - phase) * step if step > 0 else values
