"""The rigid bodies of a person's arm, moved by the robot's axes.

Import this module only where torques are computed: it loads Pinocchio.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from armimpedance.core.skeleton import Skeleton
from armimpedance.joint.therapy.arm.passive_arm import ArmSegment, PassiveArm
from armimpedance.joint.therapy.robot.rigid import RigidBodies
from armimpedance.joint.therapy.robot.therapy_robot import TherapyRobot
from armimpedance.limb.arm import skeleton_model


def arm_bodies(robot: TherapyRobot, arm: PassiveArm) -> RigidBodies:
    """The person's arm alone, moved by the robot's axes; without its passive stiffness."""
    model = skeleton_model(arm_skeleton(robot.skeleton, arm.segments))
    return RigidBodies(model, model.createData(), np.array(robot.chain))


def arm_skeleton(frame: Skeleton, segments: tuple[ArmSegment, ...]) -> Skeleton:
    """The robot's joints with the masses of an arm instead of its own.

    Segments of the arm that share a link become one body.
    """
    bodies = []
    for segment in frame.segments:
        carried = [s for s in segments if s.link == segment.name]
        mass = sum(s.mass_kg for s in carried)
        com = sum(s.mass_kg * s.com_m for s in carried) / mass if mass > 0 else 0.0
        # parallel axis: I = sum I_i + m_i (c_i - c)^2, about both transverse axes
        own = sum(s.inertia_kgm2 + s.mass_kg * (s.com_m - com) ** 2 for s in carried)
        bodies.append(
            replace(
                segment,
                mass_kg=float(mass),
                com_m=np.array([0.0, 0.0, -com]),
                inertia_kgm2=np.diag([own, own, sum(s.inertia_long_kgm2 for s in carried)]),
            )
        )
    return replace(frame, segments=tuple(bodies), markers=())
