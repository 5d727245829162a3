"""Recordings of a simulated body: exact without noise, exciting enough, the same again."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pinocchio as pin
import pytest

from armimpedance.core.errors import InputError
from armimpedance.core.motion import MarkerRecording
from armimpedance.limb.arm.skeleton_model import skeleton_model
from manipulandum_sim.body.simulate import simulate_body
from manipulandum_sim.body.subject import find_body_subject
from manipulandum_sim.body.truth import BodyTruth
from manipulandum_sim.force_plates import PLATE_ORIGINS_M, about, foot_wrenches
from manipulandum_sim.studio import Studio
from manipulandum_sim.tree_dynamics import marker_positions

RATE = {"sample_rate_hz": 50.0}
QUIET = {"angle_noise_rad": 0.0, "force_noise_N": 0.0, "moment_noise_Nm": 0.0, **RATE}
GREEDY = ("all_joints", "walk", "head_and_arms", "trunk_twist")


@pytest.fixture(scope="module")
def session():
    return simulate_body((*GREEDY, "pelvis_still", "static"), seed=3, **QUIET)


@pytest.fixture(scope="module")
def model(session):
    return skeleton_model(session[0].skeleton)


def samples_of(recording, condition, every):
    rows = np.flatnonzero(recording.trials["condition"] == condition)
    where = [np.arange(len(recording.time_s))[recording.samples_of(row)] for row in rows]
    return np.concatenate(where)[::every]


def regressor(model, truth, where, rows=36):
    """Rows of Y (len(where) * rows, 150); of the root as a wrench in its own frame."""
    data, blocks = model.createData(), []
    for i in where:
        Y = pin.computeJointTorqueRegressor(model, data, truth.q[i], truth.qd[i], truth.qdd[i])
        Y = Y[:rows].copy()
        Y[:6] = root_wrench(truth.q[i]) @ Y[:6]
        blocks.append(Y)
    return np.concatenate(blocks)


def root_wrench(q):
    """Generalised forces of the root's coordinates -> force, moment in the root's axes (6, 6)."""
    rz, ry = pin.utils.rotate("z", q[3]), pin.utils.rotate("y", q[4])
    R = rz @ ry @ pin.utils.rotate("x", q[5])
    axes = np.column_stack([np.eye(3)[2], rz[:, 1], (rz @ ry)[:, 0]])
    T = np.zeros((6, 6))
    T[:3, :3], T[3:, 3:] = R.T, R.T @ np.linalg.inv(axes.T)
    return T


def rank(Y):
    scale = np.linalg.norm(Y, axis=0)
    scale[scale < 1e-9 * scale.max()] = np.inf
    values = np.linalg.svd(Y / scale, compute_uv=False)
    return int((values > 1e-9 * values[0]).sum())


def base_columns(Y, count=128):
    """A full-rank choice of columns, by greedy orthogonalisation of the scaled ones."""
    scale = np.linalg.norm(Y, axis=0)
    scale[scale == 0] = np.inf
    left, chosen = Y / scale, []
    for _ in range(count):
        best = int(np.argmax((left**2).sum(axis=0)))
        direction = left[:, best] / np.linalg.norm(left[:, best])
        left = left - np.outer(direction, direction @ left)
        chosen.append(best)
    return chosen


def condition_number(Y, columns):
    W = Y[:, columns]
    return np.linalg.cond(W / np.linalg.norm(W, axis=0))


@pytest.mark.study
def test_motion_times_parameters_is_the_force(session, model):
    recording, truth = session
    where = samples_of(recording, "walk", 20)
    Y = regressor(model, truth, where)
    tau = np.array(
        [
            np.r_[root_wrench(truth.q[i]) @ t[:6], t[6:]]
            for i, t in zip(where, truth.generalised_forces[where], strict=True)
        ]
    )
    np.testing.assert_allclose(Y @ truth.parameters.ravel(), tau.ravel(), atol=1e-8)


def test_plates_moved_to_the_pelvis_are_the_root_s_rows(session, model):
    """``Y_B phi = sum_k K_k^T F_k``: what a laboratory measures is what the parameters predict."""
    recording, truth = session
    where = samples_of(recording, "all_joints", 20)
    predicted = (regressor(model, truth, where, 6) @ truth.parameters.ravel()).reshape(-1, 6)
    for i, expected in zip(where, predicted, strict=True):
        R = pin.rpy.rpyToMatrix(*truth.q[i, [5, 4, 3]])
        total = np.zeros(6)
        for k, origin in enumerate(recording.plate_origins_m):
            force, moment = recording.wrenches[i, k, :3], recording.wrenches[i, k, 3:]
            moment = moment + np.cross(origin - truth.q[i, :3], force)
            total += np.r_[R.T @ force, R.T @ moment]
        np.testing.assert_allclose(total, expected, atol=1e-8)


def test_joint_torques_are_the_forces_less_the_contacts(session):
    """No motor at the root: ``rnea - sum_k J_k^T w_k`` is zero there and the muscles' elsewhere."""
    recording, truth = session
    own = skeleton_model(find_body_subject("A").skeleton)
    data = own.createData()
    for i in samples_of(recording, "walk", 50):
        q = np.array(truth.q[i])
        tau = pin.rnea(own, data, q, np.array(truth.qd[i]), np.array(truth.qdd[i])).copy()
        pin.computeJointJacobians(own, data, q)
        for k, side in enumerate(("right", "left")):
            joint = own.getJointId(f"{side}_foot")
            J = pin.getJointJacobian(own, data, joint, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
            force, moment = truth.foot_wrenches[i, k, :3], truth.foot_wrenches[i, k, 3:]
            moment = moment - np.cross(data.oMi[joint].translation, force)
            tau -= J.T @ np.r_[force, moment]
        np.testing.assert_allclose(truth.joint_torques[i], tau, atol=1e-7)


@pytest.mark.parametrize(
    ("condition", "every", "expected"),
    [("all_joints", 12, 128), ("pelvis_still", 12, 121), ("static", 10, 42)],
)
def test_what_each_kind_of_motion_can_say(session, model, condition, every, expected):
    """Base rows and all rows have one rank: 128; pelvis held 121; gravity only 42."""
    recording, truth = session
    where = samples_of(recording, condition, every)
    assert rank(regressor(model, truth, where, 6)) == expected
    assert rank(regressor(model, truth, where[::2])) == expected


def test_the_motions_excite_as_they_should(session, model):
    """All joints at once beat walking by far; with three more motions the condition is below 16."""
    recording, truth = session
    Y = {name: regressor(model, truth, samples_of(recording, name, 6), 6) for name in GREEDY}
    together = np.concatenate(list(Y.values()))
    columns = base_columns(np.linalg.qr(together, mode="r"))
    best = condition_number(Y["all_joints"], columns)
    assert best < 25
    assert condition_number(Y["walk"], columns) > 4 * best
    assert condition_number(together, columns) < 16


def test_a_lifted_foot_s_plate_reads_zero_and_the_plates_carry_everything(session):
    recording, truth = session
    where = samples_of(recording, "walk", 1)
    feet = truth.foot_wrenches[where]
    np.testing.assert_allclose(about(feet, PLATE_ORIGINS_M), recording.wrenches[where], atol=1e-12)
    for k in (0, 1):
        lifted = feet[:, k, 2] == 0
        assert 0.15 < lifted.mean() < 0.5
        assert (recording.wrenches[where][lifted, k] == 0).all()
    assert not (feet[:, :, 2] == 0).all(axis=1).any()


def test_shares_add_up_whatever_the_wrench():
    rng = np.random.default_rng(9)
    whole = rng.normal(size=(40, 6)) + [0, 0, 700, 0, 0, 0]
    share = np.r_[0.0, 1.0, rng.random(38)]
    supports = rng.normal(size=(40, 2, 3)) * [1, 1, 0]
    feet, pressure = foot_wrenches(whole, share, supports)
    np.testing.assert_allclose(feet.sum(axis=1), whole, atol=1e-9)
    assert (feet[0, 1] == 0).all()
    assert (feet[1, 0] == 0).all()
    np.testing.assert_array_equal(
        np.isnan(pressure[:2]).any(axis=2), [[False, True], [True, False]]
    )


def test_moments_about_a_plate_s_origin():
    force, place, origin = np.array([10.0, -20.0, 500.0]), np.array([0.2, 0.3, 0]), [[0.1, -0.4, 0]]
    wrench = np.r_[force, np.cross(place, force)][None, None]
    moved = about(wrench, np.array(origin))[0, 0]
    np.testing.assert_allclose(moved[3:], np.cross(place - origin[0], force), atol=1e-12)


def test_noise_has_the_sd_that_was_asked_for(session):
    quiet, truth = session
    noisy, same = simulate_body(
        ["walk"], seed=3, angle_noise_rad=0.003, force_noise_N=2.0, moment_noise_Nm=0.7, **RATE
    )
    where = quiet.samples_of(1)
    # the last bits depend on how many samples are solved at once
    np.testing.assert_allclose(same.q, truth.q[where], atol=1e-10)
    errors = noisy.coordinates - same.q
    wrench = noisy.wrenches - quiet.wrenches[where]
    for found, sd in (
        (errors[:, 6:], 0.003),
        (errors[:, :3], 0.25 * 0.003),
        (wrench[..., :3], 2.0),
        (wrench[..., 3:], 0.7),
    ):
        assert abs(found.std() / sd - 1) < 4 / np.sqrt(2 * found.size)


def test_a_trial_does_not_depend_on_the_others(session):
    recording, _ = session
    among = recording.coordinates[recording.samples_of(1)]
    twice, _ = simulate_body(["walk", "walk"], seed=3, **QUIET)
    first = twice.coordinates[twice.samples_of(0)]
    np.testing.assert_allclose(first, among, atol=1e-10)
    assert len(twice.coordinates) != 2 * len(first)


def test_the_recording_knows_the_table_not_the_subject(session):
    recording, truth = session
    who = find_body_subject("A")
    for segment, table in zip(
        recording.skeleton.segments, who.table_skeleton.segments, strict=True
    ):
        assert segment.mass_kg == table.mass_kg
    own = [s.mass_kg for s in who.skeleton.segments]
    np.testing.assert_allclose(truth.parameters[:, 0], own, rtol=1e-12)
    assert recording.subject.mass_kg == pytest.approx(truth.parameters[:, 0].sum(), rel=1e-12)


def test_markers_are_filmed_from_the_exact_motion():
    still = Studio(marker_noise_m=0.0)
    filmed, truth = simulate_body(["squat"], seed=1, markers=still, **QUIET)
    assert isinstance(filmed, MarkerRecording)
    places = marker_positions(filmed.skeleton, truth.q)
    np.testing.assert_allclose(filmed.positions, places, atol=1e-12)
    assert filmed.wrenches is not None
    noisy, _ = simulate_body(["squat"], seed=1, markers=True, **QUIET)
    assert np.isfinite(noisy.positions).all()
    assert 1e-4 < np.std(noisy.positions - places) < 1e-3


def test_truth_survives_a_file(tmp_path, session):
    _, truth = session
    path = tmp_path / "truth.json"
    truth.write(path)
    again = BodyTruth.read(path)
    np.testing.assert_array_equal(again.parameters, truth.parameters)
    assert again.segments == truth.segments
    assert again.coordinates == truth.coordinates
    assert again.q is None


@pytest.mark.parametrize("text", ["", "[1]", '{"segments": ["a"]}', '{"parameters": [[1]]}'])
def test_what_is_no_truth_is_refused(tmp_path, text):
    path = tmp_path / "truth.json"
    path.write_text(text)
    with pytest.raises(InputError, match="truth"):
        BodyTruth.read(path)


@pytest.mark.parametrize(
    ("call", "says"),
    [
        ({"motions": ["hop"]}, "no motion 'hop'"),
        ({"motions": []}, "no motions"),
        ({"motions": ["squat"], "subject": "Z"}, "no simulated body 'Z'"),
        ({"motions": ["squat"], "force_noise_N": -1.0}, "noise of -1.0"),
        ({"motions": ["squat"], "angle_noise_rad": np.nan}, "noise of nan"),
        ({"motions": ["squat"], "sample_rate_hz": 5.0}, "sampled at 5.0 Hz"),
    ],
)
def test_calls_that_make_no_sense(call, says):
    with pytest.raises(InputError, match=says):
        simulate_body(**call)


def test_the_trial_table_names_the_motions(session):
    recording, _ = session
    expected = pd.Series([*GREEDY, "pelvis_still", *["static"] * 60], name="condition")
    pd.testing.assert_series_equal(recording.trials["condition"], expected)
    held = about(recording.wrenches[recording.samples_of(4)], -PLATE_ORIGINS_M)
    np.testing.assert_allclose(held[:, 0], held[:, 1], atol=1e-11)
