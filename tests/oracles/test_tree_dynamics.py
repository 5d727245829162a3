"""The simulator's own dynamics of a tree of segments against Pinocchio."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from armimpedance.core.errors import RecordError
from armimpedance.core.skeleton import Hinge, MarkerSite, Segment, Skeleton
from armimpedance.limb.arm.skeleton_model import MARKER_FRAME, skeleton_model
from manipulandum_sim.tree_dynamics import (
    contact_wrench,
    inverse_dynamics,
    marker_positions,
    mass_matrix,
)


def odd_tree(floating: bool) -> Skeleton:
    """Two branches, hinges about odd axes, bodies without any symmetry."""
    rng = np.random.default_rng(11)

    def body(mass: float) -> dict:
        root = 0.1 * rng.normal(size=(3, 3))
        return {"mass_kg": mass, "com_m": 0.1 * rng.normal(size=3), "inertia_kgm2": root @ root.T}

    axis = np.array([0.1, -1.0, 0.2])
    elbow = Hinge("elbow", axis / np.linalg.norm(axis))
    shoulder = (
        Hinge("flexion", [0, -1, 0]),
        Hinge("abduction", [1, 0, 0]),
        Hinge("turn", [0, 0, 1]),
    )
    neck = (Hinge("nod", [0, -1, 0]), Hinge("look", [0, 0, 1]))
    segments = (
        Segment("trunk", None, np.zeros(3), (), **body(30)),
        Segment("upper_arm", "trunk", [0, -0.2, 0.4], shoulder, **body(2)),
        Segment("forearm", "upper_arm", [0, 0, -0.3], (elbow,), **body(1.5)),
        Segment("head", "trunk", [0, 0, 0.5], neck, **body(4)),
    )
    return Skeleton(segments, (MarkerSite("wrist", "forearm", [0.1, 0.2, 0.3]),), floating)


@pytest.fixture(params=[True, False], ids=["floating", "fixed"])
def tree(request):
    skeleton = odd_tree(request.param)
    states = np.random.default_rng(3).normal(size=(3, 6, len(skeleton.coordinates)))
    return skeleton, skeleton_model(skeleton), states


def test_inverse_dynamics_is_pinocchio_s(tree):
    skeleton, model, (q, qd, qdd) = tree
    data = model.createData()
    expected = [pin.rnea(model, data, *state).copy() for state in zip(q, qd, qdd, strict=True)]
    np.testing.assert_allclose(inverse_dynamics(skeleton, q, qd, qdd), expected, atol=1e-10)


def test_mass_matrix_is_pinocchio_s(tree):
    skeleton, model, (q, _, _) = tree
    data = model.createData()
    upper = np.array([np.triu(pin.crba(model, data, one)) for one in q])
    expected = upper + np.triu(upper, 1).transpose(0, 2, 1)
    np.testing.assert_allclose(mass_matrix(skeleton, q), expected, atol=1e-12)


def test_markers_are_pinocchio_s_frames(tree):
    skeleton, model, (q, _, _) = tree
    data, frame = model.createData(), model.getFrameId(MARKER_FRAME.format("wrist"))
    for one, place in zip(q, marker_positions(skeleton, q)[:, 0], strict=True):
        pin.framesForwardKinematics(model, data, one)
        np.testing.assert_allclose(place, data.oMf[frame].translation, atol=1e-12)


def test_the_contact_wrench_at_rest_is_the_weight_under_the_centre_of_mass():
    skeleton = odd_tree(floating=True)
    q = np.random.default_rng(5).normal(size=(4, len(skeleton.coordinates)))
    wrench = contact_wrench(skeleton, q)
    model = skeleton_model(skeleton)
    centres = np.array([pin.centerOfMass(model, model.createData(), one).copy() for one in q])
    weight = np.array([0, 0, 9.80665 * skeleton.mass_kg])
    np.testing.assert_allclose(wrench[:, :3], np.broadcast_to(weight, (4, 3)), atol=1e-10)
    np.testing.assert_allclose(wrench[:, 3:], np.cross(centres, weight), atol=1e-9)


def test_a_skeleton_that_is_no_tree_is_refused():
    trunk = Segment("trunk", None, np.zeros(3))
    hinge = Hinge("elbow", [0, -1, 0])
    with pytest.raises(RecordError, match="no segment 'arm'"):
        Skeleton((trunk, Segment("forearm", "arm", np.zeros(3), (hinge,))))
    with pytest.raises(RecordError, match="root"):
        Skeleton((Segment("forearm", "trunk", np.zeros(3), (hinge,)),))
    with pytest.raises(RecordError, match="has length 2"):
        Hinge("elbow", [0, -2, 0])
