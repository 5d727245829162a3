"""Joints on a bench for the studies of methods: known I, B and K, white noise of a known level."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.records import Recording
from armimpedance.joint.elbow import JointSamples, from_recording
from armimpedance.numerics.signals import emg_amplitude, mvc_column, rest_column
from manipulandum_sim.elbow import RATE_HZ, Electrodes, raw_emg, simulate_bench

DURATION_S: Final = 10.0
#: Length of the source's windows, those of method "windows", s.
CONSTANT_S: Final = 0.5
#: B and K go up and down by this part of their mean, both at once.
DEPTH: Final = 0.3
MUSCLES: Final = ("flexor", "extensor")
MVC_V: Final = 5e-4
#: Mean activation of both muscles, and the part of K and of B that follows them.
ACTIVATION: Final = 0.10
ACTIVE: Final = 0.8
#: The muscles go before and behind their sum by this, or nobody could tell them apart.
APART_RAD: Final = np.pi / 4


@dataclass(frozen=True)
class Joint:
    """A joint; units kg m^2, N m s/rad, N m/rad.

    Attributes
    ----------
    name : str
    inertia, viscosity, stiffness : float
    """

    name: str
    inertia: float
    viscosity: float
    stiffness: float

    @property
    def values(self) -> FloatArray:
        """I, B, K, (3,)."""
        return np.array([self.inertia, self.viscosity, self.stiffness])

    @property
    def title(self) -> str:
        """Name and numbers."""
        return f"{self.name}: I {self.inertia:g}, B {self.viscosity:g}, K {self.stiffness:g}"


#: In the middle of the range that the source measured.
SOURCES: Final = Joint("overdamped, the source's range", 0.07, 3.5, 9.0)
#: As relaxed elbows are in other sources: it swings.
SWINGING: Final = Joint("underdamped", 0.07, 0.6, 20.0)
JOINTS: Final = (SWINGING, SOURCES)


@dataclass(frozen=True)
class Varying:
    """One record of a joint whose B and K vary.

    Attributes
    ----------
    joint : Joint
    frequency_hz : float
    samples : JointSamples
    time_s, B, K : (N,)
        True.
    activation : (N, 2)
        True, of flexor and extensor.
    amplitude : (N, 2)
        Of their EMG.
    amplitude_sd : (2,)
    """

    joint: Joint
    frequency_hz: float
    samples: JointSamples
    time_s: FloatArray
    B: FloatArray
    K: FloatArray
    activation: FloatArray
    amplitude: FloatArray
    amplitude_sd: FloatArray

    def truth(self, name: str) -> tuple[FloatArray, FloatArray]:
        """Time and true course of B or K."""
        return self.time_s, getattr(self, name)


def varying_draws(
    joint: Joint, frequency_hz: float, *, draws: int, snr_db: float, seed: int
) -> Iterator[Varying]:
    """Records of ``K(t) = K (1 + DEPTH sin 2 pi f t)``, B alike, and the EMG that goes with it."""

    def course(mean: float, time_s: FloatArray) -> FloatArray:
        return np.asarray(mean * (1 + DEPTH * np.sin(2 * np.pi * frequency_hz * time_s)))

    recording, truth = simulate_bench(
        joint.inertia,
        lambda t: course(joint.viscosity, t),
        lambda t: course(joint.stiffness, t),
        duration_s=DURATION_S,
        trials=draws,
        snr_db=snr_db,
        seed=seed,
    )
    time = np.arange(len(truth.K)) / RATE_HZ
    activation = _activation(frequency_hz, time)
    generators = np.random.default_rng([seed, 1]).spawn(draws)
    for row, (rng, angle) in enumerate(zip(generators, truth.angle, strict=True)):
        one = recording.select(np.array([row]))
        samples = from_recording(one)
        rate = np.gradient(angle, 1 / RATE_HZ)
        own = emg_amplitude(_with_emg(one, rng, activation, rate))
        yield Varying(
            joint=joint,
            frequency_hz=frequency_hz,
            samples=samples,
            time_s=time,
            B=truth.B,
            K=truth.K,
            activation=activation,
            amplitude=own.amplitude,
            amplitude_sd=own.noise_sd,
        )


def _activation(frequency_hz: float, time_s: FloatArray) -> FloatArray:
    """Flexor and extensor (N, 2); K and B are linear in their sum, `ACTIVE` of them."""
    swing = DEPTH / (ACTIVE * np.cos(APART_RAD))
    phase = 2 * np.pi * frequency_hz * time_s[:, None] + np.array([APART_RAD, -APART_RAD])
    return np.asarray(ACTIVATION * (1 + swing * np.sin(phase)))


def _with_emg(
    recording: Recording, rng: np.random.Generator, activation: FloatArray, rate: FloatArray
) -> Recording:
    electrodes = Electrodes()
    table = recording.trials.assign(
        **{mvc_column(m): MVC_V for m in MUSCLES},
        **{rest_column(m): electrodes.rest_V for m in MUSCLES},
    )
    emg = raw_emg(rng, activation, np.full(len(MUSCLES), MVC_V), rate, electrodes)
    return replace(recording, trials=table, emg=emg, muscles=MUSCLES)
