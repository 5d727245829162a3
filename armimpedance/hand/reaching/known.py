"""The arm's inertia from the same person's experiment in posture."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.estimates import ImpedanceEstimate
from armimpedance.hand.reaching.arm import inertia_rows
from armimpedance.hand.reaching.solve import Known
from armimpedance.limb.arm import TwoLinkArm

#: No experiment knows the links of a person better than this: what the model of two links leaves.
FLOOR = 0.01


def known_inertia(estimates: Sequence[ImpedanceEstimate], arm: TwoLinkArm) -> Known:
    """The three inertial parameters of two links from the hand's M at one posture or more.

    ``M_e = J^-T M_j(q) J^-1`` is linear in them; least squares weighted by the estimates' errors.

    Parameters
    ----------
    estimates : sequence of ImpedanceEstimate
        Of the hand, in postures whose joint angles or whose place is known.
    arm : TwoLinkArm
        Its lengths.

    Raises
    ------
    InputError
        An estimate is not of a hand in a plane, or says neither joint angles nor place.
    """
    if not estimates:
        raise InputError("no estimate of the inertia", expected="one posture or more")
    information, right = np.zeros((3, 3)), np.zeros(3)
    for estimate in estimates:
        rows = _rows(arm, _angles(estimate, arm))
        floor = FLOOR * float(np.abs(estimate.inertia).max())
        C = estimate.covariance[:4, :4] + floor**2 * np.eye(4)
        # M_e (4,) = rows (4, 3) phi (3,)
        weighted = np.linalg.solve(C, rows)
        information += rows.T @ weighted
        right += weighted.T @ estimate.inertia.ravel()
    covariance = np.linalg.inv(information)
    return Known(covariance @ right, (covariance + covariance.T) / 2)


def _rows(arm: TwoLinkArm, q: FloatArray) -> FloatArray:
    """The hand's M row by row as a linear function (4, 3) of the three parameters."""
    A = np.linalg.inv(arm.jacobian(q))
    return np.einsum("ki,klp,lj->ijp", A, inertia_rows(q), A).reshape(4, 3)


def _angles(estimate: ImpedanceEstimate, arm: TwoLinkArm) -> FloatArray:
    if estimate.level != "hand" or estimate.k != 2:
        raise InputError(
            f"an estimate at level {estimate.level} with {estimate.k} axes",
            expected="one of the hand in a plane: RESULTS.csv of `estimate`",
        )
    if estimate.position is not None and estimate.shoulder_m is not None:
        return arm.joint_angles(estimate.position - estimate.shoulder_m)
    if estimate.joint_angles is not None:
        return np.asarray(estimate.joint_angles)
    raise InputError(
        "an estimate of the inertia without its posture",
        expected="joint angles, or the places of hand and shoulder",
    )
