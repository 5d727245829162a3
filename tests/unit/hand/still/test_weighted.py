"""Weighted estimates: the truth without noise, no attenuation with it, and the ways back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from armimpedance.core.errors import NotIdentifiableError
from armimpedance.hand.still.estimation import Options, estimate
from armimpedance.hand.still.methods import exact, weighted
from armimpedance.hand.still.modal import expected_motion, modal_equation, weighted_equations
from armimpedance.hand.still.weighing import NAMES, weighted_fit
from armimpedance.numerics.regression.equations import solve_total
from armimpedance.numerics.signals.windows import cut_windows

WEIGHTED = Options(method="weighted")
#: Durations of which no two are alike, s.
UNLIKE_S = (0.1, 0.13, 0.17, 0.22, 0.29, 0.38)


def truth(limb):
    return np.stack([limb.M, limb.B, limb.K])


def encoder(recording, step, seed=0):
    """The recording read by an encoder whose grid lies elsewhere in every trial."""
    rng = np.random.default_rng(seed)
    phase = rng.uniform(0, step, (recording.n_trials, recording.axes))
    phase = np.repeat(phase, np.diff(recording.offsets), axis=0)
    return replace(recording, position=np.round((recording.position + phase) / step) * step - phase)


@pytest.mark.parametrize("duration", [0.15, 0.3, 0.4])
def test_noise_free_truth_comes_back(limb, duration):
    made = estimate(limb.record(duration=duration, drift=0.003), options=WEIGHTED)[0]
    found = np.stack([made.inertia, made.viscosity, made.stiffness])
    for matrix, true in zip(found, truth(limb), strict=True):
        assert np.linalg.norm(matrix - true) < 2e-3 * np.linalg.norm(true)


def test_joints_of_one_axis_and_hands_of_three(limb):
    one = {"inertia": np.array([[0.1]]), "viscosity": np.array([[1.2]]), "kind": "joint"}
    made = estimate(limb.record(stiffness=np.array([[30.0]]), **one), options=WEIGHTED)[0]
    assert abs(made.stiffness[0, 0] - 30) < 0.1
    three = {name: np.diag([1.0, 2.0, 3.0]) for name in ("inertia", "viscosity")}
    three["stiffness"] = 50 * np.eye(3) + 10
    recording = limb.record(**three, directions=12, force_noise=0.01)
    made = estimate(recording, options=WEIGHTED)[0]
    apart = np.abs(made.stiffness - three["stiffness"])
    assert (apart < 4.5 * made.sd[2]).all()


def test_encoder_steps_do_not_shrink_inertia_as_they_shrink_least_squares(limb):
    """Steps of 0.1 mm: plain least squares on the same rows loses inertia, instruments do not."""
    biased, free = [], []
    for seed in range(12):
        recording = encoder(limb.record(seed=seed, force_noise=0.05), 1e-4, seed)
        found = weighted_fit(cut_windows(recording), "hand")
        unweighted = np.eye(2 * found.equation.modes.count)
        plain = weighted_equations(found.equation, unweighted, "hand")
        biased.append(solve_total(plain)[[0, 3]].sum())
        free.append(found.parameters[[0, 3]].sum())
    true = np.trace(limb.M)
    error = np.std(free) / np.sqrt(12)
    assert abs(np.mean(free) - true) < 3.5 * error
    assert np.mean(biased) - true < -6 * np.std(biased) / np.sqrt(12)


def test_two_durations_in_one_group_are_estimated_without_bias(limb):
    """Each trial is expected from those of its own duration."""
    short = limb.record(duration=0.1, after=0.45, seed=1)
    long = limb.record(duration=0.3, seed=2)
    trials = np.concatenate([short.trials.to_dict("records"), long.trials.to_dict("records")])
    table = pd.DataFrame(list(trials))
    table["trial"] = np.arange(1, len(table) + 1)
    both = replace(
        long,
        trials=table,
        offsets=np.concatenate([short.offsets, short.offsets[-1] + long.offsets[1:]]),
        time_s=np.concatenate([short.time_s, long.time_s]),
        position=np.concatenate([short.position, long.position]),
        force=np.concatenate([short.force, long.force]),
    )
    both = encoder(both, 2e-5)
    window = cut_windows(both)
    expected = expected_motion(modal_equation(window)).reshape(80, 3, 2, -1)
    apart = np.linalg.norm(expected - modal_equation(window).motion, axis=(2, 3))
    size = np.linalg.norm(expected, axis=(2, 3))
    assert (apart[:, 2] < 0.02 * size[:, 2]).all()
    made = estimate(both, options=WEIGHTED)[0]
    found = np.stack([made.inertia, made.viscosity, made.stiffness])
    for matrix, true in zip(found, truth(limb), strict=True):
        assert np.linalg.norm(matrix - true) < 0.02 * np.linalg.norm(true)


def test_without_a_shared_course_the_noise_is_taken_off(limb):
    """Trials that are all unlike each other have no instruments: compensation takes over."""
    parts = [limb.record(duration=d, after=0.75 - d, seed=n) for n, d in enumerate(UNLIKE_S)]
    longest = parts[-1]
    chosen = [part.select(np.arange(2) * 2 + (n % 2)) for n, part in enumerate(parts)]
    table = pd.concat([part.trials for part in chosen], ignore_index=True)
    table["trial"] = np.arange(1, len(table) + 1)
    lengths = np.concatenate([np.diff(part.offsets) for part in chosen])
    both = replace(
        longest,
        trials=table,
        offsets=np.concatenate([[0], np.cumsum(lengths)]),
        time_s=np.concatenate([part.time_s for part in chosen]),
        position=np.concatenate([part.position for part in chosen]),
        force=np.concatenate([part.force for part in chosen]),
    )
    both = encoder(both, 2e-5)
    assert expected_motion(modal_equation(cut_windows(both))) is None
    made = estimate(both, options=WEIGHTED)[0]
    found = np.stack([made.inertia, made.viscosity, made.stiffness])
    for matrix, true in zip(found, truth(limb), strict=True):
        assert np.linalg.norm(matrix - true) < 0.05 * np.linalg.norm(true)


def test_expected_motion_does_not_hear_a_trials_own_noise(limb):
    window = cut_windows(limb.record())
    equation = modal_equation(window)
    rng = np.random.default_rng(0)
    noisy = np.array(equation.motion)
    jitter = 1e-5 * rng.normal(size=noisy[0].shape)
    # leave the displacement alone: it alone tells the trial's direction
    jitter[2] = 0
    noisy[0] += jitter
    before, after = expected_motion(equation), expected_motion(replace(equation, motion=noisy))
    scale = np.abs(before).max()
    np.testing.assert_allclose(before[0], after[0], atol=1e-12 * scale)
    assert np.abs(before[1] - after[1]).max() > 1e-9 * scale


def test_noise_is_told_apart(limb):
    """White force noise of known size and nothing else: the model says so."""
    recording = limb.record(force_noise=0.05, sets=10)
    found = weighted_fit(cut_windows(recording), "hand")
    white = np.diag(found.noise.sizes[NAMES.index("white")])
    # 80 trials of 26 modes and 2 axes: the variance to some 3 %, less what others take of it
    assert (np.abs(white / 0.05**2 - 1) < 0.2).all()


def test_efficiency_is_near_one_where_the_model_holds(limb):
    made = estimate(limb.record(force_noise=0.05, sets=20), options=WEIGHTED)[0]
    ratio = np.array(made.efficiency)
    # variances from 160 trials: each ratio within some 11 %, one standard error
    assert (np.abs(ratio - 1) < 0.45).all()
    assert abs(ratio.mean() - 1) < 0.2


def test_other_methods_get_the_bound_too_and_do_not_beat_it(limb):
    recording = limb.record(force_noise=0.05, sets=10)
    plain = estimate(recording, options=Options(method="exact"))[0]
    assert np.array(plain.efficiency).mean() < 0.95


def test_few_trials_are_not_weighed_and_the_result_says_so(limb):
    recording = limb.record(force_noise=0.01, directions=3, sets=1)
    made = estimate(recording, options=WEIGHTED)[0]
    assert "too few to weigh" in " ".join(made.provenance)
    plain = estimate(recording, options=Options(method="exact"))[0]
    np.testing.assert_array_equal(made.stiffness, plain.stiffness)
    assert made.bound is None


def test_one_direction_is_refused(limb):
    recording = limb.record()
    rows = (recording.trials["direction_deg"].to_numpy() % 180) == 0
    with pytest.raises(NotIdentifiableError, match="one direction only"):
        estimate(recording.select(rows), options=WEIGHTED)


def test_scaling_force_scales_the_estimate(limb):
    recording = limb.record(force_noise=0.05)
    twice = replace(recording, force=2 * recording.force)
    one, two = (estimate(r, options=WEIGHTED)[0] for r in (recording, twice))
    np.testing.assert_allclose(two.stiffness, 2 * one.stiffness, rtol=1e-6)
    np.testing.assert_allclose(two.sd, 2 * one.sd, rtol=1e-6)


def test_the_order_of_trials_does_not_matter(limb):
    recording = limb.record(force_noise=0.05)
    order = np.random.default_rng(3).permutation(recording.n_trials)
    one, two = (estimate(r, options=WEIGHTED)[0] for r in (recording, recording.select(order)))
    np.testing.assert_allclose(two.stiffness, one.stiffness, rtol=1e-8)


def test_exact_keeps_its_rows_for_judging(limb):
    window = cut_windows(limb.record(force_noise=0.05))
    plain, found = exact.prepare(window, "hand"), weighted.prepare(window, "hand")
    np.testing.assert_array_equal(plain.factors.r, found.factors.r)


def test_without_noise_there_is_nothing_to_weigh_by(limb):
    """A law that is bent over the disturbance: residuals are curvature, not noise."""
    recording = limb.record(sets=1)
    force = recording.force.copy()
    for row in range(recording.n_trials):
        at = recording.samples_of(row)
        moved = recording.position[at] - recording.position[at][0]
        size = (moved**2).sum(axis=1, keepdims=True) / 0.005**2
        force[at] += 0.3 * size * moved @ limb.K.T
    bent = replace(recording, force=force)
    plain = estimate(bent, options=Options("exact"))[0]
    default = estimate(bent)[0]
    np.testing.assert_array_equal(default.stiffness, plain.stiffness)
    assert any("no noise" in note for note in default.provenance)


def test_the_noise_of_a_sensor_is_weighed_by(limb):
    noisy = limb.record(sets=1, force_noise=0.003)
    assert not any("no noise" in note for note in estimate(noisy)[0].provenance)
