"""Joint-level estimates as the rows that muscle models are fitted to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, cast

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray, FrozenRecord, IntArray
from armimpedance.core.conventions import group_name
from armimpedance.core.errors import InputError
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.limb.arm import Arm, SpatialArm
from armimpedance.muscles.models.packed import congruence, elements, triple, triple_sd
from armimpedance.muscles.models.rows import JointRows, muscle_columns, shared_blocks


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

    Raises InputError: they have those of different ones.
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
    """A field of all estimates, (P, .); None if one of them lacks it.

    Raises InputError: vectors of different lengths.
    """
    values = [getattr(estimate, field) for estimate in estimates]
    if any(value is None for value in values):
        return None
    lengths = {len(value) for value in values}
    if len(lengths) > 1:
        raise InputError(f"{field} of {min(lengths)} and of {max(lengths)} values in one fit")
    return np.array(values)


# Stiffness of the hand as rows that a muscle model is fitted to: joints that nobody held.
#
# A hand of d axes on n joints has d (d + 1) / 2 elements, the joints n (n + 1) / 2: of three axes
# and four joints 6 of 10. No posture tells its own joint stiffness. Muscles that are the same at
# all postures do, as far as their lengths are known, so that rows of many postures are fitted
# together.


@dataclass(frozen=True)
class HandRows(FrozenRecord):
    """P conditions of a hand with d axes whose n >= d joints are all free.

    Attributes
    ----------
    joint_angles : (P, n)
        rad.
    jacobian : (P, d, n)
    added : (P, n, n)
        ``Gamma(F) + dg/dq``: what hand force and weight add to the muscles' joint stiffness.
    stiffness, stiffness_sd : (P, d, d)
        Of the hand at rest, N/m, with the standard errors of its elements.
    activation, activation_sd : (P, m)
        Activation of each muscle, 0..1; the standard error may be None.
    torque : (P, n) or None
        Joint torque that the muscles bear, N m.
    labels : (P,) tuple of str
    muscles : (m,) tuple of str
        Names of the muscles of `activation`; empty where they are not known.
    stiffness_shared : (P, s, d, d) or None
    doubts : tuple of str
        As of `JointRows`.
    """

    joint_angles: Annotated[FloatArray, "p n"]
    jacobian: Annotated[FloatArray, "p d n"]
    added: Annotated[FloatArray, "p n n"]
    stiffness: Annotated[FloatArray, "p d d"]
    stiffness_sd: Annotated[FloatArray, "p d d"]
    activation: Annotated[FloatArray, "p m"]
    activation_sd: Annotated[FloatArray, "p m"] | None = None
    torque: Annotated[FloatArray, "p n"] | None = None
    labels: tuple[str, ...] = ()
    muscles: tuple[str, ...] = ()
    stiffness_shared: Annotated[FloatArray, "p s d d"] | None = None
    doubts: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        if not (self.stiffness_sd > 0).all():
            raise InputError("a stiffness_sd that is not positive", expected="more than 0 N/m")
        if not ((self.activation >= 0) & (self.activation <= 1)).all():
            raise InputError("an activation outside of 0 to 1", expected="1 is the maximum")

    @classmethod
    def of(
        cls, arm: Arm, joint_angles: ArrayLike, *, force: ArrayLike | None = None, **measured: Any
    ) -> HandRows:
        """Rows of an arm at postures (P, n), under hand forces (P, d), N.

        Parameters
        ----------
        arm : Arm
        joint_angles : (P, n)
        force : (P, d), optional
            By the hand on its environment; none: no force.
        **measured
            The other fields.
        """
        q = np.asarray(joint_angles, dtype=float)
        F = np.zeros((len(q), arm.axes)) if force is None else np.asarray(force, dtype=float)
        gamma = [np.tensordot(f, arm.jacobian_derivative(x), 1) for x, f in zip(q, F, strict=True)]
        return cls(
            joint_angles=q,
            jacobian=np.array([arm.jacobian(x) for x in q]),
            added=np.array(gamma) + np.array([arm.gravity_gradient(x) for x in q]),
            **measured,
        )

    @property
    def joints(self) -> int:
        """Number of joints n."""
        return self.joint_angles.shape[1]

    @property
    def moving(self) -> tuple[int, ...]:
        """All joints."""
        return tuple(range(self.joints))

    @property
    def kept(self) -> IntArray:
        """All elements of the joints."""
        return np.arange(len(elements(self.joints)[0]))

    @property
    def viscosity_sd(self) -> FloatArray:
        """No element (P, 0): a hand with free joints has no viscosity of its own."""
        return np.empty((len(self.joint_angles), 0))

    def require_planar(self) -> None:
        """Refuse: what is fitted to joint stiffness cannot be fitted to a hand's.

        Raises
        ------
        InputError
        """
        raise InputError("rows of a hand with free joints", expected="JointRows, or `fit_muscles`")

    def elements(self, symbol: str) -> tuple[FloatArray, FloatArray]:
        """Packed stiffness (P, E) and its errors; of the viscosity none, (P, 0)."""
        if symbol == "B":
            return self.viscosity_sd, self.viscosity_sd
        return triple(self.stiffness), triple_sd(self.stiffness, self.stiffness_sd)

    def shared(self, symbol: str) -> FloatArray:
        """Errors of packed K by causes that rows share, (s, P, E); empty for the viscosity."""
        if symbol == "B" or self.stiffness_shared is None:
            return np.zeros((0, *self.elements(symbol)[0].shape))
        return triple(self.stiffness_shared.swapaxes(0, 1))

    def of_muscles(self, names: tuple[str, ...]) -> HandRows:
        """The same rows with the activations of these muscles, in this order.

        Raises
        ------
        InputError
            A muscle whose activation was not measured.
        """
        if not self.muscles or self.muscles == tuple(names):
            return self
        columns, sd = muscle_columns(self.muscles, names), self.activation_sd
        return replace(
            self,
            activation=self.activation[:, columns],
            activation_sd=None if sd is None else sd[:, columns],
            muscles=tuple(names),
        )

    def seen(self, joint_stiffness: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Packed stiffness (P, E_d) of the hand on joints (P, E_n), and its derivative by them.

        ``K_e = V^T (K + added) V`` with ``V = K^-1 J^T (J K^-1 J^T)^-1``, the joints' motion under
        a unit of the hand's; ``dK_e = V^T dK V``.
        """
        n, J = self.joints, self.jacobian
        i, j = elements(n)
        whole = joint_stiffness + triple(self.added)
        K = np.empty((len(whole), n, n))
        K[:, i, j] = K[:, j, i] = whole
        yielding = np.linalg.solve(K, J.swapaxes(1, 2))
        to_hand = congruence(yielding @ np.linalg.inv(J @ yielding))
        return np.einsum("pab,pb->pa", to_hand, whole), to_hand


# Estimates of a hand in space whose elbow is free, as rows that a muscle model is fitted to.


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
        _check_hand(estimate, arm)
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


def _check_hand(estimate: ImpedanceEstimate, arm: SpatialArm) -> None:
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
