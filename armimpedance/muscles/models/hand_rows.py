"""Stiffness of the hand as rows that a muscle model is fitted to: joints that nobody held.

A hand of d axes on n joints has d (d + 1) / 2 elements, the joints n (n + 1) / 2: of three axes and
four joints 6 of 10. No posture tells its own joint stiffness. Muscles that are the same at all
postures do, as far as their lengths are known, so that rows of many postures are fitted together.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray, FrozenRecord, IntArray
from armimpedance.core.errors import InputError
from armimpedance.limb.arm import Arm
from armimpedance.muscles.models.packed import congruence, elements, triple, triple_sd
from armimpedance.muscles.models.rows import muscle_columns


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
        """Of no element: a hand with free joints has no viscosity of its own."""
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
        """What the rows' common causes make wrong in packed K, (s, P, E); of the viscosity none."""
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
