"""Angles in radians, or perhaps in degrees by mistake."""

from __future__ import annotations

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import LARGEST_ANGLE_RAD
from armimpedance.core.errors import InputError


def refuse_degrees(q: FloatArray, joints: tuple[str, ...]) -> None:
    """Refuse angles (N, j) that no joint in radians can have.

    Parameters
    ----------
    q : (N, j)
        Angles.
    joints : tuple of j str
        Names for the message.

    Raises
    ------
    InputError
        Names the joint.
    """
    largest = np.abs(q).max(axis=0)
    for name, angle in zip(joints, largest, strict=True):
        if angle > LARGEST_ANGLE_RAD:
            raise InputError(
                f"angles of {name} up to {angle:.4g} rad",
                expected="radians within a turn of zero; are these degrees?",
            )
