"""The spatial rig: its dynamics, its truth, its sessions."""

from __future__ import annotations

import numpy as np
import pytest

import armimpedance as ai
from armimpedance.__main__ import main
from armimpedance.core.errors import InputError
from armimpedance.hand.still import estimate
from armimpedance.numerics.signals import cut_windows
from manipulandum_sim.hand import find_subject
from manipulandum_sim.space import (
    SpaceArm,
    SpaceCondition,
    SpaceRig,
    simulate_space,
    sphere_directions,
)
from manipulandum_sim.tree_dynamics import inverse_dynamics, mass_matrix


def relative(found, true):
    return np.linalg.norm(found - true) / np.linalg.norm(true)


@pytest.fixture(scope="module")
def arm():
    return SpaceArm.of(find_subject("A"))


@pytest.fixture(scope="module")
def states():
    return np.random.default_rng(4).normal(size=(2, 6, 4))


def test_dynamics_are_newton_s_and_euler_s(arm, states):
    q, qd = states
    now = arm.dynamics(q, qd)
    np.testing.assert_allclose(now.h, inverse_dynamics(arm.skeleton(), q, qd), atol=1e-12)
    np.testing.assert_allclose(now.M, mass_matrix(arm.skeleton(), q), atol=1e-13)


def test_the_hand_s_jacobian_and_drift_are_derivatives_of_its_place(arm, states):
    q, qd = states
    step = 1e-5
    now = arm.dynamics(q, qd)
    J = [(arm.hand(q + step * u) - arm.hand(q - step * u)) / (2 * step) for u in np.eye(4)]
    np.testing.assert_allclose(now.J, np.stack(J, axis=-1), atol=1e-8)
    turned = arm.dynamics(q + step * qd, qd).velocity - arm.dynamics(q - step * qd, qd).velocity
    np.testing.assert_allclose(now.drift, turned / (2 * step), atol=1e-7)


def test_centrifugal_torques_make_no_energy(arm, states):
    q, qd = states
    step, none = 1e-5, np.zeros(3)
    now = arm.dynamics(q, qd, none)
    ahead, behind = (arm.dynamics(q + s * step * qd, qd, none).M for s in (1, -1))
    # d/dt (qd^T M qd / 2) = qd^T h where no torque works
    grown = np.einsum("ni,nij,nj->n", qd, (ahead - behind) / (4 * step), qd)
    np.testing.assert_allclose(np.einsum("ni,ni->n", qd, now.h), grown, atol=1e-7)


@pytest.mark.parametrize("count", [6, 8, 12, 14, 18, 26])
def test_each_direction_has_its_opposite(count):
    units = sphere_directions(count)
    assert units.shape == (count, 3)
    np.testing.assert_allclose(np.linalg.norm(units, axis=1), 1)
    cosines = units @ units.T
    assert ((cosines < -1 + 1e-12).sum(axis=1) == 1).all()
    assert ((cosines > 1 - 1e-12).sum(axis=1) == 1).all()
    # and no axis is preferred
    np.testing.assert_allclose(units.T @ units, count / 3 * np.eye(3), atol=1e-12)


@pytest.fixture(scope="module", params=["held", "free"])
def quiet(request):
    if request.param == "held":
        return request.getfixturevalue("noiseless")
    return simulate_space(seed=1, sets=1, noise="none", elbow="free", directions=6)


@pytest.mark.study
def test_the_truth_is_the_mapping_s_with_gravity_and_force(quiet):
    _, truth = quiet
    r = [0, 1, 3] if truth.elbow == "held" else [0, 1, 2, 3]
    arm = SpaceArm.of(find_subject("A"))
    q, J, step = truth.posture, truth.jacobian[0][:, r], 1e-4

    def borne(angles):
        return arm.dynamics(angles, np.zeros_like(angles)).J[0].T @ truth.force[0]

    turned = [(borne(q + step * u) - borne(q - step * u)) / (2 * step) for u in np.eye(4)]
    K_q = truth.K_j[0] + truth.gravity_gradient[0] + np.stack(turned, axis=-1)
    K_e = np.linalg.inv(J @ np.linalg.inv(K_q[np.ix_(r, r)]) @ J.T)
    assert relative(K_e, truth.K_e[0]) < 1e-6
    M_e = np.linalg.inv(J @ np.linalg.inv(truth.M_j[0][np.ix_(r, r)]) @ J.T)
    assert relative(M_e, truth.M_e[0]) < 1e-9
    # a conservative arm: symmetric, and here stable
    np.testing.assert_allclose(truth.K_e[0], truth.K_e[0].T, atol=1e-5)
    assert (np.linalg.eigvalsh(truth.K_e[0]) > 0).all()


@pytest.mark.first_cases(1)
def test_a_held_elbow_s_estimate_is_the_truth_and_a_free_one_s_is_not(quiet):
    recording, truth = quiet
    found = estimate(recording)[0]
    error = relative(found.stiffness, truth.K_e[0])
    if truth.elbow == "held":
        assert error < 0.002
        assert relative(found.viscosity, truth.B_e[0]) < 0.003
        assert relative(found.inertia, truth.M_e[0]) < 0.003
    else:
        assert error > 0.01
        assert truth.swivel_hz[0] > 1


@pytest.mark.first_cases(1)
def test_at_rest_the_robot_feels_the_hand_s_force(quiet):
    recording, truth = quiet
    for rows in recording.offsets[:-1]:
        np.testing.assert_allclose(recording.force[rows], truth.force[0], atol=1e-9)
        np.testing.assert_allclose(recording.position[rows], truth.hand[0], atol=1e-12)


@pytest.mark.study
def test_more_sets_leave_the_first_ones_as_they_are():
    few, more = (simulate_space(seed=3, sets=sets, directions=6)[0] for sets in (1, 2))
    rows = few.offsets[-1]
    np.testing.assert_array_equal(few.force, more.force[:rows])
    np.testing.assert_array_equal(few.position, more.position[:rows])


@pytest.mark.parametrize(
    "wrong",
    [
        {"directions": 7},
        {"elbow": "bent"},
        {"disturbance": "none"},
        {"amplitude_m": np.nan},
        {"duration_s": 0.3001},
        {"sets": 0},
        {"conditions": [SpaceCondition("nowhere")]},
        {"conditions": [SpaceCondition(force=(0.0, 0.0, 900.0))]},
        {"conditions": [SpaceCondition(cocontraction=np.nan)]},
        {"conditions": [SpaceCondition(), SpaceCondition()]},
    ],
)
def test_what_no_session_can_be_is_refused(wrong):
    with pytest.raises(InputError):
        simulate_space(**{"seed": 0, **wrong})


def test_the_command_asks_for_what_was_said_and_writes_what_reads_back(soft, tmp_path, monkeypatch):
    said = {}

    def simulated(conditions, *, progress, **asked):
        said.update(asked, conditions=list(conditions))
        return soft

    monkeypatch.setattr("manipulandum_sim.space.simulate_space", simulated)
    out, results = tmp_path / "session", tmp_path / "found.csv"
    options = "--sets 3 --directions 6 --seed 2 --noise sensor --elbow free --cocontraction 5"
    assert main(["simulate", "space", *options.split(), "--out", str(out)]) == 0
    assert said.pop("conditions") == [SpaceCondition("nominal", 0.05)]
    assert [said.pop(name) for name in ("seed", "subject", "sets")] == [2, "A", 3]
    assert SpaceRig(**said) == SpaceRig(directions=6, noise="sensor", elbow="free")
    assert main(["estimate", str(out), "--out", str(results)]) == 0
    (back,), (found,) = ai.read_results(results), ai.estimate(soft[0])
    # a table on disk has a finite number of digits
    assert relative(back.stiffness, found.stiffness) < 1e-3


def test_directions_above_the_plane_are_directions_of_their_own(held):
    recording, _ = held
    numbers = cut_windows(recording, np.arange(recording.n_trials)).disturbance
    assert len(np.unique(numbers)) == 26
    places = recording.trials[["direction_deg", "elevation_deg"]].to_numpy()
    for number in range(26):
        assert len(np.unique(places[numbers == number], axis=0)) == 1
