"""Two pathways with courses: known truth comes back, bands hold, and what cannot be is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.joint.elbow import from_recording, identify_cascade
from armimpedance.joint.elbow.cascade.fit import Strengths, _least_squares, smooth
from armimpedance.joint.elbow.cascade.rows import Cells
from armimpedance.joint.elbow.show import elbow_over_time
from manipulandum_sim.elbow import Reflex, simulate_cascade


def _swing(size, hz):
    return lambda t: size * (1 + 0.35 * np.sin(2 * np.pi * hz * t + hz))


def _square(t):
    return np.where(t % 2 < 1, 40.0, 120.0)


def _total(found, value, truth):
    at = np.minimum(np.round(found.time_s * 1000).astype(int), len(truth) - 1)
    return np.sqrt(((value - truth[at]) ** 2).mean() / (truth[at] ** 2).mean())


@pytest.fixture(scope="module")
def two_pathways():
    one = Reflex(_swing(3.0, 0.12), delay_s=0.045)
    recording, truth = simulate_cascade(
        0.02, _swing(0.8, 0.14), _swing(60.0, 0.2), one, duration_s=10.0, seed=5
    )
    phase = (recording.time_s * 0.2) % 1
    still = np.ones(len(phase))
    return replace(
        recording,
        extra={"phase": phase, "still": still, "turns": 3 * phase, "hardly": 1 + 1e-5 * phase},
    ), truth


def test_intrinsic_and_reflex_courses_come_back_apart(two_pathways):
    recording, truth = two_pathways
    found = identify_cascade(from_recording(recording))
    assert _total(found, found.K, truth.K) < 0.05
    assert _total(found, found.B, truth.B) < 0.05
    assert found.reflex is not None
    assert _total(found, found.reflex.G, truth.G) < 0.1
    assert abs(found.reflex.delay_s - 0.045) < 0.003
    assert found.reflex.side == "positive"
    at = np.minimum(np.round(found.time_s * 1000).astype(int), len(truth.K) - 1)
    low, high = found.band("K").T
    assert ((low < truth.K[at]) & (truth.K[at] < high)).mean() > 0.8
    assert list(found.to_frame().columns[:1]) == ["time_s"]
    assert {"G", "ci_low_G", "delay_s"} <= set(found.to_frame().columns)


def test_courses_over_a_phase_are_those_of_the_phase():
    recording, _ = simulate_cascade(0.02, 0.8, _swing(60.0, 0.3), duration_s=10.0, seed=6)
    recording = replace(recording, extra={"phase": (recording.time_s * 0.3) % 1})
    found = elbow_over_time(recording, method="cascade-smooth", over="phase")
    truth = 60 * (1 + 0.35 * np.sin(2 * np.pi * found.time_s + 0.3))
    assert found.over == "phase"
    assert np.abs(found.K - truth).max() < 2.0


@pytest.mark.study
def test_the_unit_of_a_variable_changes_nothing(two_pathways):
    recording, _ = two_pathways
    volts = 3e-5 * (1 + 0.8 * np.sin(2 * np.pi * recording.extra["phase"]))
    small, large = (
        elbow_over_time(
            replace(recording, extra={"emg": unit * volts}), method="cascade", over="emg"
        )
        for unit in (1.0, 1e6)
    )
    np.testing.assert_allclose(small.K, large.K, rtol=1e-3)
    np.testing.assert_allclose(small.sd_K, large.sd_K, rtol=1e-2)
    assert np.ptp(small.K) > 20.0


@pytest.mark.study
def test_a_reflex_beyond_the_search_is_named():
    early = Reflex(_swing(3.0, 0.06), delay_s=0.003)
    recording, _ = simulate_cascade(0.02, 0.8, _swing(60.0, 0.1), early, duration_s=20.0, seed=12)
    found = identify_cascade(from_recording(recording), method="cascade-smooth")
    assert any("search ends" in warning for warning in found.warnings)


@pytest.mark.parametrize(
    ("over", "word"),
    [
        ("still", "nearly throughout"),
        ("hardly", "nearly throughout"),
        ("nothing", "no variable"),
    ],
)
def test_a_variable_that_cannot_be_is_one_clear_line(two_pathways, over, word):
    with pytest.raises(InputError, match=word):
        elbow_over_time(two_pathways[0], method="cascade", over=over)


def test_a_phase_outside_of_a_cycle_is_refused(two_pathways):
    recording, _ = two_pathways
    outside = replace(recording, extra={"phase": recording.extra["turns"]})
    with pytest.raises(InputError, match="phases from"):
        elbow_over_time(outside, method="cascade", over="phase")


def test_methods_over_realizations_ask_for_them(two_pathways):
    with pytest.raises(InputError, match="ensemble"):
        elbow_over_time(two_pathways[0], method="ensemble")
    with pytest.raises(InputError, match="aligned"):
        elbow_over_time(two_pathways[0], method="smoother", aligned=True)


@pytest.mark.first_cases(1)
@pytest.mark.parametrize(("snr_db", "duration_s"), [(10.0, 2.0), (30.0, 4.0)])
def test_jumps_beat_realizations_and_segments_on_a_square_wave(snr_db, duration_s):
    recording, truth = simulate_cascade(
        0.02, 0.8, _square, duration_s=duration_s, trials=10, snr_db=(snr_db, None), seed=3
    )
    samples = from_recording(recording)
    errors = {
        method: _total(found, found.K, truth.K)
        for method in ("cascade", "cascade-smooth", "ensemble", "short-segments")
        for found in [identify_cascade(samples, method=method, aligned=True, reflex="none")]
    }
    assert min(errors, key=lambda name: errors[name]) == "cascade"


def test_a_fast_slope_is_not_made_a_jump():
    def slope(t):
        return np.interp(t, (0.97, 1.03), (40.0, 120.0))

    recording, truth = simulate_cascade(
        0.02, 0.8, slope, duration_s=2.0, trials=10, snr_db=(20.0, None), seed=4
    )
    found = identify_cascade(
        from_recording(recording),
        method="cascade-jumps",
        aligned=True,
        reflex="none",
        every_s=0.006,
    )
    at = np.minimum(np.round(found.time_s * 1000).astype(int), len(truth.K) - 1)
    # a single jump would be wrong by up to 40 N m/rad
    assert np.abs(found.K - truth.K[at]).max() < 20


@pytest.mark.study
def test_bands_hold_beside_the_subjects_own_torque():
    one = Reflex(_swing(3.0, 0.06), delay_s=0.045)
    recording, truth = simulate_cascade(
        0.02, _swing(0.8, 0.07), _swing(60.0, 0.1), one, own_Nm=0.3, duration_s=40.0, seed=1
    )
    found = identify_cascade(from_recording(recording), method="cascade-smooth")
    at = np.round(found.time_s * 1000).astype(int)
    assert found.reflex is not None
    held = [
        (np.abs(value - true[at]) < 1.96 * sd).mean()
        for value, sd, true in (
            (found.K, found.sd_K, truth.K),
            (found.B, found.sd_B, truth.B),
            (found.reflex.G, found.reflex.sd_G, truth.G),
        )
    ]
    assert min(held) > 0.85


def test_the_banded_solution_is_that_of_the_whole_matrix():
    rng = np.random.default_rng(0)
    n, m, width = 12, 3, 0.1
    rows = rng.standard_normal((n, 9, m + 2))
    cells = Cells(width, np.einsum("nri,nrj->nij", rows, rows), np.full(n, 9))
    of = Strengths(np.full(m, 2.0), np.array([1.0, 2.0, 0.5]), 0.7)
    found = smooth(cells, of)
    X = np.zeros((n, 9, n * m + 1))
    for k in range(n):
        X[k, :, k * m : (k + 1) * m] = rows[k, :, :m]
    X[:, :, -1] = rows[:, :, m]
    X, y = X.reshape(n * 9, -1), rows[:, :, -1].ravel()
    D = np.zeros((n, n))
    D[0, 0], D[1, :2] = 1, (-1, 1)
    for k in range(2, n):
        D[k, k - 2 : k + 1] = (1, -2, 1)
    prior = np.zeros((n * m + 1, n * m + 1))
    for j, (s, i) in enumerate(zip(of.scale, of.intensity, strict=True)):
        sd = np.full(n, i * s * width**1.5)
        sd[:2] = 3.0 * s, 10.0 * s * width
        prior[j : n * m : m, j : n * m : m] = D.T @ np.diag(1 / sd**2) @ D
    inverse = np.linalg.inv(X.T @ X / 0.7 + prior)
    x = inverse @ X.T @ y / 0.7
    np.testing.assert_allclose(found.mean.ravel(), x[:-1], rtol=1e-8)
    np.testing.assert_allclose(found.variance.ravel(), np.diag(inverse)[:-1], rtol=1e-8)
    assert found.inertia == pytest.approx(x[-1])


def test_segments_have_the_variances_of_a_textbook_s_least_squares():
    rng, rows = np.random.default_rng(11), np.array([40, 25, 5])
    totals, oracle = [], []
    for n in rows:
        W = rng.standard_normal((n, 3)) * [1.0, 1e-3, 30.0]
        y = W @ [2.0, 500.0, -1.0] + rng.standard_normal(n)
        totals.append(np.column_stack([W, y]).T @ np.column_stack([W, y]))
        theta, left = np.linalg.lstsq(W, y)[:2]
        oracle.append((theta, left / (n - 3) * np.diag(np.linalg.inv(W.T @ W))))
    values, variances = _least_squares(np.stack(totals), rows)
    for k in (0, 1):
        assert values[k] == pytest.approx(oracle[k][0], rel=1e-8)
        assert variances[k] == pytest.approx(oracle[k][1], rel=1e-8)
    # five rows do not determine three parameters and their noise
    assert np.isnan(values[2]).all()
    assert np.isnan(variances[2]).all()
