"""The planar two-link arm in closed form, and its dynamics at the hand.

Angles are counter-clockwise from +x, the elbow's relative to the upper arm. Let X be the vector
from the shoulder to the hand, and u2 that from the elbow to the hand. Every derivative of the
hand's position is one of these two vectors, turned by 90 degrees per derivative.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError, NotIdentifiableError, check_number
from armimpedance.core.records import ArmPosture

#: Tolerance of the reach for rounding, relative to the reach.
_REACH_ROUNDING = 1e-9


def _direction(angle: FloatArray) -> FloatArray:
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def _quarter_turn(vector: FloatArray) -> FloatArray:
    return np.stack([-vector[..., 1], vector[..., 0]], axis=-1)


def _wrapped(angle: FloatArray) -> FloatArray:
    return np.pi - np.mod(np.pi - angle, 2 * np.pi)


@dataclass(frozen=True)
class TwoLinkArm:
    """Upper arm and forearm with hand, moving in a plane.

    Parameters
    ----------
    upper_arm_m, forearm_hand_m : float
        Lengths from shoulder to elbow and from elbow to hand (l1 and l2 of Tsuji 1997, eq. (32);
        the sentence below that equation swaps their names).
    upper_arm_kg, forearm_hand_kg : float
    upper_arm_com_m, forearm_hand_com_m : float
        Centre of mass from the proximal joint, on the link's axis.
    upper_arm_inertia_kgm2, forearm_hand_inertia_kgm2 : float
        Moments of inertia about each link's centre of mass, axis normal to the plane.
    gravity_m_s2 : (float, float)
        In-plane gravity; zero for a horizontal plane.

    Raises
    ------
    InputError
        A length, mass or inertia is not a positive finite number.
    """

    upper_arm_m: float
    forearm_hand_m: float
    upper_arm_kg: float
    forearm_hand_kg: float
    upper_arm_com_m: float
    forearm_hand_com_m: float
    upper_arm_inertia_kgm2: float
    forearm_hand_inertia_kgm2: float
    gravity_m_s2: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            if item.name != "gravity_m_s2":
                check_number(value, f"two-link arm: {item.name} is {value}", above=0)
        if np.shape(self.gravity_m_s2) != (2,) or not np.isfinite(self.gravity_m_s2).all():
            raise InputError(f"two-link arm: gravity {self.gravity_m_s2}", expected="two numbers")

    @property
    def joints(self) -> int:
        """Number of joints."""
        return 2

    @property
    def axes(self) -> int:
        """Number of hand axes."""
        return 2

    def elbow_position(self, q: ArrayLike) -> FloatArray:
        """Position of the elbow from the shoulder, m, (..., 2)."""
        return self.upper_arm_m * _direction(_angles(q)[..., 0])

    def _forearm(self, q: ArrayLike) -> FloatArray:
        """Position of the hand from the elbow, m, (..., 2)."""
        return self.forearm_hand_m * _direction(_angles(q).sum(axis=-1))

    def hand_position(self, q: ArrayLike) -> FloatArray:
        """Position of the hand from the shoulder, m, (..., 2)."""
        return self.elbow_position(q) + self._forearm(q)

    def jacobian(self, q: ArrayLike) -> FloatArray:
        """Jacobian ``J = dp/dq``, (..., 2, 2), m/rad; Tsuji (1997), eq. (32)."""
        columns = [_quarter_turn(self.hand_position(q)), _quarter_turn(self._forearm(q))]
        return np.stack(columns, axis=-1)

    def jacobian_derivative(self, q: ArrayLike) -> FloatArray:
        """Second derivatives ``[k, i, j] = d2 p_k / dq_i dq_j``, (..., 2, 2, 2), m/rad^2."""
        X, u2 = self.hand_position(q), self._forearm(q)
        # d2p/dq1^2 = -X (2,); every derivative that involves the elbow is -u2 (2,)
        rows = [np.stack([-X, -u2], axis=-1), np.stack([-u2, -u2], axis=-1)]
        return np.stack(rows, axis=-2)

    def jacobian_rate(self, q: ArrayLike, qd: ArrayLike) -> FloatArray:
        """Rate of the Jacobian ``dJ/dt`` at joint velocity `qd` (rad/s), (..., 2, 2)."""
        # Jdot (d, n) = sum_j d2p/dq_i dq_j (d, n, n) qd_j (n,)
        return np.einsum("...kij,...j->...ki", self.jacobian_derivative(q), _angles(qd))

    def inertia(self, q: ArrayLike) -> FloatArray:
        """Joint-space inertia M(q), kg m^2, (..., 2, 2); M of Tsuji (1997), eq. (14)."""
        cosine = np.cos(_angles(q)[..., 1])
        coupling = self._coupling * cosine
        elbow = self.forearm_hand_inertia_kgm2 + self.forearm_hand_kg * self.forearm_hand_com_m**2
        upper = self.upper_arm_inertia_kgm2 + self.upper_arm_kg * self.upper_arm_com_m**2
        shoulder = upper + elbow + self.forearm_hand_kg * self.upper_arm_m**2
        M = np.empty((*cosine.shape, 2, 2))
        M[..., 0, 0] = shoulder + 2 * coupling
        M[..., 0, 1] = M[..., 1, 0] = elbow + coupling
        M[..., 1, 1] = elbow
        return M

    def bias(self, q: ArrayLike, qd: ArrayLike) -> FloatArray:
        """Coriolis and centrifugal torque h(q, qd), N m, (..., 2); h of Tsuji (1997), eq. (14)."""
        slope = self._coupling * np.sin(_angles(q)[..., 1])
        shoulder, elbow = np.moveaxis(_angles(qd), -1, 0)
        return np.stack([-slope * elbow * (2 * shoulder + elbow), slope * shoulder**2], axis=-1)

    def gravity(self, q: ArrayLike) -> FloatArray:
        """Gravity torque g(q) of the in-plane `gravity_m_s2`, N m, (..., 2)."""
        total, lower = self._mass_moments(q)
        # g = -d/dq sum_i m_i gravity . p_i, and dp/dq is a quarter turn of the mass moment
        moments = np.stack([_quarter_turn(total), _quarter_turn(lower)], axis=-2)
        return -moments @ np.asarray(self.gravity_m_s2, dtype=float)

    def gravity_gradient(self, q: ArrayLike) -> FloatArray:
        """Gradient of the gravity torque, ``[i, j] = dg_i / dq_j``, N m/rad, (..., 2, 2)."""
        total, lower = self._mass_moments(q)
        # two quarter turns reverse a mass moment; by the elbow only the forearm's counts
        rows = [np.stack([total, lower], axis=-2), np.stack([lower, lower], axis=-2)]
        return np.stack(rows, axis=-3) @ np.asarray(self.gravity_m_s2, dtype=float)

    def joint_angles(self, position: ArrayLike) -> FloatArray:
        """Inverse kinematics: hand (..., 2) m -> joint angles (..., 2) rad, elbow in [0, pi].

        Raises
        ------
        InputError
            A hand position is out of reach.
        """
        X = _angles(position)
        l1, l2 = self.upper_arm_m, self.forearm_hand_m
        distance = np.hypot(X[..., 0], X[..., 1])
        slack = _REACH_ROUNDING * (l1 + l2)
        outside = (distance > l1 + l2 + slack) | (distance < abs(l1 - l2) - slack)
        if np.any(outside):
            reach = f"{abs(l1 - l2):.3f} to {l1 + l2:.3f} m from the shoulder"
            first = distance[outside].flat[0]
            raise InputError(f"hand out of reach: {first:.3f} m from the shoulder", expected=reach)
        cosine = np.clip((distance**2 - l1**2 - l2**2) / (2 * l1 * l2), -1, 1)
        sine = np.sqrt(1 - cosine**2)
        shoulder = np.arctan2(X[..., 1], X[..., 0]) - np.arctan2(l2 * sine, l1 + l2 * cosine)
        return np.stack([_wrapped(shoulder), np.arctan2(sine, cosine)], axis=-1)

    def posture(self, q: ArrayLike) -> ArmPosture:
        """All quantities of the arm at one posture, `q` (2,) rad."""
        q = _angles(q)
        return ArmPosture(
            joint_angles=q,
            hand_position=self.hand_position(q),
            jacobian=self.jacobian(q),
            jacobian_derivative=self.jacobian_derivative(q),
            inertia=self.inertia(q),
            gravity_torque=self.gravity(q),
            gravity_gradient=self.gravity_gradient(q),
        )

    def _mass_moments(self, q: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Mass moments ``sum m p`` of both links and of the forearm about their proximal joints."""
        lower = self.forearm_hand_kg * self.forearm_hand_com_m / self.forearm_hand_m
        forearm = lower * self._forearm(q)
        upper = self.upper_arm_kg * self.upper_arm_com_m / self.upper_arm_m + self.forearm_hand_kg
        return upper * self.elbow_position(q) + forearm, forearm

    @property
    def _coupling(self) -> float:
        """Term of M that varies with the elbow angle, ``m2 l1 r2`` (kg m^2)."""
        return self.forearm_hand_kg * self.upper_arm_m * self.forearm_hand_com_m


def _angles(values: ArrayLike) -> FloatArray:
    array = np.asarray(values, dtype=float)
    if array.ndim == 0 or array.shape[-1] != 2:
        raise InputError(
            f"two-link arm: shape {array.shape}", expected="two values on the last axis"
        )
    if not np.isfinite(array).all():
        raise InputError("two-link arm: a value is not finite", expected="finite numbers")
    return array


# Dynamics of the arm at the hand: Tsuji (1997), eqs. (14)-(20).
#
# ``M qdd + h + g = tau`` becomes ``Lambda_e Xdd + h_e + g_e = Jbar^T tau`` for an arm of n >= d
# joints. Every function takes leading batch axes: J (..., d, n), M (..., n, n).

#: Above this condition number of J the hand cannot move along some direction.
SINGULAR_CONDITION = 1e8


def _checked(J: ArrayLike, M: ArrayLike) -> tuple[FloatArray, FloatArray]:
    J, M = np.asarray(J, dtype=float), np.asarray(M, dtype=float)
    if J.ndim < 2 or M.shape[-2:] != (J.shape[-1], J.shape[-1]):
        wanted = "J (..., d, n) and M (..., n, n)"
        raise InputError(
            f"Jacobian of shape {J.shape}, inertia of shape {M.shape}", expected=wanted
        )
    require_full_rank(J)
    return J, M


def require_full_rank(J: FloatArray) -> None:
    """Raise NotIdentifiableError if the hand cannot move along some direction.

    Parameters
    ----------
    J : (..., d, n)
    """
    d, n = J.shape[-2:]
    if n < d:
        raise NotIdentifiableError(f"{n} joints cannot move the hand along {d} axes independently")
    condition = np.linalg.cond(J)
    if not np.all(condition < SINGULAR_CONDITION):
        raise NotIdentifiableError(
            f"singular posture: the hand cannot move along some direction "
            f"(condition of the Jacobian {np.max(condition):.3g})"
        )


def hand_inertia(J: ArrayLike, M: ArrayLike) -> FloatArray:
    """Inertia at the hand ``Lambda_e = (J M^-1 J^T)^-1``, eq. (17), kg, (..., d, d).

    Parameters
    ----------
    J : (..., d, n)
        Jacobian of the hand.
    M : (..., n, n)
        Inertia of the joints, kg m^2.

    Returns
    -------
    (..., d, d)
        Inertia of the hand, kg.

    Raises
    ------
    InputError
        Shapes do not fit.
    NotIdentifiableError
        Singular posture, or fewer joints than hand axes.
    """
    J, M = _checked(J, M)
    # J (d, n) M^-1 (n, n) J^T (n, d)
    mobility = J @ np.linalg.solve(M, np.swapaxes(J, -1, -2))
    return np.linalg.inv(mobility)


def dynamic_inverse(J: ArrayLike, M: ArrayLike) -> FloatArray:
    """Dynamically consistent inverse ``Jbar = M^-1 J^T Lambda_e``, eq. (20): ``J Jbar = I``.

    `J` (..., d, n): Jacobian of the hand.
    `M` (..., n, n): inertia of the joints, kg m^2.
    Returns: (..., n, d).
    Raises InputError: shapes do not fit.
    Raises NotIdentifiableError: singular posture, or fewer joints than hand axes.
    """
    J, M = _checked(J, M)
    # M^-1 (n, n) J^T (n, d) Lambda_e (d, d)
    return np.linalg.solve(M, np.swapaxes(J, -1, -2)) @ hand_inertia(J, M)


def hand_bias(J: ArrayLike, Jdot_qd: ArrayLike, M: ArrayLike, h: ArrayLike) -> FloatArray:
    """Coriolis and centrifugal force at the hand ``h_e = Jbar^T h - Lambda_e Jdot qd``, eq. (18).

    `J` (..., d, n): Jacobian of the hand.
    `Jdot_qd` (..., d): ``dJ/dt qd``, m/s^2.
    `M` (..., n, n): inertia of the joints, kg m^2.
    `h` (..., n): coriolis and centrifugal torque, N m.
    Returns: (..., d): force at the hand, N.
    Raises InputError: shapes do not fit.
    Raises NotIdentifiableError: singular posture, or fewer joints than hand axes.
    """
    return hand_gravity(J, M, h) - np.einsum(
        "...ij,...j->...i", hand_inertia(J, M), np.asarray(Jdot_qd, dtype=float)
    )


def hand_gravity(J: ArrayLike, M: ArrayLike, g: ArrayLike) -> FloatArray:
    """Gravity force at the hand ``g_e = Jbar^T g``, eq. (19).

    `J` (..., d, n): Jacobian of the hand.
    `M` (..., n, n): inertia of the joints, kg m^2.
    `g` (..., n): gravity torque, N m.
    Returns: (..., d): force at the hand, N.
    Raises InputError: shapes do not fit.
    Raises NotIdentifiableError: singular posture, or fewer joints than hand axes.
    """
    return np.einsum("...ji,...j->...i", dynamic_inverse(J, M), np.asarray(g, dtype=float))
