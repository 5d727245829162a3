"""The regressor times the parameters is Newton and Euler, row for row."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.joint.body.regressor import (
    inertial_parameters,
    parameter_names,
    pseudo_inertias,
    regressor,
    root_rotation,
    root_wrench,
    with_inertial_parameters,
)
from armimpedance.joint.body.rows import (
    RowChoice,
    about_world_origin,
    contact_torques,
    each_trial,
    standing_segments,
    wrench_on_root,
)
from armimpedance.limb.arm.skeleton_model import skeleton_model
from manipulandum_sim.tree_dynamics import move


def states(skeleton, samples=20, seed=0):
    n = len(skeleton.coordinates)
    rng = np.random.default_rng(seed)
    return rng.uniform(-1.2, 1.2, (samples, n)), *rng.normal(0, 3, (2, samples, n))


def test_joint_rows_are_the_own_inverse_dynamics(body, rigs):
    q, qd, qdd = states(body)
    Y = regressor(skeleton_model(body), q, qd, qdd, np.arange(6, 36))
    tau = rigs.inverse_dynamics(body, q, qd, qdd)
    np.testing.assert_allclose(
        Y @ inertial_parameters(body), tau[:, 6:], rtol=0, atol=1e-11 * np.abs(tau).max()
    )


def test_root_rows_are_the_contact_wrench_moved_to_the_root(body, rigs):
    q, qd, qdd = states(body)
    Y = regressor(skeleton_model(body), q, qd, qdd, np.arange(6))
    world = rigs.contact_wrench(body, q, qd, qdd)
    moved = wrench_on_root(world[:, None], q)
    np.testing.assert_allclose(
        Y @ inertial_parameters(body), moved, rtol=0, atol=1e-11 * np.abs(moved).max()
    )


def test_a_wrench_on_the_root_has_the_power_of_its_generalised_forces(body):
    q, qd, _ = states(body)
    rng = np.random.default_rng(1)
    tau = rng.normal(size=(len(q), 6))
    wrench = root_wrench(tau, q)
    motion = move(body, q, qd)
    R = root_rotation(q)
    np.testing.assert_allclose(R, motion.rotation[0], atol=1e-14)
    velocity = (qd[:, None, :3] @ R)[:, 0]
    rate = (motion.rate[0][:, None] @ R)[:, 0]
    power = (wrench[:, :3] * velocity + wrench[:, 3:] * rate).sum(axis=1)
    np.testing.assert_allclose(power, (tau * qd[:, :6]).sum(axis=1), rtol=1e-10, atol=1e-10)


def test_a_fixed_root_has_joint_rows_only(rigs):
    robot = rigs.tree(rigs.ROBOT, 2, floating=False)
    q, qd, qdd = states(robot)
    Y = regressor(skeleton_model(robot), q, qd, qdd)
    assert Y.shape == (20, 7, 70)
    assert parameter_names(robot)[0] == "m_link1"
    tau = rigs.inverse_dynamics(robot, q, qd, qdd)
    np.testing.assert_allclose(Y @ inertial_parameters(robot), tau, atol=1e-11 * np.abs(tau).max())


def test_contact_torques_are_virtual_work(body):
    q, qd, _ = states(body)
    rng = np.random.default_rng(2)
    origins, wrenches = rng.normal(size=(2, 3)), rng.normal(size=(len(q), 2, 6))
    standing = ("right_foot", "left_hand")
    world = about_world_origin(wrenches, origins)
    tau = contact_torques(skeleton_model(body), body, world, q, standing)
    step = 1e-6
    forward, back = move(body, q + step * qd), move(body, q - step * qd)
    power = np.zeros(len(q))
    for k, name in enumerate(standing):
        i = body.index(name)
        here = move(body, q, qd)
        # velocity of the segment's point at the plate's origin
        arm = (origins[k] - here.origin[i])[:, None] @ here.rotation[i]
        place = [
            m.origin[i] + (m.rotation[i] @ arm[:, 0, :, None])[..., 0] for m in (forward, back)
        ]
        velocity = (place[0] - place[1]) / (2 * step)
        power += (velocity * wrenches[:, k, :3]).sum(1) + (here.rate[i] * wrenches[:, k, 3:]).sum(1)
    np.testing.assert_allclose((tau * qd).sum(axis=1), power, rtol=1e-6, atol=1e-6)


def test_plates_are_told_apart_by_their_centres_of_pressure(rigs, small):
    recording, _ = rigs.moving(small, 0, trials=1)
    model = skeleton_model(small)
    forearm = move(small, recording.coordinates).origin[2]
    force = np.array([0.0, 0.0, 300.0])
    near = np.concatenate([np.broadcast_to(force, forearm.shape), np.cross(forearm, force)], axis=1)
    found = standing_segments(recording, model, slice(None), near[:, None])
    assert found == ("forearm",)


def test_rows_do_not_depend_on_where_a_plate_puts_its_origin(rigs, small):
    recording, _ = rigs.moving(small, 0, trials=1)
    place = np.array([0.3, -0.2, 0.05])
    shifted = np.array(recording.wrenches)
    shifted[..., 3:] -= np.cross(place, shifted[..., :3])
    other = replace(recording, wrenches=shifted, plate_origins_m=place[None])
    a, b = (next(iter(each_trial(r, RowChoice()))).w for r in (recording, other))
    np.testing.assert_allclose(a, b, atol=1e-9)


def test_a_root_on_its_side_is_refused_by_name_of_the_sample(small):
    q, qd, qdd = states(small)
    q[7, 4] = np.pi / 2
    with pytest.raises(InputError, match="90 degrees in sample 7"):
        regressor(skeleton_model(small), q, qd, qdd)


def test_a_part_of_the_roots_rows_is_refused(small):
    q, qd, qdd = states(small)
    with pytest.raises(InputError, match="all six"):
        regressor(skeleton_model(small), q, qd, qdd, np.array([2, 3]))


def test_parameters_make_the_skeleton_again(body):
    phi = inertial_parameters(body)
    again = inertial_parameters(with_inertial_parameters(body, phi))
    np.testing.assert_allclose(again, phi, atol=1e-14)


def test_a_pseudo_inertia_is_the_second_moment_of_mass(body):
    P = pseudo_inertias(inertial_parameters(body))
    first = body.segments[0]
    assert P[0, 3, 3] == pytest.approx(first.mass_kg)
    np.testing.assert_allclose(P[0, :3, 3], first.mass_kg * first.com_m)
    # I = tr(S) 1 - S for the upper left block S
    S = P[0, :3, :3] - first.mass_kg * np.outer(first.com_m, first.com_m)
    np.testing.assert_allclose(np.trace(S) * np.eye(3) - S, first.inertia_kgm2, atol=1e-14)
    assert np.linalg.eigvalsh(P).min() > 0


def test_an_impossible_segment_is_named(body, rigs):
    phi = inertial_parameters(body)
    phi[24] = 3 * (phi[26] + phi[29])  # Ixx above Iyy + Izz
    assert rigs.impossible_segments(body, phi) == ("head",)
