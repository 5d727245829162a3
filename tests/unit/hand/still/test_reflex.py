"""The reflex guard: names a reflex and its size, is silent without one, knows its limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.errors import InputError, NotIdentifiableError
from armimpedance.hand.still import reflex as reflex
from armimpedance.hand.still.reflex import guard_window, reflex_guard
from armimpedance.hand.still.reflex_scan import scan_delays, weigh
from armimpedance.hand.still.reflex_verdict import LEVEL, TELLING_SHARE, window_ends
from armimpedance.hand.still.show.text import headline
from armimpedance.hand.still.weighing import weighted_fit
from armimpedance.numerics.regression.equations import solve_equations, solve_total
from armimpedance.numerics.signals.windows import cut_windows

REFLEX = np.array([[20.0, -15.0], [-15.0, 50.0]])
DELAY_S = 0.053


def with_reflex(recording, answer=REFLEX, delay_s=DELAY_S):
    """The recording of a limb that also answers what happened `delay_s` earlier."""
    force, lag = recording.force.copy(), round(delay_s * recording.sample_rate_hz)
    for row in range(recording.n_trials):
        at = recording.samples_of(row)
        moved = recording.position[at] - recording.position[at][0]
        force[at][lag:] -= moved[:-lag] @ answer.T
    return replace(recording, force=force)


def window_of(limb, *, reflexive=True, duration=0.15, **fields):
    fields = {"force_noise": 0.3, "drift": 0.003} | fields
    recording = limb.record(duration=duration, **fields)
    return cut_windows(with_reflex(recording) if reflexive else recording)


@pytest.fixture(scope="module")
def reflexive(limb):
    return guard_window(window_of(limb), "hand")


def test_a_reflex_is_named_with_its_delay_and_size(limb, reflexive):
    assert reflexive.outcome == "contaminated"
    assert reflexive.p_value == pytest.approx(1 / 2000)
    assert reflexive.delay_low_s < DELAY_S < reflexive.delay_high_s
    assert reflexive.delay_high_s - reflexive.delay_low_s < 0.03
    # 4.5 standard errors: 8 elements of one experiment
    for found, sd, true in (
        (reflexive.intrinsic, reflexive.sd[1], limb.K),
        (reflexive.reflex, reflexive.sd[2], REFLEX),
        (reflexive.total, reflexive.total_sd, limb.K + REFLEX),
    ):
        assert (np.abs(found - true) < 4.5 * sd).all()
    share = (REFLEX * limb.K).sum() / (limb.K**2).sum()
    assert reflexive.share.low < share < reflexive.share.high
    assert reflexive.visible == ()


def test_overstated_is_what_the_model_without_reflex_gets_wrong(limb):
    """A bump of 0.3 s, the delay known, next to no noise: K is a fifth too large, and said so."""
    window = window_of(limb, duration=0.3, force_noise=0.003, drift=0.0)
    found = guard_window(window, "hand", delay_s=DELAY_S, ends=False)
    plain = weighted_fit(window, "hand").parameters[8:].reshape(2, 2)
    # another noise model, so another weight: within a few percent of K
    assert np.linalg.norm(found.without - plain) < 0.05 * np.linalg.norm(limb.K)
    assert np.linalg.norm(found.intrinsic - limb.K) < 0.05 * np.linalg.norm(limb.K)
    own = (found.intrinsic * limb.K).sum()
    assert found.overstated.value == pytest.approx(
        (found.without * limb.K).sum() / own - 1, abs=0.02
    )
    assert found.overstated.low > 0.1


@pytest.mark.study
def test_false_alarms_are_as_rare_as_promised(limb):
    """p <= .05 in 5 % of 100 experiments without a reflex: at most 11 (3 standard errors)."""
    alarms = 0
    for seed in range(100):
        window = window_of(limb, reflexive=False, seed=seed, sets=3)
        alarms += weigh(scan_delays(window, "hand", np.array(reflex.SCAN_S))).p_value <= 0.05
    assert alarms <= 11


def test_silence_says_how_large_a_reflex_would_have_been_seen(limb):
    found = guard_window(window_of(limb, reflexive=False, seed=3), "hand", ends=False)
    assert found.outcome == "none"
    shares = dict(found.visible)
    assert set(shares) == set(reflex.VISIBLE_S)
    assert 0 < found.seen_from() <= TELLING_SHARE
    # the promise: a reflex of that share of K is found in 95 % of 20 experiments; 3 errors: 16
    answer = shares[0.05] * limb.K
    seen = 0
    for seed in range(20):
        recording = limb.record(duration=0.15, force_noise=0.3, drift=0.003, seed=100 + seed)
        window = cut_windows(with_reflex(recording, answer, 0.05))
        seen += weigh(scan_delays(window, "hand", np.array(reflex.SCAN_S))).p_value <= LEVEL
    assert seen >= 16


@pytest.mark.study
def test_a_long_bump_cannot_tell(limb):
    found = guard_window(window_of(limb, reflexive=False, duration=0.4, force_noise=1.0), "hand")
    assert found.outcome == "unknown"
    assert found.seen_from() > TELLING_SHARE


def test_scan_agrees_with_a_fit_at_one_delay(limb):
    """Efficient scores over the efficient information are R of the full fit."""
    window = window_of(limb, duration=0.2)
    scan = scan_delays(window, "hand", np.array([DELAY_S]))
    full = solve_total(scan._equations((0,)))
    R = np.linalg.solve(scan.information[0, :, 0, :], scan.score.sum(axis=0)[0])
    np.testing.assert_allclose(R, full[12:], rtol=1e-6, atol=1e-6)
    without = solve_total(scan._equations(()))
    np.testing.assert_allclose(scan.without, without, rtol=1e-9, atol=1e-9)
    fits = scan.stiffness()
    np.testing.assert_allclose(fits.found[0, 4:], full[8:], rtol=1e-9, atol=1e-9)
    expected = solve_equations(scan._equations((0,))).covariance[8:, 8:]
    np.testing.assert_allclose(fits.covariance()[0, 4:, 4:], expected, rtol=1e-9, atol=1e-12)


def test_information_says_what_a_reflex_adds_to_the_scores_of_other_delays(limb):
    """Noise-free, one reflex: the scores at all delays are its own information's column."""
    delays = np.array([0.04, DELAY_S, 0.08])
    quiet = window_of(limb, reflexive=False, force_noise=0.1, drift=0.0)
    scan = scan_delays(quiet, "hand", delays)
    answered = scan_delays(window_of(limb, force_noise=0.1, drift=0.0), "hand", delays)
    gained = answered.score.sum(axis=0) - scan.score.sum(axis=0)
    promised = answered.information[:, :, 1, :] @ REFLEX.ravel()
    assert np.linalg.norm(gained - promised) < 0.05 * np.linalg.norm(promised)


def test_a_delay_that_is_given_narrows_the_intervals(limb, reflexive):
    known = guard_window(window_of(limb), "hand", delay_s=DELAY_S, ends=False)
    assert not known.scanned
    assert known.delay_low_s == known.delay_s == known.delay_high_s == DELAY_S
    assert (known.sd[1:] <= 1.05 * reflexive.sd[1:]).all()
    assert (np.abs(known.intrinsic - limb.K) < 4.5 * known.sd[1]).all()


@pytest.mark.study
def test_early_windows_do_not_see_the_reflex(limb):
    """Half a dozen experiments, mean: early K is the intrinsic one, late K is not."""
    made = [window_ends(window_of(limb, duration=0.2, seed=s), "hand") for s in range(6)]
    early = np.array([e.stiffness[e.early] for e in made])
    sd = np.sqrt(np.mean([np.diag(e.covariance[e.early]) for e in made], axis=0) / 6)
    assert (np.abs(early.mean(axis=0) - limb.K).ravel() < 4.5 * sd + 0.03 * 180).all()
    late = np.mean([e.along(limb.K)[0][-1] for e in made])
    error = np.mean([e.along(limb.K)[1][-1] for e in made]) / np.sqrt(6)
    assert late > 3 * error
    assert made[0].end_s[0] == pytest.approx(0.03)
    assert made[0].end_s[-1] == pytest.approx(0.36)


def test_change_between_windows_is_paired(limb):
    """Half of the noise cancels: the last steps are far better known than K itself."""
    ends = window_ends(window_of(limb, reflexive=False, duration=0.2), "hand")
    np.testing.assert_allclose(ends.change_covariance[ends.early], 0.0)
    apart = ends.covariance[-2] + ends.covariance[ends.early]
    assert np.trace(ends.change_covariance[-2]) < np.trace(apart)
    change, error = ends.along(limb.K)
    assert change[ends.early] == error[ends.early] == 0.0


def test_same_seed_same_verdict_and_turned_axes_turn_the_answer(limb):
    window = window_of(limb, sets=3)
    first, again = (guard_window(window, "hand", ends=False) for _ in range(2))
    assert first.p_value == again.p_value
    np.testing.assert_array_equal(first.covariance, again.covariance)
    turn = np.array([[0.8, -0.6], [0.6, 0.8]])
    turned = replace(
        window,
        position=window.position @ turn.T,
        force=window.force @ turn.T,
        position_at_onset=window.position_at_onset @ turn.T,
        force_at_onset=window.force_at_onset @ turn.T,
    )
    other = guard_window(turned, "hand", ends=False)
    scale = np.linalg.norm(first.intrinsic)
    # the noise model takes tremor's axes as equal but not those of drift: nearly, not exactly
    for name in ("intrinsic", "reflex"):
        back = turn.T @ getattr(other, name) @ turn
        assert np.linalg.norm(back - getattr(first, name)) < 0.03 * scale
    assert other.outcome == first.outcome


def test_a_reflex_that_does_not_matter_is_none(limb):
    """Hardly any noise, a reflex of .3 %: p is small, K is right all the same."""
    recording = limb.record(duration=0.15, force_noise=0.01)
    window = cut_windows(with_reflex(recording, 0.003 * limb.K))
    found = guard_window(window, "hand", ends=False)
    assert found.p_value <= LEVEL
    assert found.outcome == "none"
    assert "that matters" in headline(found)
    larger = cut_windows(with_reflex(recording, 0.03 * limb.K))
    assert guard_window(larger, "hand", ends=False).outcome == "contaminated"


def test_joints_of_one_axis(limb):
    one = {"inertia": [[0.1]], "viscosity": [[1.2]], "stiffness": np.array([[30.0]])}
    recording = limb.record(
        **{k: np.array(v) for k, v in one.items()}, kind="joint", duration=0.15, force_noise=0.01
    )
    found = reflex_guard(with_reflex(recording, np.array([[8.0]])), ends=False)[0]
    assert found.outcome == "contaminated"
    assert abs(found.reflex[0, 0] - 8.0) < 4.5 * found.sd[2, 0, 0]


def test_what_cannot_be_judged_is_refused(limb):
    few = limb.record(sets=1, directions=4, force_noise=0.1)
    with pytest.raises(InputError, match="condition c: 4 usable trials"):
        reflex_guard(few)
    recording = limb.record(sets=2, force_noise=0.1)
    for delay in (0.0, -0.05, 0.5, float("nan")):
        with pytest.raises(InputError, match="ms late"):
            reflex_guard(recording, delay_s=delay)
    with pytest.raises(InputError, match="no column"):
        reflex_guard(recording, by=["posture"])
    with pytest.raises(InputError, match="stochastic"):
        reflex_guard(replace(recording, perturbation="stochastic"))
    with pytest.raises(NotIdentifiableError, match="one direction only"):
        reflex_guard(limb.record(sets=10, directions=1, force_noise=0.1))
    with pytest.raises(NotIdentifiableError, match="no movement"):
        reflex_guard(limb.record(amplitude=0.0))
