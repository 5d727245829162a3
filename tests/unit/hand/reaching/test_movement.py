"""A hand that moves: the equation against the plant, the estimates against the truth, bad input."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pandas as pd
import pytest
from reaching_sessions import one_phase as session

import armimpedance as ai
from armimpedance.core.errors import ArmImpedanceError, EstimationError, InputError
from armimpedance.core.estimates import ImpedanceEstimate
from armimpedance.core.records import Recording
from armimpedance.hand.reaching import METHODS, identify_movement
from armimpedance.hand.reaching.course import inertial_gradients, inertial_rows
from armimpedance.hand.reaching.fitted import Instant, to_hand
from armimpedance.hand.still import Options, estimate
from armimpedance.limb.arm import TwoLinkArm
from manipulandum_sim.hand import Arm, Truth, find_subject, simulate_condition
from manipulandum_sim.hand.robot import IDEAL
from manipulandum_sim.movement import MovementRig, MovementTruth, find_truth, simulate_movement

RNG = np.random.default_rng(7)
SUBJECT = find_subject("A")
LENGTHS = TwoLinkArm(SUBJECT.upper_arm_m, SUBJECT.forearm_hand_m, 1.0, 1.0, 0.1, 0.1, 0.1, 0.1)


def truth_in_the_middle(truth: MovementTruth, found: ImpedanceEstimate) -> np.ndarray:
    """M, B, K (12,) of the hand where undisturbed reaches are."""
    line = MovementRig().line
    assert found.position is not None
    travelled = float((found.position - line.start_m) @ line.along)
    return np.concatenate([truth.at(f"{name}_e", travelled) for name in "MBK"], axis=None)


def phi_of(arm: Arm) -> np.ndarray:
    link = arm.link
    return np.array([link.inertia1, link.inertia2, link.coupling], dtype=float)


def test_the_inertial_rows_are_the_dynamics_of_two_links():
    arm = TwoLinkArm(0.3, 0.34, 1.9, 1.5, 0.13, 0.16, 0.014, 0.019)
    a = 0.014 + 1.9 * 0.13**2 + 1.5 * 0.3**2
    b, c = 0.019 + 1.5 * 0.16**2, 1.5 * 0.3 * 0.16
    q, qd, qdd = RNG.uniform(-2, 2, (3, 50, 2))
    torque = np.einsum("nij,nj->ni", arm.inertia(q), qdd) + arm.bias(q, qd)
    assert np.allclose(inertial_rows(q, qd, qdd) @ [a, b, c], torque, atol=1e-12)


def test_the_gradients_of_the_inertial_rows_are_their_differences():
    q, qd, qdd = RNG.uniform(-2, 2, (3, 2))
    h = 1e-6
    for place, gradient in enumerate(inertial_gradients(q, qd, qdd)):
        for j, step in enumerate(h * np.eye(2)):
            up, down = [q, qd], [q, qd]
            up[place], down[place] = up[place] + step, down[place] - step
            slope = (inertial_rows(*up, qdd) - inertial_rows(*down, qdd)) / (2 * h)
            assert np.allclose(gradient[:, j], slope, atol=1e-8)


def test_the_hand_of_a_moving_arm_follows_from_its_joints_as_the_plant_says():
    # the plant's hand and joint matrices are separate differences of its force and torque
    truth = find_truth(MovementRig(device="curl"), step_s=0.001)
    rate = np.gradient(truth.posture, 0.001, axis=0)
    acceleration = np.gradient(rate, 0.001, axis=0)
    phi = phi_of(Arm.of(SUBJECT))
    for s in (120, 300, 480, 620):
        at = Instant(
            truth.posture[s],
            rate[s],
            acceleration[s],
            truth.hand[s],
            truth.velocity[s],
            truth.force[s],
        )
        weights, constant = to_hand(LENGTHS, at)
        found = weights @ np.concatenate([phi, truth.K_j[s], truth.B_j[s]], axis=None) + constant
        true = np.concatenate([truth.M_e[s], truth.B_e[s], truth.K_e[s]], axis=None)
        assert np.allclose(found, true, rtol=1e-4, atol=1e-3)


@pytest.mark.study
def test_without_noise_and_pushes_the_hand_goes_where_the_person_means_to():
    rig = {"noise": "none", "device": "curl", "phases": (0.5,)}
    recording, truth = simulate_movement(seed=1, repeats=1, unperturbed=4, **rig)
    free = recording.select(recording.trials["phase"] == "")
    ends = free.position[free.offsets[1:] - 1]
    # 2 percent of the length and 4 mm aside, and the hand's own slow force
    assert np.abs(ends - truth.hand[-1]).max() < 4 * 0.006


@pytest.mark.study
def test_a_session_has_the_same_bits_whatever_else_is_simulated():
    one, _ = simulate_movement(seed=3, repeats=1, unperturbed=12, phases=(0.5,))
    again, _ = simulate_movement(seed=3, repeats=1, unperturbed=12, phases=(0.5,))
    assert np.array_equal(one.position, again.position)
    assert np.array_equal(one.force, again.force)


@pytest.mark.study
def test_the_truth_comes_back_from_the_disk(tmp_path):
    _, truth = session()
    truth.write(tmp_path / "truth.json")
    back = MovementTruth.read(tmp_path / "truth.json")
    assert np.array_equal(back.K_e, truth.K_e)
    assert back.reflex_delay_s == truth.reflex_delay_s


@pytest.mark.study
@pytest.mark.parametrize("push", ["doublet", "servo", "soft-servo"])
def test_the_truth_lies_within_the_intervals(push):
    recording, truth = session(push=push)
    (found,) = identify_movement(recording)
    error = found.parameters - truth_in_the_middle(truth, found)
    # twelve elements of t with some 34 degrees of freedom: 4.5 sd in none, 2 sd in most
    off = np.abs(error) / found.sd.ravel()
    assert off.max() < 4.5
    assert (off < 2).sum() >= 8
    assert np.linalg.norm(found.sd[2]) < 0.25 * np.linalg.norm(found.stiffness)


@pytest.mark.study
def test_hand_and_joint_tell_the_same():
    recording, truth = session()
    (hand,), (joint,) = (identify_movement(recording, level=level) for level in ("hand", "joint"))
    travelled = 0.25 + float(hand.position[1] - 0.52)
    error = joint.parameters[8:] - truth.at("K_j", travelled).ravel()
    assert (np.abs(error) < 4.5 * joint.sd[2].ravel()).all()
    assert np.allclose(hand.joint_angles, joint.joint_angles)


@pytest.mark.study
def test_at_rest_it_is_what_estimate_finds():
    recording, plain = at_rest()
    (found,), (still,) = identify_movement(recording), estimate(plain, options=Options("weighted"))
    for name in ("inertia", "viscosity", "stiffness"):
        own, of_posture = getattr(found, name), getattr(still, name)
        assert np.linalg.norm(own - of_posture) < 0.01 * np.linalg.norm(of_posture)


def at_rest() -> tuple[Recording, Recording]:
    """A posture's disturbances and as many trials without any, as pushes of a hand at rest."""
    pushed, _ = simulate_condition(seed=1, sets=5, noise="sensor")
    still, _ = simulate_condition(seed=2, sets=3, noise="sensor", amplitude_m=1e-9)
    told = pushed.trials.assign(
        phase="rest",
        push_deg=pushed.trials["direction_deg"],
        push_onset_s=pushed.trials["onset_s"],
        push_end_s=pushed.trials["end_s"],
    )
    free = still.trials.assign(trial=still.trials["trial"] + 1000, phase="")
    both = pd.concat([told, free], ignore_index=True).assign(condition="c")
    moving = replace(
        pushed,
        trials=both,
        offsets=np.concatenate([pushed.offsets, pushed.offsets[-1] + still.offsets[1:]]),
        time_s=np.concatenate([pushed.time_s, still.time_s]),
        position=np.concatenate([pushed.position, still.position]),
        force=np.concatenate([pushed.force, still.force]),
        joint_angles=None,
        emg=None,
        muscles=(),
        perturbation="moving",
    )
    return moving, pushed


@cache
def posture() -> tuple[ImpedanceEstimate, Truth]:
    """What a posture experiment says, and what is true."""
    recording, truth = simulate_condition(seed=4, sets=1, noise="sensor", emg=False, servo=IDEAL)
    return estimate(recording)[0], truth


def posture_inertia(factor: float, sd: float) -> ImpedanceEstimate:
    """What a posture experiment would say of the inertia, right but for a factor."""
    found, truth = posture()
    covariance = np.array(found.covariance)
    covariance[:4, :4] = (sd * np.abs(truth.M_e[0]).max()) ** 2 * np.eye(4)
    covariance[:4, 4:] = covariance[4:, :4] = 0.0
    return replace(found, inertia=factor * truth.M_e[0], covariance=covariance)


def test_a_wrong_inertia_is_named_and_not_used():
    recording, truth = session()
    (wrong,) = identify_movement(recording, inertia=[posture_inertia(1.1, 0.005)])
    assert any("inertia" in sentence for sentence in wrong.warnings)
    error = wrong.parameters - truth_in_the_middle(truth, wrong)
    assert (np.abs(error) < 4.5 * wrong.sd.ravel()).all()


@pytest.mark.study
def test_a_right_inertia_narrows_the_intervals():
    recording, _ = session()
    (free,) = identify_movement(recording)
    (told,) = identify_movement(recording, inertia=[posture_inertia(1.0, 0.005)])
    assert not told.warnings
    assert np.trace(told.covariance[:4, :4]) < np.trace(free.covariance[:4, :4])


@pytest.mark.parametrize("method", METHODS.names)
def test_every_method_gives_something_or_says_why_not(method):
    recording, _ = session(push="servo")
    (found,) = identify_movement(recording, method=method, inertia=[posture_inertia(1.0, 0.01)])
    assert found.method == method
    assert np.isfinite(found.parameters).all()
    assert np.linalg.eigvalsh(found.covariance).min() > -1e-9 * np.trace(found.covariance)


def test_axes_that_turn_turn_the_matrices():
    recording, _ = session()
    angle = 0.7
    R = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    table = recording.trials.assign(push_deg=recording.trials["push_deg"] + np.degrees(angle))
    turned = replace(
        recording, trials=table, position=recording.position @ R.T, force=recording.force @ R.T
    )
    (plain,), (found,) = identify_movement(recording), identify_movement(turned)
    assert np.allclose(found.stiffness, R @ plain.stiffness @ R.T, rtol=1e-6, atol=1e-4)


def told(recording: Recording, **columns: object) -> Recording:
    return replace(recording, trials=recording.trials.assign(**columns))


def one_line(recording: Recording) -> Recording:
    return told(recording, push_deg=recording.trials["push_deg"] % 180 // 91 * 180.0)


@pytest.mark.parametrize(
    "spoil",
    [
        lambda r: replace(r, trials=r.trials.drop(columns="phase")),
        lambda r: told(r, phase=""),
        lambda r: told(r, phase="50%", push_deg=0.0, push_onset_s=0.5, push_end_s=0.6),
        lambda r: told(r, push_onset_s=r.trials["push_onset_s"] + 9),
        lambda r: told(r, push_onset_s="soon"),
        lambda r: told(r, push_deg=np.nan),
        lambda r: told(r, push_end_s=r.trials["push_onset_s"] - 0.1),
        lambda r: told(r, push_onset_s=0.01, push_end_s=0.1),
        one_line,
        lambda r: replace(r, shoulder_m=None),
        lambda r: replace(r, subject=replace(r.subject, upper_arm_m=None)),
        lambda r: replace(r, shoulder_m=np.array([5.0, 0.0])),
        lambda r: replace(r, sample_rate_hz=100.0),
        lambda r: r.select(np.flatnonzero(r.trials["phase"] != "")),
        lambda r: replace(r, force=0 * r.force),
    ],
)
def test_bad_input_is_one_line(spoil):
    recording, _ = session()
    with pytest.raises(ArmImpedanceError) as told_error:
        ai.movement(spoil(recording))
    assert "\n" not in str(told_error.value)


@pytest.mark.parametrize("column", ["push_deg", "phase"])
def test_a_trial_of_a_wrong_label_is_named(column):
    recording, _ = session()
    table = recording.trials.copy()
    row = int(np.flatnonzero(table["phase"] != "")[3])
    table.loc[row, column] = {"push_deg": table["push_deg"][row] + 180, "phase": ""}[column]
    with pytest.raises(InputError, match=rf"trial {table['trial'][row]}\b"):
        identify_movement(replace(recording, trials=table))


def test_a_force_in_millinewtons_gives_no_number():
    recording, _ = session()
    with pytest.raises(EstimationError, match="units"):
        ai.movement(replace(recording, force=1000 * recording.force))


def test_a_force_of_the_wrong_sign_is_told():
    recording, _ = session()
    with pytest.raises(EstimationError):
        identify_movement(replace(recording, force=-recording.force))


@pytest.mark.parametrize(
    "asked", [{"phases": ["30%"]}, {"window_s": 3.0}, {"method": "x"}, {"level": "muscle"}]
)
def test_what_does_not_exist_is_told(asked):
    recording, _ = session()
    with pytest.raises(InputError):
        identify_movement(recording, **asked)


def test_a_moving_hand_is_no_posture():
    recording, _ = session()
    with pytest.raises(InputError, match="movement"):
        ai.estimate(recording)
