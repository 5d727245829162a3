"""Places of markers and their Jacobian, against two other ways to compute them."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from armimpedance.limb.arm.skeleton_model import MARKER_FRAME, skeleton_model
from armimpedance.limb.arm.skeletons import body_skeleton, elbow_skeleton
from armimpedance.limb.mocap.kinematics import marker_jacobian, marker_places, marker_tree
from manipulandum_sim.tree_dynamics import marker_positions

SKELETONS = {"elbow": elbow_skeleton(70.0, 1.75), "body": body_skeleton(73.0, 1.741)}


def postures(skeleton, frames=6):
    return np.random.default_rng(1).uniform(-1.5, 1.5, (frames, len(skeleton.coordinates)))


@pytest.mark.parametrize("skeleton", SKELETONS.values(), ids=SKELETONS)
def test_places_are_those_of_the_simulator(skeleton):
    q = postures(skeleton)
    places = marker_places(marker_tree(skeleton), q)
    np.testing.assert_allclose(places, marker_positions(skeleton, q), atol=1e-13)


@pytest.mark.parametrize("skeleton", SKELETONS.values(), ids=SKELETONS)
def test_places_are_pinocchios(skeleton):
    q = postures(skeleton, 2)
    model = skeleton_model(skeleton)
    data = model.createData()
    places = marker_places(marker_tree(skeleton), q)
    for frame in range(2):
        pin.framesForwardKinematics(model, data, q[frame])
        for m, name in enumerate(skeleton.marker_names):
            there = data.oMf[model.getFrameId(MARKER_FRAME.format(name))].translation
            np.testing.assert_allclose(places[frame, m], there, atol=1e-13)


@pytest.mark.parametrize("skeleton", SKELETONS.values(), ids=SKELETONS)
def test_jacobian_is_the_derivative(skeleton):
    tree, q, step = marker_tree(skeleton), postures(skeleton, 3), 1e-6
    places, jacobian = marker_jacobian(tree, q)
    np.testing.assert_array_equal(places, marker_places(tree, q))
    for k in range(q.shape[1]):
        nudge = step * np.eye(q.shape[1])[k]
        slope = (marker_places(tree, q + nudge) - marker_places(tree, q - nudge)) / (2 * step)
        np.testing.assert_allclose(np.moveaxis(jacobian[..., k], 1, 2), slope, atol=1e-8)


def test_a_choice_of_markers_in_its_own_order():
    skeleton = SKELETONS["elbow"]
    q = postures(skeleton)
    some = marker_places(marker_tree(skeleton, ("hand", "acromion_left")), q)
    every = marker_places(marker_tree(skeleton), q)
    order = [skeleton.marker_names.index(n) for n in ("hand", "acromion_left")]
    np.testing.assert_array_equal(some, every[:, order])
