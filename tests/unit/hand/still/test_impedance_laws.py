"""Laws of the impedance's room: jackknives are refits, intervals follow from their covariance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from armimpedance.hand.still import METHODS, Options, check_response, estimate
from armimpedance.hand.still.reflex import reflex_guard
from armimpedance.hand.still.side_by_side import side_by_side
from armimpedance.hand.still.variance_components import fit_components, total_covariance
from armimpedance.numerics.signals import cut_windows

MATRICES = ("inertia", "viscosity", "stiffness")


@pytest.fixture(scope="module")
def noisy(limb):
    """Sixteen trials, two of each direction."""
    return limb.record(sets=2, force_noise=0.2, seed=4)


def matrices(estimate):
    each = np.stack([getattr(estimate, name) for name in MATRICES])
    return (each + each.transpose(0, 2, 1)) / 2


# Methods side by side


def test_chance_in_a_difference_is_the_jackknife_over_trials(limb):
    """Brute force: both methods once more without each trial, ``(T - 1)/T`` of the squares."""
    recording = limb.record(sets=1, force_noise=0.2, seed=9)
    side = side_by_side(recording, options=Options(method="exact"))[0]
    told = next(d for d in side.disagreements if d.method == "paper")

    def apart(some):
        a, b = (matrices(estimate(some, options=Options(m))[0]) for m in ("paper", "exact"))
        return a - b, b

    whole, reference = apart(recording)
    T = recording.n_trials
    moved = [whole - apart(recording.select(np.arange(T) != t))[0] for t in range(T)]
    chance = np.sqrt((T - 1) / T * (np.square(moved)).sum(axis=(0, 2, 3)))
    size = np.linalg.norm(whole, axis=(1, 2))
    np.testing.assert_allclose(told.standard_errors, size / chance, rtol=1e-3)
    percent = 100 * size / np.linalg.norm(reference, axis=(1, 2))
    np.testing.assert_allclose(told.percent, percent, rtol=1e-6)


@pytest.mark.parametrize("method", list(METHODS))
def test_every_method_says_how_it_came_about(noisy, method):
    """Beside what all methods share, one sentence or more of its own, but for the plain one."""
    plain = estimate(noisy, options=Options("exact"))[0]
    made = estimate(noisy, options=Options(method))[0]
    assert made.method == method
    if method not in ("exact", "paper"):
        assert set(made.provenance) - set(plain.provenance)
    assert not any("-1" in sentence for sentence in made.provenance)


def test_the_weights_say_of_how_many_trials_they_are(noisy):
    for trials, sentence in ((16, "weighted by the noise of 16 trials"), (3, "3 trials are too")):
        made = estimate(noisy.select(np.arange(trials)), options=Options("weighted"))[0]
        assert any(told.startswith(sentence) for told in made.provenance)


def test_the_source_fits_from_the_onset_to_the_end_with_both(noisy):
    """300 ms at 1 kHz: 301 rows of each of 16 trials."""
    made = estimate(noisy, options=Options("paper"))[0]
    assert made.quality.n_rows == 16 * 301
    assert made.quality.n_trials == 16


@pytest.mark.parametrize("method", list(METHODS))
def test_units_of_force_scale_every_matrix_and_its_error(noisy, method):
    """The force in other units: M, B, K in those units, covariances in their squares."""
    one = estimate(noisy, options=Options(method))[0]
    other = estimate(replace(noisy, force=8.0 * noisy.force), options=Options(method))[0]
    for name in MATRICES:
        np.testing.assert_allclose(getattr(other, name), 8 * getattr(one, name), rtol=1e-5)
    np.testing.assert_allclose(other.sd, 8 * one.sd, rtol=1e-4)


@pytest.mark.parametrize("method", list(METHODS))
def test_turned_axes_turn_every_matrix(noisy, method):
    """Axes of the laboratory turned by a right angle: the same limb, its matrices turned."""
    R = np.array([[0.0, -1.0], [1.0, 0.0]])
    turned = replace(noisy, position=noisy.position @ R.T, force=noisy.force @ R.T, shoulder_m=None)
    one, other = (estimate(r, options=Options(method))[0] for r in (noisy, turned))
    for name in MATRICES:
        expected = R @ getattr(one, name) @ R.T
        size = np.abs(expected).max()
        np.testing.assert_allclose(getattr(other, name), expected, atol=1e-6 * size)


# Reflexes


@pytest.fixture(scope="module")
def verdict(limb):
    """A limb that answers 53 ms late, its delay known."""
    recording = limb.record(duration=0.15, force_noise=0.3, drift=0.003)
    force, lag = recording.force.copy(), 53
    answer = np.array([[20.0, -15.0], [-15.0, 50.0]])
    for row in range(recording.n_trials):
        at = recording.samples_of(row)
        moved = recording.position[at] - recording.position[at][0]
        force[at][lag:] -= moved[:-lag] @ answer.T
    return reflex_guard(replace(recording, force=force), delay_s=0.053)[0]


def test_shares_have_the_limits_that_the_covariance_gives_them(verdict):
    """By differences: ``<K_without, K>/<K, K> - 1`` and ``<R, K>/<K, K>`` of symmetric parts."""
    q = verdict.intrinsic.size
    values = np.concatenate(
        [m.ravel() for m in (verdict.without, verdict.intrinsic, verdict.reflex)]
    )

    def shares(x):
        without, K, R = ((m + m.T) / 2 for m in x.reshape(3, *verdict.intrinsic.shape))
        return np.array([(without * K).sum(), (R * K).sum()]) / (K**2).sum() - [1, 0]

    steps = 1e-4 * np.eye(3 * q)
    slopes = np.stack([(shares(values + h) - shares(values - h)) / 2e-4 for h in steps], axis=1)
    sd = np.sqrt(np.diag(slopes @ verdict.covariance @ slopes.T))
    half = stats.t.ppf(0.975, verdict.dof) * sd
    for told, value, reach in zip(
        (verdict.overstated, verdict.share), shares(values), half, strict=True
    ):
        assert told.value == pytest.approx(value, rel=1e-9)
        assert told.high - told.value == pytest.approx(reach, rel=1e-5)
        assert told.value - told.low == pytest.approx(reach, rel=1e-5)


def test_the_total_has_the_error_of_a_sum(verdict):
    q = verdict.intrinsic.size
    both = np.kron([[0.0, 1.0, 1.0]], np.eye(q))
    expected = np.sqrt(np.diag(both @ verdict.covariance @ both.T)).reshape(2, 2)
    np.testing.assert_allclose(verdict.total_sd, expected, rtol=1e-9)
    np.testing.assert_allclose(verdict.total, verdict.intrinsic + verdict.reflex)


def test_a_change_along_itself_is_one(verdict):
    """Of every end: the projection on its own symmetric part, whatever that is multiplied by."""
    for end, change in enumerate(verdict.ends.change):
        if end == verdict.ends.early:
            continue
        for factor in (1.0, 3.0):
            part, sd = verdict.ends.along(factor * change)
            assert part[end] == pytest.approx(1 / factor)
            assert sd[end] > 0


# Delays


def late_by(recording, samples):
    rows = recording.force.reshape(recording.n_trials, -1, recording.force.shape[1])
    return replace(recording, force=np.roll(rows, samples, axis=1).reshape(recording.force.shape))


@pytest.mark.first_cases(2)
@pytest.mark.parametrize("samples", [-15, 2, -2, 15])
def test_delays_of_either_sign_are_told(noisy, samples):
    """The channel that is late is named; a position that is 15 ms late is refused."""
    check = {c.name: c for c in check_response(late_by(noisy, samples))}["delay"]
    assert check.verdict == ("unusable" if samples == -15 else "warning")
    assert f"{'force' if samples > 0 else 'position'} comes" in check.message


def test_too_few_trials_to_judge_by_are_no_warning(limb):
    recording = limb.record(sets=1, directions=4, force_noise=0.01)
    check = {c.name: c for c in check_response(recording)}["delay"]
    assert (check.verdict, check.smallest) == ("ok", "")


@pytest.mark.parametrize("rest_s", [0.09, 0.25])
def test_lines_are_counted_as_they_lie(limb, rest_s):
    """Lines up to 15 Hz lie 1/(1.5 L) apart, L the window less one rise of its taper.

    The taper rises over the rest, within 80 and 160 ms.
    """
    recording = limb.record(sets=5, before=rest_s, after=rest_s, force_noise=0.1)
    window = cut_windows(recording)
    made = estimate(recording, options=Options("frequency"))[0]
    rest = min(-window.lag_s[0], window.lag_s[-1] - 0.3)
    length = window.lag_s[-1] - window.lag_s[0] - min(max(rest, 0.08), 0.16)
    count = int(15 * 1.5 * length) + 1
    assert any(sentence.startswith(f"{count} lines up to 15 Hz") for sentence in made.provenance)


# Variance components


def test_a_component_without_a_shape_takes_no_part():
    """A shape of zeros adds nothing, whatever its size, and nothing divides by its trace."""
    n, rng = 6, np.random.default_rng(3)
    rows = rng.normal(size=(400, 2 * n))
    moment = rows.T @ rows / 400
    none = np.zeros((2 * n, 2 * n))
    shapes = np.stack([np.eye(n), np.zeros((n, n))])
    flags = np.zeros(2, dtype=bool)
    with np.errstate(all="raise", under="ignore"):
        sizes = fit_components(moment, shapes, none, isotropic=flags, steps=1)
    assert np.isfinite(sizes).all()
    np.testing.assert_allclose(
        total_covariance(sizes[:1], shapes[:1], none), np.kron(sizes[0], np.eye(n)), atol=1e-12
    )


@pytest.mark.parametrize("d", [1, 2, 3])
def test_one_white_component_is_the_mean_square(d):
    """Sigma = S (x) 1: the likelihood's S is the mean over time of r r', for any number of axes."""
    n, rng = 8, np.random.default_rng(d)
    mix = np.eye(d) + 0.3 * rng.normal(size=(d, d))
    rows = np.einsum("ab,tbi->tai", mix, rng.normal(size=(500, d, n))).reshape(500, d * n)
    moment = rows.T @ rows / 500
    blocks = moment.reshape(d, n, d, n)
    expected = np.einsum("aibi->ab", blocks) / n
    none = np.zeros((d * n, d * n))
    sizes = fit_components(
        moment, np.eye(n)[None], none, isotropic=np.zeros(1, dtype=bool), steps=300
    )
    np.testing.assert_allclose(sizes[0], expected, rtol=1e-6, atol=1e-8)
