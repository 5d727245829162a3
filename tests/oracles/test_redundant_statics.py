"""A redundant arm in static equilibrium, solved point by point: what its hand stiffness is.

The slow and obvious way: three joints with non-linear springs hold the hand at a force; the hand
is moved by hand, the joints settle where the springs' torque along the free motion vanishes, and
the force at the hand is read off. No formula of the mapping is used.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import root

from armimpedance.core.records import ArmPosture, ImpedanceEstimate, Quality
from armimpedance.hand.levels.joint import to_hand

LENGTHS = np.array([0.30, 0.25, 0.09])
REST = np.array([0.9, 0.8, 0.5])
K_J = np.array([[30.0, 8.0, 1.0], [8.0, 22.0, 3.0], [1.0, 3.0, 6.0]])


def hand(q):
    absolute = np.cumsum(q)
    return np.array([LENGTHS @ np.cos(absolute), LENGTHS @ np.sin(absolute)])


def jacobian(q):
    step = 1e-6
    return np.stack([(hand(q + s) - hand(q - s)) / (2 * step) for s in step * np.eye(3)], axis=-1)


def exact_jacobian(q):
    absolute = np.cumsum(q)
    sines, cosines = LENGTHS * np.sin(absolute), LENGTHS * np.cos(absolute)
    return np.stack([-np.cumsum(sines[::-1])[::-1], np.cumsum(cosines[::-1])[::-1]])


def joint_torque(q, offset):
    dq = q - REST
    return offset - K_J @ dq - 15.0 * dq**3 + 4.0 * dq**2


def settled_force(X, offset, start):
    """Hand force at a held hand position: unknowns q (3) and F (2)."""

    def residual(unknown):
        q, F = unknown[:3], unknown[3:]
        torque = joint_torque(q, offset) - exact_jacobian(q).T @ F
        return np.concatenate([torque, 100 * (hand(q) - X)])

    solution = root(residual, start, tol=1e-13)
    assert np.abs(residual(solution.x)).max() < 1e-8
    return solution.x[3:]


@pytest.mark.parametrize("force", [(0.0, 0.0), (6.0, -9.0), (-12.0, 4.0), (3.0, 14.0)])
def test_hand_stiffness_of_a_redundant_arm_under_force(force):
    force = np.array(force)
    offset = exact_jacobian(REST).T @ force
    start, step = np.concatenate([REST, force]), 1e-4
    columns = []
    for shift in step * np.eye(2):
        ahead = settled_force(hand(REST) + shift, offset, start)
        behind = settled_force(hand(REST) - shift, offset, start)
        columns.append(-(ahead - behind) / (2 * step))
    measured = np.stack(columns, axis=-1)

    step = 1e-4
    derivative = np.stack(
        [(jacobian(REST + s) - jacobian(REST - s)) / (2 * step) for s in step * np.eye(3)], axis=-1
    )
    posture = ArmPosture(REST, hand(REST), jacobian(REST), derivative)
    quality = Quality(1, 1, 1.0, 1.0, 1.0, 1.0, 12, 0.0)
    joint = ImpedanceEstimate(
        "joint", "truth", K_J, K_J, K_J, np.eye(27), np.inf, quality, force=force
    )
    mapped = to_hand(joint, posture).stiffness
    assert np.linalg.norm(mapped - measured) < 1e-4 * np.linalg.norm(measured)
    if force.any():
        without = to_hand(replace(joint, force=None), posture).stiffness
        assert np.linalg.norm(without - measured) > 0.02 * np.linalg.norm(measured)
