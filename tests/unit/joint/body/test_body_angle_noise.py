"""Noise of the coordinates: its level seen, its bias taken off."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.joint.body.angle_noise import can_tell_noise, coordinate_noise
from armimpedance.joint.body.identify import identify_body
from armimpedance.joint.body.regressor import inertial_parameters
from armimpedance.joint.body.rows import RowChoice

ANGLE, PLACE, CUTOFF_HZ = 2e-3, 5e-4, 6.0


@pytest.fixture(scope="module")
def shaken(small, rigs):
    """Three motions of a small tree with sensors' noise on the plate, exact coordinates."""
    rng = np.random.default_rng(1)
    parts, forces = [], []
    for _ in range(3):
        # slow and small: the noise's accelerations are as large as the motion's
        t, q, qd, qdd = rigs.splined(len(small.coordinates), 8.0, rng, size=0.15, hz=0.7)
        parts.append((t, q))
        forces.append(rigs.contact_wrench(small, q, qd, qdd))
    recording = rigs.record(small, parts, forces)
    w = recording.wrenches
    return replace(recording, wrenches=w + 0.05 * rng.standard_normal(w.shape))


def noisy(recording, seed, size=1.0):
    rng = np.random.default_rng(seed)
    sd = np.full(recording.coordinates.shape[1], ANGLE)
    sd[:3] = PLACE
    q = recording.coordinates
    return replace(recording, coordinates=q + size * sd * rng.standard_normal(q.shape))


def fitted(recording, **how):
    choice = RowChoice(cutoff_hz=CUTOFF_HZ)
    return identify_body(recording, choice=choice, motions=None, check=False, **how)


def test_the_level_of_white_noise_is_seen(shaken):
    level = coordinate_noise(noisy(shaken, 0), CUTOFF_HZ).std(axis=0)
    # 2,400 samples, six tenths of the band: a standard error of 2 %
    np.testing.assert_allclose(level[:3], PLACE, rtol=0.08)
    np.testing.assert_allclose(level[3:], ANGLE, rtol=0.08)


def test_errors_that_hang_together_are_seen_to_do_so(shaken):
    rng = np.random.default_rng(2)
    q = shaken.coordinates.copy()
    common = ANGLE * rng.standard_normal(len(q))
    q[:, 4] += common
    q[:, 7] -= common
    seen = coordinate_noise(replace(shaken, coordinates=q), CUTOFF_HZ)
    assert np.corrcoef(seen[:, 4], seen[:, 7])[0, 1] < -0.95


@pytest.mark.study
def test_the_bias_of_noise_is_taken_off(shaken, small):
    truth = inertial_parameters(small)
    left, off = [], []
    for seed in range(6):
        recording = noisy(shaken, seed)
        for found, draws in ((left, 0), (off, 6)):
            fit = fitted(recording, noise_draws=draws)
            found.append((fit.parameters.values - fit.base.of(truth)) / np.abs(fit.base.of(truth)))
    bias = [np.abs(np.mean(found, axis=0)) for found in (left, off)]
    # what a filter does to the motion itself, and noise of the plate, stay
    exact = np.abs(fitted(shaken).parameters.values / fit.base.of(truth) - 1)
    moved = bias[0] > 2 * exact + 0.05
    assert moved.sum() >= 10
    assert bias[1][moved].sum() < 0.67 * bias[0][moved].sum()


@pytest.mark.study
def test_intervals_hold_where_noise_would_make_them_too_short(shaken, small):
    truth = inertial_parameters(small)
    held = {0: [], 6: []}
    for seed in range(10):
        recording = noisy(shaken, 100 + seed)
        for draws, found in held.items():
            fit = fitted(recording, noise_draws=draws)
            low, high = np.array([p.ci95 for p in fit.summary.parameters]).T
            b = fit.base.of(truth)
            found.append((low <= b) & (b <= high))
    shares = {draws: float(np.mean(found)) for draws, found in held.items()}
    # a line through two points takes off most of a bias as large as the parameter, not all
    assert shares[0] < 0.7
    assert shares[6] > shares[0] + 0.2


def test_without_noise_nothing_is_taken_off(shaken):
    left, off = fitted(shaken, noise_draws=0), fitted(shaken)
    # the filter's ends count as a little noise
    assert np.abs(off.noise.shift).max() < 0.01 * left.parameters.sd.max()
    assert (np.abs(off.noise.shift) < 0.1 * left.parameters.sd).all()
    assert left.noise is None
    assert off.noise.level < 0.01 * ANGLE


def test_plain_least_squares_and_exact_data_are_left_alone(shaken):
    recording = noisy(shaken, 0)
    assert fitted(recording, method="ls").noise is None
    unfiltered = identify_body(recording, choice=RowChoice(), motions=None, check=False)
    assert unfiltered.noise is None


def test_the_same_recording_gives_the_same_bits(shaken):
    recording = noisy(shaken, 3)
    assert np.array_equal(fitted(recording).parameters.values, fitted(recording).parameters.values)


def test_slow_cameras_cannot_tell_noise_from_motion(shaken):
    slow = replace(shaken, sample_rate_hz=30.0)
    assert can_tell_noise(shaken, RowChoice(cutoff_hz=CUTOFF_HZ))
    assert not can_tell_noise(slow, RowChoice(cutoff_hz=CUTOFF_HZ))
    assert can_tell_noise(slow, RowChoice(cutoff_hz=2.0))
    assert not can_tell_noise(shaken, RowChoice())
