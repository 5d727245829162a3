"""The spatial rig's arm against Pinocchio."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from armimpedance.limb.arm.skeleton_model import MARKER_FRAME, skeleton_model
from manipulandum_sim.hand import find_subject
from manipulandum_sim.space import SpaceArm


@pytest.mark.parametrize("free_wrist", [False, True])
def test_dynamics_are_pinocchio_s(free_wrist):
    arm = SpaceArm.of(find_subject("B"), free_wrist)
    model = skeleton_model(arm.skeleton())
    data, frame = model.createData(), model.getFrameId(MARKER_FRAME.format("hand"))
    q, qd = np.random.default_rng(8).normal(size=(2, 5, arm.joints))
    now = arm.dynamics(q, qd)
    for i in range(len(q)):
        M = np.triu(pin.crba(model, data, q[i]))
        np.testing.assert_allclose(now.M[i], M + np.triu(M, 1).T, atol=1e-13)
        np.testing.assert_allclose(now.h[i], pin.nle(model, data, q[i], qd[i]), atol=1e-12)
        axes = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        J = pin.computeFrameJacobian(model, data, q[i], frame, axes)[:3]
        np.testing.assert_allclose(now.J[i], J, atol=1e-13)
        pin.forwardKinematics(model, data, q[i], qd[i], np.zeros(arm.joints))
        drift = pin.getFrameClassicalAcceleration(model, data, frame, axes).linear
        np.testing.assert_allclose(now.drift[i], drift, atol=1e-12)
