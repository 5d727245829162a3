"""Noise of the position, told from the record itself."""

from __future__ import annotations

import numpy as np

from armimpedance.numerics.signals.modes import grid_step, position_noise, spline_modes

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


def test_a_grid_is_found_and_its_noise_read_again(limb):
    rng = np.random.default_rng(2)
    step, trials = 20e-6, 400
    modes = spline_modes(len(T), RATE)
    true = moved(trials, limb.bump, rng.uniform(0.8, 1.2, trials))
    phase = rng.uniform(0, step, (trials, 1, 1))
    read = np.round((true + phase) / step) * step - phase
    found = position_noise(read, RATE, modes)
    assert abs(found.step / step - 1) < 1e-9
    # what the encoder really did, referenced to rest as the estimators do
    error = (read - true)[:, :, 0]
    error = error - error[:, :100].mean(axis=1, keepdims=True)
    n = modes.count
    actual = np.cov((error @ modes.smooth.T).T)
    model = found.covariance[0][2 * n :, 2 * n :]
    assert abs(np.trace(model) / np.trace(actual) - 1) < 0.12
    # where the hand starts and stops, the smoothed motion is not the true one: a factor there
    largest = np.diag(actual) > 0.3 * np.diag(actual).max()
    ratio = np.diag(model)[largest] / np.diag(actual)[largest]
    assert abs(np.median(ratio) - 1) < 0.1
    assert (np.abs(np.log(ratio)) < np.log(2)).all()
    rest = modes.smooth[:, T < -0.03]
    quiet = np.abs(rest).sum(axis=1) > 0.999 * np.abs(modes.smooth).sum(axis=1)
    assert quiet.any()
    assert np.diag(model)[quiet].max() < 1e-3 * np.diag(model).max()


def test_readings_without_a_grid_are_not_taken_for_any(limb):
    rng = np.random.default_rng(3)
    assert grid_step(moved(4, limb.bump)) == 0
    assert grid_step(moved(4, limb.bump) + rng.normal(0, 1e-6, (4, len(T), 1))) == 0
    assert grid_step(np.zeros((4, 50, 1))) == 0
    # encoders of two joints behind kinematics: still at rest, no grid along x and y
    angles = np.round(np.cumsum(rng.normal(0, 1e-4, (4, len(T), 2)), axis=1) / 1e-4) * 1e-4
    hand = 0.3 * np.cos(1 + angles[..., :1]) + 0.34 * np.cos(
        2.5 + angles.sum(axis=2, keepdims=True)
    )
    assert grid_step(hand) == 0


def test_noise_in_motion_without_a_grid_is_a_pulse_beside_white_noise(limb):
    rng = np.random.default_rng(4)
    modes = spline_modes(len(T), RATE)
    true = moved(200, limb.bump)
    moving = (T > 0.0) & (T < 0.3)
    noise = 5e-6 * rng.normal(size=true.shape) * moving[None, :, None]
    found = position_noise(true + noise, RATE, modes)
    assert found.step == 0
    assert abs(found.variance / 25e-12 - 1) < 0.15
    n = modes.count
    resting = np.abs(modes.smooth[:, ~moving]).sum(axis=1) > 0.999 * np.abs(modes.smooth).sum(
        axis=1
    )
    at_rest = np.diag(found.covariance[0])[2 * n :][resting]
    assert resting.any()
    assert at_rest.max() < 1e-3 * np.diag(found.covariance[0])[2 * n :].max()
