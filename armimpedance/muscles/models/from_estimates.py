"""Joint-level estimates as the rows that muscle models are fitted to."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import group_name
from armimpedance.core.errors import InputError
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.muscles.models.rows import JointRows


def joint_rows(estimates: Sequence[ImpedanceEstimate]) -> JointRows:
    """K and B of the joints with their standard errors, one row per estimate.

    Standard errors are the roots of the covariance's diagonal. They, the activations (with their
    standard errors) and the torque are taken where all estimates have them.

    Parameters
    ----------
    estimates : sequence of ImpedanceEstimate
        Estimates of two joints or more, the same number in all, with joint angles
        (`hand.levels.to_joint`); in space four angles, and three joints where the elbow was held.

    Returns
    -------
    JointRows

    Raises
    ------
    InputError
        No estimates, one of another level or number of axes, or one without joint angles; names
        its condition.
    """
    if not estimates:
        raise InputError("no estimates", expected="one or more of level joint")
    for estimate in estimates:
        _check(estimate)
    joints = {(estimate.k, len(np.asarray(estimate.joint_angles))) for estimate in estimates}
    if len(joints) > 1:
        (few, _), (many, _) = min(joints), max(joints)
        raise InputError(f"estimates of {few} and of {many} joints in one fit")
    ((measured, angles),) = joints
    _, viscosity_sd, stiffness_sd = np.array([e.sd for e in estimates]).swapaxes(0, 1)
    return JointRows(
        joint_angles=np.array([e.joint_angles for e in estimates]),
        stiffness=np.array([e.stiffness for e in estimates]),
        viscosity=np.array([e.viscosity for e in estimates]),
        stiffness_sd=_where_known(stiffness_sd),
        viscosity_sd=_where_known(viscosity_sd),
        activation=where_all(estimates, "activation"),
        activation_sd=where_all(estimates, "activation_sd"),
        torque=where_all(estimates, "torque"),
        labels=tuple(group_name(e.keys) for e in estimates),
        muscles=muscles_of(estimates),
        moving=JointRows.moving_of(angles, measured) or (),
        doubts=JointRows.doubts_in(warning for e in estimates for warning in e.warnings),
        **JointRows.shared_of([e.shared_errors for e in estimates], measured),
    )


def muscles_of(estimates: Sequence[ImpedanceEstimate]) -> tuple[str, ...]:
    """Names of the muscles whose activations all estimates have.

    Raises
    ------
    InputError
        They have those of different ones.
    """
    named = {estimate.muscles for estimate in estimates}
    if len(named) > 1:
        raise InputError("estimates of different muscles in one fit", expected="the same muscles")
    return named.pop()


def _check(estimate: ImpedanceEstimate) -> None:
    name = group_name(estimate.keys)
    if estimate.level != "joint":
        raise InputError(
            f"{name}: an estimate at the {estimate.level} level",
            expected="level joint (map hand to joint first)",
        )
    if estimate.k < 2:
        raise InputError(f"{name}: {estimate.k} joints", expected="shoulder and elbow, or more")
    angles = () if estimate.joint_angles is None else estimate.joint_angles
    if JointRows.moving_of(len(angles), estimate.k) is None:
        raise InputError(f"{name}: no joint angles", expected=f"{estimate.k}, such as the elbow's")


def _where_known(sd: FloatArray) -> FloatArray | None:
    """Standard errors (P, n, n); None where one is zero, which says that nobody knows it."""
    return sd if (sd > 0).all() else None


def where_all(estimates: Sequence[ImpedanceEstimate], field: str) -> FloatArray | None:
    """What every estimate has, (P, .); None where one lacks it.

    Raises
    ------
    InputError
        Vectors of different lengths.
    """
    values = [getattr(estimate, field) for estimate in estimates]
    if any(value is None for value in values):
        return None
    lengths = {len(value) for value in values}
    if len(lengths) > 1:
        raise InputError(f"{field} of {min(lengths)} and of {max(lengths)} values in one fit")
    return np.array(values)
