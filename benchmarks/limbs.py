"""The limbs of the studies: what was simulated, its truth, and the bound that its noise sets."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.records import Window
from armimpedance.hand.still import bound, modal_equation, through_impedance
from armimpedance.lab.simulate_study.rigs.linear import LIMB, linear_window as window_of
from armimpedance.numerics.signals import cut_windows, position_noise
from manipulandum_sim.hand import simulate_condition

RATE = 1000.0
HANDLE_KG = 0.164
#: A relaxed arm of a 70 kg man in the nominal posture, perfectly linear.
LINEAR = LIMB
#: Variance of the tremor (N^2): the linear limb's is 0.08 N rms, the subject's 0.08 N high.
TREMOR = {"linear": 0.08**2, "subject": 0.08**2 / 2}


def linear_window(
    noise: str,
    seed: int,
    trials: int = 40,
    duration: float = 0.3,
    rest: float = 0.16,
    shape: str = "minimum_jerk",
) -> Window:
    """One experiment on the linear limb, by its number."""
    rng = np.random.default_rng(np.random.SeedSequence(7, spawn_key=(seed,)))
    return window_of(noise, rng, trials=trials, duration_s=duration, rest_s=rest, shape=shape)


@dataclass(frozen=True)
class Experiments:
    """Windows of several experiments of one design, their truth and handle mass."""

    windows: list[Window]
    truth: FloatArray
    handle_kg: float


def experiments(
    limb: str, noise: str, first: int, count: int, *, trials: int = 40, **design: object
) -> Experiments:
    """Experiments `first` ... of a limb ("linear" or "subject"); the same whoever asks."""
    if limb == "linear":
        windows = [linear_window(noise, n, trials, **design) for n in range(first, first + count)]
        return Experiments(windows, LINEAR, 0.0)
    windows, truth = [], LINEAR
    for n in range(first, first + count):
        recording, found = simulate_condition(
            seed=n, noise=noise, sets=trials // 8, emg=False, **design
        )
        windows.append(cut_windows(recording))
        truth = np.stack([found.M_e[0], found.B_e[0], found.K_e[0]])
    return Experiments(windows, truth, HANDLE_KG)


def true_bound(
    limb: str, noise: str, *, trials: int = 40, known_motion: bool = False, **design: object
) -> FloatArray:
    """Cramer-Rao bound (12, 12) of M, B, K for the noise that the simulation has.

    The force's noise is computed from its definition, nothing is estimated; the position's from
    the record (`numerics.signals.modes`), or left out for a motion that is known.
    """
    clean = experiments(limb, "none", 0, 1, trials=trials, **design)
    noisy = experiments(limb, noise, 0, 1, trials=trials, **design).windows[0]
    equation = modal_equation(clean.windows[0])
    theta = clean.truth + clean.handle_kg * np.array(
        [np.eye(2), np.zeros((2, 2)), np.zeros((2, 2))]
    )
    covariance = _force_noise(equation, noise, clean.truth[2], TREMOR[limb])
    if not known_motion:
        encoder = position_noise(noisy.position, RATE, equation.modes)
        covariance = covariance + through_impedance(theta.ravel(), encoder.covariance)
    return bound(equation, covariance)


def _force_noise(equation: Any, noise: str, stiffness: FloatArray, tremor: float) -> FloatArray:
    smooth, lag = equation.modes.smooth, equation.lag_s
    n = len(smooth)
    covariance = np.kron(np.eye(2), (0.03**2 + 0.05**2 / 12) * np.eye(n))
    if noise == "nominal":
        apart = lag[:, None] - lag
        slow = 0.25**2 * np.exp(-np.abs(apart) / 0.4)
        kernel = slow + tremor * np.cos(2 * np.pi * 9.0 * apart)
        ramp = smooth @ lag
        covariance += np.kron(np.eye(2), smooth @ kernel @ smooth.T)
        covariance += np.kron(0.003**2 * stiffness @ stiffness.T, np.outer(ramp, ramp))
    return covariance


def frobenius_percent(covariance: FloatArray, truth: FloatArray) -> FloatArray:
    """Root of the mean squared Frobenius norm of the symmetric parts' errors, % of M, B, K."""
    half = np.zeros((4, 4))
    for i in range(2):
        for j in range(2):
            half[2 * i + j, 2 * i + j] += 0.5
            half[2 * i + j, 2 * j + i] += 0.5
    average = np.kron(np.eye(3), half)
    variances = np.diag(average @ covariance @ average.T).reshape(3, 4).sum(axis=1)
    return np.asarray(100 * np.sqrt(variances) / np.linalg.norm(truth, axis=(1, 2)))
