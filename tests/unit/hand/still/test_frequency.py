"""Frequency domain: exact for any motion, weighted by what replicates show, refused without."""

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.hand.still.estimation import Options, estimate
from armimpedance.hand.still.methods.frequency import line_weight, replicate_noise, tapered_lines
from armimpedance.hand.still.modal import modal_equation
from armimpedance.numerics.signals.windows import cut_windows

BY_LINES = Options(method="frequency")


def test_lines_of_derivatives_hold_for_motions_that_do_not_return():
    """x = exp(t / 0.2) neither starts nor ends at rest: taper and derivative still commute."""
    t = np.arange(601) / 1000
    x = np.exp(t / 0.2)
    modes = tapered_lines(601, 1000.0, 150).modes
    assert modes.first @ x == pytest.approx(modes.smooth @ (x / 0.2), rel=1e-5, abs=1e-4)
    assert modes.second @ x == pytest.approx(modes.smooth @ (x / 0.04), rel=1e-4, abs=1e-2)


def test_noise_free_gives_the_truth_whatever_the_drift_and_the_end(limb):
    recording = limb.record(sets=2, drift=0.05)
    recording = replace(recording, trials=recording.trials.assign(end_s=0.25 + 0.21))
    made = estimate(recording, options=BY_LINES)[0]
    assert np.linalg.norm(made.inertia - limb.M) < 2e-3 * np.linalg.norm(limb.M)
    assert np.linalg.norm(made.viscosity - limb.B) < 2e-3 * np.linalg.norm(limb.B)
    assert np.linalg.norm(made.stiffness - limb.K) < 2e-3 * np.linalg.norm(limb.K)


def test_weight_is_blind_to_offset_and_ramp():
    lines = tapered_lines(601, 1000.0, 150)
    noise = np.stack([np.array([[2.0, 0.5], [0.5, 1.0]]) * (1 + k) for k in range(12)])
    V = line_weight(noise[: lines.line.max() + 1], lines)
    N = np.kron(np.eye(2), lines.drift)
    assert np.abs(V @ N).max() < 1e-10 * np.abs(V).max() * np.abs(N).max()
    assert np.linalg.eigvalsh(V)[0] > -1e-10 * np.abs(V).max()


def test_replicates_find_the_line_that_trembles_and_weighting_gains_by_it(limb):
    """A tremor of 9 Hz in x only: its line carries most noise, in x; standard errors fall to less
    than half of those of the unweighted fit."""
    recording = limb.record(sets=5, force_noise=0.02)
    rng = np.random.default_rng(2)
    n, samples = recording.n_trials, int(recording.offsets[1])
    t = np.arange(samples) / 1000
    phase = rng.uniform(0, 2 * np.pi, (n, 1))
    force = recording.force.copy()
    force[:, 0] += (0.5 * np.sin(2 * np.pi * 9.0 * t + phase)).ravel()
    recording = replace(recording, force=force)
    window = cut_windows(recording)
    lines = tapered_lines(len(window.lag_s), 1000.0, 160)
    true = np.concatenate([limb.M, limb.B, limb.K], axis=None)
    equation = modal_equation(window, lines.modes)
    noise = replicate_noise(equation, lines, np.arange(n) % 8, true)
    spacing = 1 / (1.5 * (window.lag_s[-1] - window.lag_s[0] - 0.16))
    assert abs(spacing * np.argmax(noise[:, 0, 0]) - 9.0) <= spacing
    assert noise[:, 0, 0].max() > 100 * noise[:, 1, 1].max()
    weighted = estimate(recording, options=BY_LINES)[0]
    plain = estimate(recording, options=Options(method="exact"))[0]
    assert weighted.sd[2, 0, 0] < 0.5 * plain.sd[2, 0, 0]
    assert np.abs((weighted.parameters - true) / weighted.sd.ravel()).max() < 4


def test_too_few_replicates_are_refused_with_the_reason(limb):
    with pytest.raises(InputError, match="8 trials of 8 directions"):
        estimate(limb.record(sets=1), options=BY_LINES)
    recording = limb.record(sets=2)
    blind = replace(recording, trials=recording.trials.drop(columns="direction_deg"))
    with pytest.raises(InputError, match="direction_deg"):
        estimate(blind, options=BY_LINES)


def test_a_short_window_is_refused(limb):
    recording = limb.record(sets=2, duration=0.1, before=0.02, after=0.02)
    with pytest.raises(InputError, match="for a spectrum"):
        estimate(recording, options=BY_LINES)


def test_noise_of_the_position_does_not_shrink_the_inertia(limb):
    """White noise of 0.4 mm and 1 N: the same lines with each trial's own motion as its instrument
    lose more than 10 % of M_22; with that of the other replicates all of M stays within four
    standard errors. (Against less force noise the weights turn to lines that bear the noise.)"""
    from armimpedance.hand.still.modal import weighted_equations
    from armimpedance.numerics.regression.equations import solve_total

    recording = limb.record(sets=10, force_noise=1.0)
    noise = np.random.default_rng(4).normal(0, 4e-4, recording.position.shape)
    recording = replace(recording, position=recording.position + noise)
    made = estimate(recording, options=BY_LINES)[0]
    assert np.abs((made.inertia - limb.M) / made.sd[0]).max() < 4
    window = cut_windows(recording)
    lines = tapered_lines(len(window.lag_s), 1000.0, 160)
    equation = modal_equation(window, lines.modes)
    labels = np.arange(recording.n_trials) % 8
    spread = replicate_noise(equation, lines, labels, made.parameters)
    own = solve_total(weighted_equations(equation, line_weight(spread, lines), "hand"))
    assert own[3] < 0.9 * limb.M[1, 1]
