"""Instruments: right where noise of the position biases least squares, and refused without any."""

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.hand.still.estimation import Options, estimate
from armimpedance.hand.still.methods import exact, instruments
from armimpedance.hand.still.methods.instruments import instrumented, mean_of_others
from armimpedance.hand.still.prepared import Prepared, impedance_factors
from armimpedance.numerics.regression.equations import solve_equations
from armimpedance.numerics.signals.response import choose_span, respond
from armimpedance.numerics.signals.windows import cut_windows

BY_INSTRUMENTS = Options(method="instruments")


def _noisy(limb, sets, noise, seed=0):
    """Position noise that is white: at 60 us rms, half the acceleration behind a short kernel."""
    recording = limb.record(sets=sets, force_noise=0.02, seed=seed)
    rng = np.random.default_rng(seed + 100)
    noise = rng.normal(0, noise, recording.position.shape)
    return replace(recording, position=recording.position + noise)


def _commanded(recording, limb):
    """With columns of the exact motion."""
    true = limb.record(sets=recording.n_trials // 8).position
    return replace(recording, extra={"x_command_m": true[:, 0], "y_command_m": true[:, 1]})


def _errors_in_se(limb, prepared):
    """Errors of all elements in standard errors, and the elements."""
    solved = solve_equations(prepared.trial_equations("hand"))
    true = np.concatenate([limb.M, limb.B, limb.K], axis=None)
    return (solved.parameters - true) / np.sqrt(np.diag(solved.covariance)), solved.parameters


@pytest.mark.parametrize("commanded", [False, True])
def test_noise_free_gives_the_truth(limb, commanded):
    recording = limb.record(sets=2)
    recording = _commanded(recording, limb) if commanded else recording
    made = estimate(recording, options=BY_INSTRUMENTS)[0]
    assert made.inertia == pytest.approx(limb.M, rel=1e-3)
    assert made.stiffness == pytest.approx(limb.K, rel=1e-3, abs=0.1)
    used = "the commanded motion" if commanded else "the mean motion of the other trials"
    assert any(used in note for note in made.provenance)


@pytest.mark.parametrize("commanded", [False, True])
def test_short_kernels_bias_least_squares_but_not_instruments(limb, commanded):
    """Kernel of 0.06 s, white position noise: M of least squares comes out more than 20 % small.
    Instruments stay within four standard errors, and within 5 % of the truth."""
    recording = _noisy(limb, sets=10, noise=6e-5)
    window = cut_windows(_commanded(recording, limb) if commanded else recording)
    span = choose_span(window, kernel_s=0.06)
    plain = Prepared(impedance_factors(respond(window, span), "hand"))
    errors, found = _errors_in_se(limb, plain)
    assert found[0] < 0.8 * limb.M[0, 0]
    assert errors[0] < -10
    errors, found = _errors_in_se(limb, instrumented(window, "hand", kernel_s=0.06))
    assert np.abs(errors).max() < 4
    assert np.linalg.norm(found[:4] - limb.M.ravel()) < 0.05 * np.linalg.norm(limb.M)


def test_without_noise_least_squares_and_instruments_are_one(limb):
    window = cut_windows(limb.record(sets=2, force_noise=0.1))
    a = solve_equations(exact.prepare(window, "hand").trial_equations("hand"))
    b = solve_equations(instruments.prepare(window, "hand").trial_equations("hand"))
    assert b.parameters == pytest.approx(a.parameters, rel=1e-9)


def test_no_trial_is_its_own_instrument():
    columns = np.arange(10.0).reshape(5, 2, 1)
    mean = mean_of_others(columns, np.array([0, 1, 0, 0, 2]))
    assert mean[0] == pytest.approx((columns[2] + columns[3]) / 2)
    assert not mean[1].any()
    assert not mean[4].any()


def test_what_has_no_instruments_is_refused_with_the_reason(limb):
    with pytest.raises(InputError, match="no direction has two trials"):
        estimate(limb.record(sets=1), options=BY_INSTRUMENTS)
    recording = limb.record(sets=2)
    blind = replace(recording, trials=recording.trials.drop(columns="direction_deg"))
    with pytest.raises(InputError, match="direction of every trial"):
        estimate(blind, options=BY_INSTRUMENTS)


def test_a_command_that_never_moves_is_not_used(limb):
    recording = limb.record(sets=2)
    still = np.full(len(recording.position), 0.3)
    recording = replace(recording, extra={"x_command_m": still, "y_command_m": still})
    made = estimate(recording, options=BY_INSTRUMENTS)[0]
    assert any("other trials" in note for note in made.provenance)


def test_one_set_is_enough_with_a_command_and_a_lone_trial_counts_for_nothing(limb):
    made = estimate(_commanded(limb.record(sets=1), limb), options=BY_INSTRUMENTS)[0]
    assert made.stiffness == pytest.approx(limb.K, rel=1e-3, abs=0.1)
    recording = limb.record(sets=2).select(np.arange(15))
    made = estimate(recording, options=BY_INSTRUMENTS)[0]
    assert any("of no weight: 1 of 15 trials" in note for note in made.provenance)
