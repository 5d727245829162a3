"""Estimates of a hand in space whose elbow is free, as rows that a muscle model is fitted to."""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

import numpy as np

from armimpedance.core.conventions import group_name
from armimpedance.core.errors import InputError
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.limb.arm import Arm, SpatialArm
from armimpedance.muscles.models.from_estimates import muscles_of, where_all
from armimpedance.muscles.models.hand_rows import HandRows
from armimpedance.muscles.models.rows import JointRows
from armimpedance.muscles.models.shared_errors import shared_blocks


def rows_of_hand(estimates: Sequence[ImpedanceEstimate], arm: SpatialArm) -> HandRows:
    """K of the hand with its standard errors, one row per estimate; all joints are free.

    The torque that the muscles bear is the hand force's and, where the arm knows gravity, the
    weight's. Activations are taken with their standard errors where all estimates have them.

    Parameters
    ----------
    estimates : sequence of ImpedanceEstimate
        Of the hand in three axes, each with all angles of the arm and activations.
    arm : SpatialArm

    Returns
    -------
    HandRows

    Raises
    ------
    InputError
        No estimates, or one of another level or number of axes, without joint angles, activations
        or standard errors; names its condition.
    """
    if not estimates:
        raise InputError("no estimates", expected="one or more of level hand")
    for estimate in estimates:
        _check(estimate, arm)
    q = np.array([e.joint_angles for e in estimates])
    force = np.array([np.zeros(arm.axes) if e.force is None else e.force for e in estimates])
    postures = [arm.posture(angles) for angles in q]
    return HandRows.of(
        cast(Arm, arm),
        q,
        force=force,
        stiffness=np.array([e.stiffness for e in estimates]),
        stiffness_sd=np.array([e.sd[2] for e in estimates]),
        activation=where_all(estimates, "activation"),
        activation_sd=where_all(estimates, "activation_sd"),
        torque=np.array([p.torque_under(F) for p, F in zip(postures, force, strict=True)]),
        labels=tuple(group_name(e.keys) for e in estimates),
        muscles=muscles_of(estimates),
        stiffness_shared=shared_blocks([e.shared_errors for e in estimates], arm.axes)[:, :, 2],
        doubts=JointRows.doubts_in(warning for e in estimates for warning in e.warnings),
    )


def _check(estimate: ImpedanceEstimate, arm: SpatialArm) -> None:
    name = group_name(estimate.keys)
    if estimate.level != "hand" or estimate.k != arm.axes:
        problem = f"{name}: an estimate at the {estimate.level} level of {estimate.k} axes"
        raise InputError(problem, expected="level hand, three axes")
    if estimate.joint_angles is None or len(estimate.joint_angles) != arm.joints:
        expected = f"q_1_rad to q_{arm.joints}_rad: {arm.joints} measured angles"
        raise InputError(f"{name}: no joint angles", expected=expected)
    if estimate.activation is None:
        raise InputError(f"{name}: no activation", expected="columns alpha_1, alpha_2, …")
    if not (estimate.sd[2] > 0).all():
        raise InputError(f"{name}: no standard errors of K", expected="columns sd_K_11 and so on")
