"""Noise of the position, told from the record itself."""

from __future__ import annotations

import numpy as np

from armimpedance.signals.encoder import position_noise
from armimpedance.signals.modes import spline_modes

RATE = 1000.0
T = np.arange(-0.16, 0.46 + 1e-9, 1 / RATE)


def moved(trials, bump, gains=None):
    """Motion (T, S, 1) of bumps of slightly different height, at rest before and after."""
    gains = np.linspace(0.9, 1.1, trials) if gains is None else gains
    return gains[:, None, None] * np.asarray(bump(T, 0.3, 0.005)[0])[None, :, None]


def test_no_noise_is_none(limb):
    modes = spline_modes(len(T), RATE)
    found = position_noise(moved(8, limb.bump), RATE, modes)
    assert found.variance < (1e-9) ** 2


def test_analogue_noise_is_white_at_rest_and_in_motion(limb):
    rng = np.random.default_rng(1)
    modes = spline_modes(len(T), RATE)
    noisy = moved(40, limb.bump) + rng.normal(0, 5e-6, (40, len(T), 1))
    found = position_noise(noisy, RATE, modes)
    # fourth differences of 40 x 617 samples: the variance is known to about 1.3 %
    assert abs(found.variance / 25e-12 - 1) < 4 * 0.013
    white = 25e-12 * modes.stacked @ modes.stacked.T
    np.testing.assert_allclose(found.covariance[0], white, atol=0.06 * np.abs(white).max())


def test_an_encoder_errs_in_motion_only_and_by_a_pulse_beside_white_noise(limb):
    rng = np.random.default_rng(2)
    step, trials = 20e-6, 400
    modes = spline_modes(len(T), RATE)
    true = moved(trials, limb.bump, rng.uniform(0.8, 1.2, trials))
    phase = rng.uniform(0, step, (trials, 1, 1))
    read = np.round((true + phase) / step) * step - phase
    found = position_noise(read, RATE, modes)
    assert abs(found.variance / (step**2 / 12) - 1) < 0.15
    # what the encoder really did, referenced to rest as the estimators do
    error = (read - true)[:, :, 0]
    error = error - error[:, :100].mean(axis=1, keepdims=True)
    n = modes.count
    actual = np.cov((error @ modes.smooth.T).T)
    model = found.covariance[0][2 * n :, 2 * n :]
    # a model of three numbers: the total agrees to a third
    assert 0.67 < np.trace(model) / np.trace(actual) < 1.5
    rest = modes.smooth[:, T < -0.03]
    quiet = np.abs(rest).sum(axis=1) > 0.999 * np.abs(modes.smooth).sum(axis=1)
    assert np.diag(model)[quiet].max(initial=0.0) < 1e-3 * np.diag(model).max()
