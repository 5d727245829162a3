"""A skeleton as a Pinocchio model: one joint per segment, coordinates in the skeleton's order.

Import this module only where it is used: it loads Pinocchio.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pinocchio as pin

from armimpedance.core.arrays import FloatArray
from armimpedance.core.skeleton import GRAVITY_M_S2, Segment, Skeleton

#: Name of the frame of marker m in the model.
MARKER_FRAME = "marker_{}"


def skeleton_model(
    skeleton: Skeleton, *, gravity_m_s2: Sequence[float] = (0.0, 0.0, -GRAVITY_M_S2)
) -> Any:
    """Build the Pinocchio model of a skeleton.

    Its q, v, a are the skeleton's coordinates (n,) and their derivatives: a floating root is three
    slides along x, y, z and three turns about z, y, x. Joint i + 1 carries segment i; with a fixed
    root joint i carries segment i and the root is the universe. Markers are frames
    (`MARKER_FRAME`).

    Parameters
    ----------
    skeleton : Skeleton
        Masses and inertias may be zero; the regressor does not need them.
    gravity_m_s2 : (3,)

    Returns
    -------
    pinocchio.Model
    """
    model = pin.Model()
    model.gravity.linear = np.array(gravity_m_s2, dtype=float)
    joint_of: dict[str, int] = {}
    for segment in skeleton.segments:
        parent = 0 if segment.parent is None else joint_of[segment.parent]
        joint = 0
        if segment.parent is not None or skeleton.floating:
            joint = model.addJoint(parent, _joint(segment), _at(segment.origin_m), segment.name)
        model.appendBodyToJoint(joint, _body(segment), pin.SE3.Identity())
        joint_of[segment.name] = joint
    for site in skeleton.markers:
        joint = joint_of[site.segment]
        kind = pin.FrameType.OP_FRAME
        name = MARKER_FRAME.format(site.name)
        model.addFrame(pin.Frame(name, joint, 0, _at(site.position_m), kind))
    return model


def _joint(segment: Segment) -> Any:
    composite = pin.JointModelComposite()
    if segment.parent is None:
        for kind in ("PX", "PY", "PZ", "RZ", "RY", "RX"):
            composite.addJoint(getattr(pin, f"JointModel{kind}")())
        return composite
    for hinge in segment.hinges:
        composite.addJoint(pin.JointModelRevoluteUnaligned(np.array(hinge.axis)))
    return composite


def _body(segment: Segment) -> Any:
    return pin.Inertia(segment.mass_kg, np.array(segment.com_m), np.array(segment.inertia_kgm2))


def _at(place: FloatArray) -> Any:
    return pin.SE3(np.eye(3), np.array(place))
