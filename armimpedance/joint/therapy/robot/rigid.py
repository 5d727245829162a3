"""Torques of rigid bodies on the robot's axes.

Import this module only where they are computed: it loads Pinocchio.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin

from armimpedance.core.arrays import FloatArray
from armimpedance.joint.therapy.robot.therapy_robot import TherapyRobot
from armimpedance.limb.arm import skeleton_model


@dataclass(frozen=True, eq=False)
class RigidBodies:
    """Inverse dynamics of bodies on the robot's axes; columns in the order of a recording.

    Attributes
    ----------
    model, data : pinocchio
        `data` is scratch space: one object serves one thread.
    chain : (n,) int
        Axis of each of the model's coordinates.
    """

    model: Any
    data: Any
    chain: Any

    def torque(self, q: FloatArray, qd: FloatArray, qdd: FloatArray) -> FloatArray:
        """``M qdd + C qd + G`` of one sample (n,) or of several (S, n).

        Parameters
        ----------
        q, qd, qdd : (n,) or (S, n)
            rad, rad/s, rad/s^2.
        """
        chain = self.chain
        torque = np.empty_like(q)
        if q.ndim == 1:
            torque[chain] = pin.rnea(self.model, self.data, q[chain], qd[chain], qdd[chain])
            return torque
        rows = (np.ascontiguousarray(part[:, chain]) for part in (q, qd, qdd))
        for i, (a, b, c) in enumerate(zip(*rows, strict=True)):
            torque[i, chain] = pin.rnea(self.model, self.data, a, b, c)
        return torque

    def inertia_torque(self, q: FloatArray, qdd: FloatArray) -> FloatArray:
        """``M qdd`` alone of one sample (n,) or of several (S, n)."""
        still = np.zeros_like(q)
        return self.torque(q, still, qdd) - self.torque(q, still, still)

    def potential_J(self, q: FloatArray) -> FloatArray:
        """Energy of the weight (S,) at angles (S, n), about an arbitrary zero."""
        rows = np.ascontiguousarray(q[:, self.chain])
        return np.array([pin.computePotentialEnergy(self.model, self.data, a) for a in rows])


def robot_bodies(robot: TherapyRobot) -> RigidBodies:
    """The empty robot's links and rotors.

    Parameters
    ----------
    robot : TherapyRobot
        With or without identified loads, which are no rigid bodies.

    Returns
    -------
    RigidBodies
    """
    model = skeleton_model(robot.skeleton)
    model.armature = robot.motor_inertia_kgm2[list(robot.chain)].copy()
    return RigidBodies(model, model.createData(), np.array(robot.chain))
