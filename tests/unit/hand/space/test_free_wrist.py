"""A hand on a ball joint: seven joints, the published muscles, what the estimate makes of them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import armimpedance as ai
from armimpedance.core.errors import InputError, NotIdentifiableError
from armimpedance.core.records import Recording
from armimpedance.hand.levels import arm_of_whose
from armimpedance.hand.still import check_response
from armimpedance.limb.arm import HELD, SpatialArm, arm_named, arm_of, hand_rod
from armimpedance.muscles.models import at_hand, matrix
from armimpedance.muscles.show import free_hand_rows
from manipulandum_sim.hand import find_subject
from manipulandum_sim.space import (
    SpaceArm,
    SpaceCondition,
    SpaceRig,
    SpaceTruth,
    find_space_truth,
    simulate_space,
)
from manipulandum_sim.space.slow_motion import slow_motion
from manipulandum_sim.space.wrist_muscles import WristMuscles

GRAVITY = (0.0, 0.0, -9.80665)
LINKS = arm_of(find_subject("A").record)
ARM = SpatialArm(LINKS, GRAVITY, hand_rod(LINKS))
LOCKED = SpatialArm(LINKS, GRAVITY)
RNG = np.random.default_rng(5)
ANGLES = RNG.uniform(
    [-1.5, 0.3, -1.5, 0.3, -1, -0.4, -0.6], [1.5, 2.5, 1.5, 2.4, 1, 0.3, 0.6], (5, 7)
)


@pytest.mark.parametrize("q", ANGLES)
def test_a_straight_wrist_is_the_locked_one(q):
    straight, locked = ARM.posture([*q[:5], 0.0, 0.0], (0, 1, 2, 3)), LOCKED.posture(q[:4])
    for name in ("hand_position", "jacobian", "jacobian_derivative", "gravity_torque"):
        np.testing.assert_allclose(getattr(straight, name), getattr(locked, name), atol=1e-13)
    np.testing.assert_allclose(straight.inertia, locked.inertia, atol=1e-13)
    np.testing.assert_allclose(straight.gravity_gradient, locked.gravity_gradient, atol=1e-13)
    # the forearm's turning does not move a hand that is straight
    np.testing.assert_allclose(ARM.jacobian([*q[:5], 0.0, 0.0])[:, 4], 0.0, atol=1e-14)


def test_an_arm_of_another_number_of_angles_is_refused():
    with pytest.raises(InputError, match="7"):
        ARM.posture(np.zeros(4))
    with pytest.raises(InputError):
        ARM.joint_angles([0.1, 0.4, 0.0], 0.0)
    with pytest.raises(InputError):
        SpaceCondition((0.1,) * 5).angles  # noqa: B018


def test_a_person_s_moment_arms_are_derivatives_of_lengths_and_like_the_published_ones():
    muscles, published = WristMuscles.of(find_subject("A")), arm_named("myoarm7")
    q, step = np.array([[-0.9, 0.9, 1.0, 1.5, 0.2, 0.0, -0.25]]), 1e-5
    G = muscles.jacobian(q)[0]
    differences = [
        (muscles.length(q + step * u) - muscles.length(q - step * u))[0] / (2 * step)
        for u in np.eye(7)
    ]
    np.testing.assert_allclose(G, np.array(differences).T, atol=1e-10)
    others = published.paths.moment_arms(q[0])
    assert muscles.names == published.paths.muscles
    off = np.linalg.norm(G - others) / np.linalg.norm(others)
    assert 0.03 < off < 0.3
    assert not np.array_equal(G, WristMuscles.of(find_subject("B")).jacobian(q)[0])


def test_the_published_arms_have_anatomy_s_signs():
    arm = arm_named("myoarm7")
    arms = arm.paths.moment_arms([-0.5, 0.9, 0.5, 1.4, 0, 0, 0])
    G = dict(zip(arm.paths.muscles, arms, strict=True))
    turn, elevation, axial, elbow, pronation, deviation, flexion = range(7)
    # a muscle shortens along what it does: dL/dq below 0
    assert G["BIClong"][elbow] < -0.02
    assert G["TRIlat"][elbow] > 0.015
    assert G["PECM1"][turn] < 0  # turns the arm to the left
    assert G["DELT3"][turn] > 0
    assert G["DELT1"][elevation] < 0
    assert G["LAT2"][elevation] > 0
    assert G["SUBSC"][axial] < 0  # inwards
    assert G["INFSP"][axial] > 0
    assert G["PT"][pronation] < 0
    assert G["SUP"][pronation] > 0
    assert G["ECRL"][deviation] < 0  # to the thumb's side
    assert G["FCU"][deviation] > 0
    assert G["FCR"][flexion] < 0
    assert G["ECU"][flexion] > 0


def test_the_arm_with_its_wrist_locked_is_the_other_at_zero_angles():
    four, seven = arm_named("myoarm4"), arm_named("myoarm7")
    q = np.random.default_rng(2).uniform(-0.3, 1.2, (6, 4))
    stays = np.isin(seven.paths.muscles, four.paths.muscles)
    whole = seven.paths.moment_arms(np.column_stack([q, np.zeros((6, 3))]))[..., :4]
    np.testing.assert_allclose(four.paths.moment_arms(q), whole[:, stays], atol=1e-15)
    np.testing.assert_array_equal(whole[:, ~stays], 0.0)
    np.testing.assert_array_equal(four.max_tension, seven.max_tension[stays])


@cache
def session() -> tuple[Recording, SpaceTruth]:
    return simulate_space(seed=72, sets=3, wrist="free", elbow="free", emg=True)


@pytest.mark.study
def test_the_truth_is_the_mapping_s_and_slow_motion_is_the_limit_of_small_frequencies():
    _, truth = session()
    J, step = truth.jacobian[0], 1e-4
    arm, q = SpaceArm.of(find_subject("A"), free_wrist=True), truth.posture

    def borne(angles):
        return arm.dynamics(angles, np.zeros_like(angles)).J[0].T @ truth.force[0]

    turned = [(borne(q + step * u) - borne(q - step * u)) / (2 * step) for u in np.eye(7)]
    K = truth.K_j[0] + truth.gravity_gradient[0] + np.stack(turned, axis=-1)
    M, B = truth.M_j[0], truth.B_j[0]
    K_e = np.linalg.inv(J @ np.linalg.solve(K, J.T))
    assert np.linalg.norm(K_e - truth.K_e[0]) < 1e-6 * np.linalg.norm(K_e)
    inertia, viscosity = slow_motion(J, M, B, K)
    np.testing.assert_allclose(truth.B_e_slow[0], viscosity, rtol=1e-5, atol=1e-4)
    np.testing.assert_allclose(truth.M_e_slow[0], inertia, rtol=1e-4, atol=1e-5)
    s = 1j * 0.05
    Z = np.linalg.inv(J @ np.linalg.solve(M * s**2 + B * s + K, J.T))
    np.testing.assert_allclose(Z.imag / s.imag, viscosity, rtol=1e-3, atol=1e-2)
    np.testing.assert_allclose((K_e - Z.real) / s.imag**2, inertia, rtol=1e-2, atol=1e-2)


@pytest.mark.study
def test_the_estimate_names_what_gives_way_and_holds_the_stiffness():
    recording, truth = session()
    (found,) = ai.estimate(recording)
    K = truth.K_e[0]
    assert len(found.joint_angles) == 7
    assert any("wrist" in warning for warning in found.warnings)
    low, high = (limits[2].reshape(3, 3) for limits in found.interval())
    # of nine elements seldom more than two lie outside of their own 95 %
    assert ((low <= K) & (truth.K_e[0] <= high)).sum() >= 7
    assert np.linalg.norm(found.stiffness - K) < 0.1 * np.linalg.norm(K)
    # viscosity is that of slow motion, not at once
    slow, once = (np.linalg.norm(found.viscosity - B[0]) for B in (truth.B_e_slow, truth.B_e))
    assert slow < 0.3 * once


@pytest.mark.study
def test_a_wrist_that_gives_way_is_not_taken_for_a_reflex():
    quiet, _ = simulate_space(seed=74, sets=1, wrist="free", elbow="free", noise="sensor")
    found = {one.name: one for one in check_response(quiet)}
    assert found["reflex"].verdict != "warning"
    assert found["inner mode"].verdict == "warning"
    assert not any(one.startswith("reflex") for one in ai.estimate(quiet)[0].warnings)


@pytest.mark.study
def test_a_held_elbow_does_not_silence_a_free_wrist():
    recording, _ = session()
    held = replace(recording, trials=recording.trials.assign(elbow="held"))
    assert any("wrist" in warning for warning in ai.estimate(held)[0].warnings)


@pytest.mark.study
def test_a_column_says_it_where_angles_were_not_measured():
    recording, _ = session()
    unknown = replace(recording, joint_angles=None)
    assert any("wrist" in warning for warning in ai.estimate(unknown)[0].warnings)
    locked = replace(recording, trials=recording.trials.assign(wrist="locked"))
    assert not any("wrist" in warning for warning in ai.estimate(locked)[0].warnings)
    odd = replace(recording, trials=recording.trials.assign(wrist="loose"))
    with pytest.raises(InputError, match="loose"):
        ai.estimate(odd)


def test_what_gives_way_beside_a_held_elbow_is_called_the_wrist_where_that_is_free(soft):
    # an elbow's swivel stands for a wrist's mode: the trials cannot tell whose it is
    recording, _ = soft
    said = replace(recording, trials=recording.trials.assign(elbow="held", wrist="free"))
    (warning,) = (w for w in ai.estimate(said)[0].warnings if w.startswith("inner mode"))
    assert "wrist" in warning


def test_seven_joints_do_not_follow_from_three_axes(hands):
    (locked,), recording, _ = hands
    hand = replace(locked, joint_angles=np.append(locked.joint_angles, [0.2, 0.0, -0.25]))
    free = replace(recording, trials=recording.trials.assign(elbow="free", wrist="free"))
    for elbow in ("free", "held"):
        with pytest.raises(NotIdentifiableError):
            ai.to_joint([hand], recording=free, elbow=elbow)


@pytest.mark.study
def test_a_locked_wrist_whose_angles_are_known_leaves_the_joints_of_a_held_elbow():
    bent = (-0.9, 0.9, 1.0, 1.5, 0.4, -0.1, -0.3)
    recording, truth = simulate_space([SpaceCondition(bent)], seed=73, sets=2)
    hand = ai.estimate(recording)
    (joint,) = ai.to_joint(hand, recording=recording)
    r = np.ix_(HELD, HELD)
    true = np.stack([truth.M_j[0][r], truth.B_j[0][r], truth.K_j[0][r]])
    low, high = joint.interval()
    # nine elements each, of which seldom more than two lie outside of their own 95 %
    assert (((low <= true) & (true <= high)).mean(axis=(1, 2)) > 0.7).all()
    assert (np.abs(joint.parameters.reshape(3, 3, 3) - true) < 4 * joint.sd).all()
    (back,) = ai.to_hand([joint], recording=recording)
    K = hand[0].stiffness
    np.testing.assert_allclose(back.stiffness, (K + K.T) / 2, atol=1e-9)
    with pytest.raises(InputError, match="locked"):
        free_hand_rows(hand, replace(recording, trials=recording.trials.assign(elbow="free")))


@pytest.mark.study
def test_muscles_fitted_to_hands_tell_other_hands():
    recording, truth = session()
    rows = free_hand_rows(ai.estimate(recording), recording)
    assert rows.joints == 7
    model = ai.fit_muscles(rows, arm="myoarm7", order=1)
    others = [
        SpaceCondition((-0.8, 0.9, 0.9, 1.4, 0.1, 0.0, -0.2), 0.1),
        SpaceCondition((-0.7, 0.8, 0.8, 1.3, 0.3, 0.1, 0.1), 0.15),
    ]
    rig = SpaceRig(elbow="free", wrist="free")
    plants = [one.plant(find_subject("A"), rig) for one in others]
    forces = np.array([one.force for one in others])
    K = find_space_truth(plants, forces, ["a", "b"], 0.0, "free").K_e
    alpha = np.array([plant.tension / plant.muscles.greatest for plant in plants])
    q = np.array([one.angles for one in others])
    said = at_hand(model.predict(q, alpha), arm_of_whose(recording, 7), forces)
    # one place tells little: the bands hold, and the arms that are published are not far off
    half = matrix(said.half_width("stiffness"))
    assert (np.abs(said.stiffness_matrices - K) <= half).mean() > 0.8
    off = np.linalg.norm(said.stiffness_matrices - K, axis=(1, 2)) / np.linalg.norm(K, axis=(1, 2))
    assert (off < 0.4).all()


def test_a_hand_s_part_of_the_link_leaves_a_forearm():
    whole, (_, forearm, hand) = LOCKED.rods[1], ARM.rods
    assert min(forearm) > 0
    assert forearm.kg + hand.kg == pytest.approx(whole.kg)
    assert forearm.length_m + hand.length_m == pytest.approx(whole.length_m)
    centre = forearm.kg * forearm.com_m + hand.kg * (forearm.length_m + hand.com_m)
    assert centre == pytest.approx(whole.kg * whole.com_m)
