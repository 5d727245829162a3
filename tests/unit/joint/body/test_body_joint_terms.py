"""What a joint adds of its own: a robot's friction and motors, a body's passive joints."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.joint.body.base_parameters import essential_base_parameters
from armimpedance.joint.body.equations import body_equations
from armimpedance.joint.body.identify import identify_body
from armimpedance.joint.body.regressor import (
    JointTerm,
    inertial_parameters,
    passive_terms,
    robot_terms,
    term_columns,
)
from armimpedance.joint.body.rows import RowChoice
from armimpedance.numerics.signals.filters import lowpass


def robot_log(rigs, seed, noise=0.0):
    """A seven-joint robot's log with friction, motors and offsets, and the truth of all columns."""
    robot = rigs.tree(rigs.ROBOT, 2, floating=False)
    rng = np.random.default_rng(seed)
    parts = [rigs.splined(7, 12.0, rng, size=0.7) for _ in range(2)]
    q, qd, qdd = (np.concatenate([p[i] for p in parts]) for i in (1, 2, 3))
    h, f, motor, offset = rng.uniform(0.2, 2.0, (4, 7))
    tau = rigs.inverse_dynamics(robot, q, qd, qdd)
    tau += h * qd + f * np.sign(qd) + motor * qdd + offset
    tau += noise * rng.standard_normal(tau.shape)
    truth = np.concatenate(
        [inertial_parameters(robot), np.stack([h, f, motor, offset], axis=1).ravel()]
    )
    return rigs.record(robot, parts, None, torque=tau), truth


def test_a_robots_log_gives_its_base_parameters(rigs):
    recording, truth = robot_log(rigs, 0)
    choice = RowChoice(rows="all", terms=robot_terms(recording.skeleton))
    found = identify_body(recording, choice=choice, motions=None)
    np.testing.assert_allclose(found.parameters.values, found.base.of(truth), rtol=1e-7, atol=1e-9)
    assert found.fitted.pooled_r2() > 1 - 1e-12
    assert found.summary.parameters[0].name == found.base.names[0]


def test_noise_on_a_robots_torque_stays_within_the_intervals(rigs):
    inside = []
    for seed in range(4):
        recording, truth = robot_log(rigs, seed, noise=0.5)
        choice = RowChoice(rows="all", terms=robot_terms(recording.skeleton))
        found = identify_body(recording, choice=choice, motions=None)
        off = np.abs(found.parameters.values - found.base.of(truth))
        inside.append(off < 1.96 * found.parameters.plain_sd)
    # 4 x 72 intervals, those of one log not quite independent: sd of the share some 2 %
    assert 0.88 < np.mean(inside) < 0.995


def test_a_robot_may_have_a_physically_consistent_fit(rigs):
    recording, truth = robot_log(rigs, 1, noise=0.5)
    choice = RowChoice(rows="all", terms=robot_terms(recording.skeleton))
    free = identify_body(recording, choice=choice, motions=None)
    found = identify_body(recording, choice=choice, motions=None, method="prior", prior_sd=0.2)
    assert found.phi is not None
    assert rigs.impossible_segments(recording.skeleton, found.phi[:70]) == ()
    # the prior is the truth here: shrinking towards it shortens the error in the data's metric
    equations = body_equations(recording, choice)
    R = equations.stacked()[:, found.base.leading]
    away = [np.linalg.norm(R @ (f.parameters.values - f.base.of(truth))) for f in (found, free)]
    assert away[0] < away[1]


def test_passive_joints_of_a_body_are_found_together_with_its_inertia(small, rigs):
    """The forearm and one turn of the arm hang loose: their own forces balance the dynamics."""
    names, rest = ("arm_2", "forearm_flexion"), (0.1, -0.2)
    terms = passive_terms(names, rest, quadratic=True)
    choice = RowChoice(passive_joints=names, terms=terms)
    base = essential_base_parameters(small, choice)
    assert base.rank == 26 + len(terms)
    # torque measured at these joints stands for a doctor who moves them: the passive law in reverse
    recording, parts = rigs.moving(small, 3)
    q, qd, qdd = (np.concatenate([p[i] for p in parts]) for i in (1, 2, 3))
    tau = rigs.inverse_dynamics(small, q, qd, qdd)
    law = {"k": (3.0, 1.5), "h": (0.2, 0.1), "f": (0.05, 0.02), "K": (0.6, -0.4)}
    for at, name in enumerate(names):
        j, off = small.coordinate(name), 0.0
        off = q[:, j] - rest[at]
        tau[:, j] += law["k"][at] * off + law["K"][at] * off**2
        tau[:, j] += law["h"][at] * qd[:, j] + law["f"][at] * np.sign(qd[:, j])
    driven = replace(recording, torque=tau, wrenches=None, plate_origins_m=None)
    found = identify_body(
        driven, choice=RowChoice(rows="all", terms=terms), motions=None, check=False
    )
    for at, name in enumerate(names):
        for symbol, values in law.items():
            i = found.base.names.index(f"{symbol}_{name}")
            assert found.parameters.values[i] == pytest.approx(values[at], abs=1e-7)


def test_a_loose_joint_takes_no_torque(small, rigs):
    """Passive rows: what is measured at a passive joint is not its muscles', and is left out."""
    recording, _ = rigs.moving(small, 3, trials=1)
    from armimpedance.joint.body.rows import each_trial

    choice = RowChoice(passive_joints=("forearm_flexion",), standing=("trunk",))
    w = next(iter(each_trial(recording, choice))).w
    assert w.shape[1] == 7
    assert not w[:, 6].any()  # the plate under the trunk does not reach the forearm


def test_the_sign_of_the_velocity_is_filtered_like_all_else(small, rigs):
    recording, parts = rigs.moving(small, 3, trials=1)
    q, qd, qdd = parts[0][1:]
    term = JointTerm("friction", "forearm_flexion")
    column = term_columns((term,), small, q, (q, qd, qdd), rigs.RATE, 8.0)[:, 0]
    # reversals between samples count, so that it differs from the sampled sign's by a part of one
    coarse = lowpass(np.sign(qd[:, 9]), 8.0, rigs.RATE, axis=0)
    assert 0 < np.abs(column - coarse)[20:-20].max() < 0.35
    assert np.abs(column[20:-20]).max() < 1.3
    bare = term_columns((term,), small, q, (q, qd, qdd), rigs.RATE, None)[:, 0]
    assert set(np.unique(bare)) <= {-1.0, 0.0, 1.0}


def test_terms_that_make_no_sense_are_refused(small):
    with pytest.raises(InputError, match="no joint term"):
        JointTerm("magic", "forearm_flexion")
    with pytest.raises(InputError, match="1 rest angles for 2 joints"):
        passive_terms(("arm_2", "arm_1"), (0.1,))
