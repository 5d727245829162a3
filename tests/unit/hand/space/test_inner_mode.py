"""A free elbow: its estimate is corrected, its intervals allow for the swivel, and it is named."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.hand.still import check_response, estimate as second_order
from armimpedance.hand.still.doubts.departures import models_of
from armimpedance.hand.still.doubts.inner_fit import InnerSetting
from armimpedance.hand.still.doubts.inner_modes import (
    INNER_DIRECTIONS,
    INNER_MODES,
    WRIST_MODES,
    InnerMode,
    half_sphere,
)
from armimpedance.hand.still.modal import SharedCourse
from armimpedance.hand.still.show import estimate
from armimpedance.numerics.regression import t_factor
from armimpedance.numerics.signals import cut_windows, disturbance_times
from manipulandum_sim.space import SpaceCondition, simulate_space


def said(recording, elbow):
    trials = recording.trials.drop(columns="elbow")
    return replace(recording, trials=trials if elbow is None else trials.assign(elbow=elbow))


def along_softest(matrix, truth):
    n = np.linalg.eigh(truth)[1][:, 0]
    return n @ matrix @ n


def held_part(one, truth):
    """Part of K's elements that lie in their intervals."""
    half = t_factor(one.dof) * np.sqrt(np.diag(one.covariance)[18:]).reshape(3, 3)
    return np.mean(np.abs(one.stiffness - truth) <= half)


def test_the_swivel_is_named_and_part_of_the_error_is_taken_off_the_rest_held(soft):
    recording, truth = soft
    K = truth.K_e[0]
    told, plain = estimate(recording)[0], second_order(recording)[0]
    errors = [np.linalg.norm(e.stiffness - K) / np.linalg.norm(K) for e in (plain, told)]
    assert errors[0] > 0.08
    assert errors[1] < 0.8 * errors[0]
    # eighteen trials of six directions, quiet sensors: what is left is the modes' own error
    assert held_part(told, K) > held_part(plain, K)
    assert any("swivel" in w for w in told.warnings)
    softest = [along_softest(e.stiffness, K) for e in (plain, told)]
    assert softest[0] > softest[1]


@pytest.mark.study
def test_an_elbow_that_was_said_to_be_held_is_held_against_the_trials(soft):
    recording, _ = soft
    wrong = said(recording, "held")
    assert any("said to be held" in w for w in estimate(wrong)[0].warnings)
    found = {one.name: one for one in check_response(wrong)}
    assert "said to be held" in found["inner mode"].message
    held, _ = simulate_space(
        [SpaceCondition("nominal", 0.05)], seed=2, sets=3, directions=6, noise="sensor"
    )
    assert "inner mode" not in {one.name for one in check_response(held)}
    assert not any("inner mode" in w for w in estimate(held)[0].warnings)


@pytest.mark.first_cases(2)
@pytest.mark.parametrize("mode", [INNER_MODES[0], INNER_MODES[9], WRIST_MODES[1]])
def test_a_mode_s_column_is_its_answer_in_time(mode):
    # a displacement that comes and goes slowly beside the sample, through the mode in frequency
    rate, S = 1000.0, 2048
    t = np.arange(S) / rate
    x = np.where(t < 0.6, np.sin(np.pi * t / 0.6) ** 4, 0.0)
    p = 2j * np.pi * np.fft.rfftfreq(4 * S, 1 / rate)
    expected = np.fft.irfft(mode.response(p) * np.fft.rfft(x, 4 * S))[:S]
    found = mode.columns(x[None, :, None], np.eye(S), rate)[0, 0]
    np.testing.assert_allclose(found, expected, atol=2e-3 * np.abs(expected).max())


def test_an_arm_with_one_inner_joint_is_one_of_the_modes():
    """Two coordinates in one direction: eliminate the inner one, and compare the impedance."""
    m, w, damping = 0.7, 2 * np.pi * 3.0, 0.4
    k, b, coupling = m * w**2, 2 * damping * w * m, 60.0
    p = 2j * np.pi * np.linspace(0.1, 20, 40)
    for mode, answer in ((1.0, coupling * (1 + b / k * p)), (0.0, coupling + 0 * p)):
        whole = -(answer**2) / (m * p**2 + b * p + k)
        S = coupling**2 / k
        made = S * InnerMode(3.0, damping, mode).response(p)
        # the limb's own K at rest takes the constant
        np.testing.assert_allclose(whole + S, made, rtol=1e-9)


def test_what_nobody_said_is_taken_as_free(soft):
    recording, _ = soft
    told = estimate(said(recording, None))[0]
    assert any("swivel" in w for w in told.warnings)


def test_inspect_finds_the_mode(soft):
    recording, _ = soft
    found = {one.name: one for one in check_response(recording)}
    assert found["inner mode"].verdict == "warning"


def test_a_word_that_is_neither_held_nor_free_is_refused(soft):
    recording, _ = soft
    with pytest.raises(InputError, match="elbow"):
        estimate(said(recording, "tied"))


def test_a_column_of_that_name_is_a_laboratory_s_own_in_the_plane(soft):
    recording, _ = soft
    plane = replace(
        recording,
        position=recording.position[:, :2],
        force=recording.force[:, :2],
        extra={},
        shoulder_m=None,
        gravity_m_s2=None,
        trials=recording.trials.drop(columns="elevation_deg").assign(elbow=1.2),
    )
    assert "inner mode" not in {one.name for one in check_response(plane)}


def test_sizes_by_nine_sums_are_those_of_one_column_at_a_time(soft):
    """One mode, some directions: the column written out, its own expectation as instrument."""
    recording, _ = soft
    (model,) = models_of(recording, [np.arange(recording.n_trials)])
    window = cut_windows(recording, timing=disturbance_times(recording))
    setting = InnerSetting(
        window,
        model.equation,
        model.weight,
        model.instruments,
        model.equations,
        model.parameters,
    )
    mode = INNER_MODES[5]
    z = setting.column(mode)
    expected = SharedCourse.of(model.equation).expected(z[:, None])[:, 0]
    T, d, n = z.shape
    for direction in (0, 17, 50):
        u = half_sphere(INNER_DIRECTIONS)[direction]
        column, instrument = (
            np.einsum("a,b,tbn->tan", u, u, part).reshape(T, -1) for part in (z, expected)
        )
        # W and Z (T, d n, 3 d^2): row (i, n) has x_k^(m) in the column (m, i, k)
        W, Z = (
            np.einsum("ij,tmkn->tinmjk", np.eye(d), part.reshape(T, 3, d, n)).reshape(T, d * n, -1)
            for part in (model.equation.regressors, model.instruments)
        )
        V, y = model.weight, model.equation.force.reshape(T, -1)
        P, b = model.equations.A.sum(axis=0), model.equations.b.sum(axis=0)
        above = np.einsum("trp,rs,ts->p", Z, V, column, optimize=True)
        left = np.einsum("tr,rs,tsp->p", instrument, V, W, optimize=True)
        A = np.block([[P, above[:, None]], [left, (instrument @ V * column).sum()]])
        solved = np.linalg.solve(A, np.append(b, (instrument @ V * y).sum()))
        at = INNER_MODES.index(mode), direction
        assert model.inner.size[at] == pytest.approx(solved[-1], rel=1e-6)
        shift = (np.linalg.solve(P, b) - solved[:-1]) / solved[-1]
        assert model.inner.shift[at] == pytest.approx(shift, rel=1e-5, abs=1e-6 * abs(shift).max())


@pytest.mark.parametrize("mode", [INNER_MODES[4], INNER_MODES[13], WRIST_MODES[0]])
def test_what_a_slow_motion_sees_of_a_mode(mode):
    p = 2j * np.pi * np.array([0.01, 0.02])
    slope, curve = mode.slow
    left = mode.response(p) - slope * p - curve * p**2
    # the rest is of the third order or a higher one: eight times as large at twice the frequency
    assert abs(left[1] / left[0]) > 7.8


def test_a_departure_beside_a_mode_is_charged_with_its_own_change_of_K_alone(soft):
    recording, _ = soft
    (model,) = models_of(recording, [np.arange(recording.n_trials)])
    one = model.departure("voluntary 0.13", "inner")
    with_mode, with_both = (
        model._solved(*names)[0][18:27] for names in (("inner",), ("voluntary 0.13", "inner"))
    )
    change = (with_mode - with_both) @ with_mode / (with_mode @ with_mode)
    assert one.share * one.size == pytest.approx(change)
    # the mode itself changes K by far more
    assert abs(change) < np.linalg.norm(model.parameters[18:] - with_mode) / np.linalg.norm(
        with_mode
    )
