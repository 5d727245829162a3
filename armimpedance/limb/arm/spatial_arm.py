"""The arm in space: three hinges in the shoulder, one in the elbow, and three in a free wrist.

Frame of a right arm: origin at the shoulder, x to the subject's right, y forward, z up. At zero
angles the arm hangs, the palm to the left. The hinges turn about the vertical (positive to the
left), then forward and up (elevation), then about the upper arm's own axis (axial); the elbow bends
forward. A locked wrist leaves these four hinges. With a free wrist the forearm pronates, the hand
deviates to the thumb's side, and then flexes. The swivel is the turn of the elbow about the line
from shoulder to hand: zero with the elbow lowest, positive if it moves to the right.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError, NotIdentifiableError
from armimpedance.core.records import ArmPosture
from armimpedance.limb.arm.anthropometry import DE_LEVA
from armimpedance.limb.arm.rods import (
    FREE_WRIST,
    LOCKED_WRIST,
    MOVED_BY,
    Places,
    Rod,
    first_derivative,
    parted,
    places,
    second_derivative,
)
from armimpedance.limb.arm.two_link import TwoLinkArm

#: Joints that move with a locked wrist, and those that move if the upper arm is also prevented from
#: turning about its own axis.
FREE: Final = (0, 1, 2, 3)
HELD: Final = (0, 1, 3)
#: The joint that turns the upper arm about its own axis, and those of the wrist.
_AXIAL: Final = 2
_WRIST: Final = (4, 5, 6)
#: Sine of an angle below which two directions count as parallel.
_SMALLEST_SINE: Final = 1e-3


@dataclass(frozen=True)
class SpatialArm:
    """An arm in space with the lengths, masses and inertias of a planar one.

    Attributes
    ----------
    links : TwoLinkArm
        Lengths, masses, centres, moments of inertia across the long axes; forearm and hand are one.
    gravity_m_s2 : (x, y, z) or None
        Gravity in the arm's frame; None: not known.
    hand : Rod, optional
        The part of the second link beyond a free wrist. Without it the wrist is locked.
    """

    links: TwoLinkArm
    gravity_m_s2: tuple[float, float, float] | None = None
    hand: Rod | None = None

    axes = 3

    @property
    def joints(self) -> int:
        """Number n of joints: 4, or 7 with a free wrist."""
        return LOCKED_WRIST if self.hand is None else FREE_WRIST

    @cached_property
    def rods(self) -> tuple[Rod, ...]:
        """Rods: upper arm and forearm with hand; with a free wrist upper arm, forearm and hand."""
        links, ratios = self.links, DE_LEVA["male"]
        long = (ratios.upper_arm.gyration_long or 0.0, ratios.forearm.gyration_long or 0.0)
        upper = Rod(
            links.upper_arm_m,
            links.upper_arm_kg,
            links.upper_arm_com_m,
            links.upper_arm_inertia_kgm2,
            links.upper_arm_kg * (long[0] * links.upper_arm_m) ** 2,
        )
        lower = Rod(
            links.forearm_hand_m,
            links.forearm_hand_kg,
            links.forearm_hand_com_m,
            links.forearm_hand_inertia_kgm2,
            links.forearm_hand_kg * (long[1] * links.forearm_hand_m) ** 2,
        )
        return (upper, lower) if self.hand is None else (upper, *parted(lower, self.hand))

    def hand_position(self, q: ArrayLike) -> FloatArray:
        """Position of the hand from the shoulder, m, (3,), at angles (n,)."""
        return self._places(q).ends[-1]

    def jacobian(self, q: ArrayLike) -> FloatArray:
        """Jacobian ``J = dp/dq`` of all joints, (3, n)."""
        now = self._places(q)
        return first_derivative(now, now.ends[-1])

    def jacobian_derivative(self, q: ArrayLike) -> FloatArray:
        """Second derivatives ``[k, i, j] = d2 p_k / dq_i dq_j``, (3, n, n)."""
        now = self._places(q)
        return second_derivative(now.axes, first_derivative(now, now.ends[-1]))

    def gravity_gradient(self, q: ArrayLike) -> FloatArray:
        """Gradient of the gravity torque, N m/rad, (n, n): ``dg_i / dq_j``; 0 without gravity."""
        if self.gravity_m_s2 is None:
            return np.zeros((self.joints, self.joints))
        return self._weight(self._places(q))[1]

    def _places(self, q: ArrayLike) -> Places:
        """Positions of hinges and rods at angles `q` (n,)."""
        return places(self.rods, _checked(q, self.joints))

    def _weight(self, now: Places) -> tuple[FloatArray, FloatArray]:
        """Gravity torque (n,) and its gradient (n, n)."""
        n, gravity = self.joints, np.array(self.gravity_m_s2)
        weight, gradient = np.zeros(n), np.zeros((n, n))
        for rod, centre, last in zip(self.rods, now.centres, MOVED_BY[n], strict=True):
            Jc = first_derivative(now, centre, last)
            # V = -m gravity . c: g (n,) = -m J_c^T gravity, dg/dq (n, n) = -m gravity . d2c
            weight -= rod.kg * Jc.T @ gravity
            gradient -= rod.kg * np.einsum("k,kij->ij", gravity, second_derivative(now.axes, Jc))
        return weight, gradient

    def joint_angles(self, hand: ArrayLike, swivel_rad: float) -> FloatArray:
        """Inverse kinematics: the four angles for a hand position (3,) and a swivel.

        Raises
        ------
        InputError
            The hand is out of reach, straight above or below the shoulder, or not in space; or the
            wrist is free.
        NotIdentifiableError
            The upper arm is vertical: turn and axial angle are then the same rotation.
        """
        if self.hand is not None:
            raise InputError("an arm with a free wrist", expected="its seven angles measured")
        p = np.asarray(hand, dtype=float)
        l1, l2 = self.links.upper_arm_m, self.links.forearm_hand_m
        r = float(np.linalg.norm(p))
        if p.shape != (3,) or not abs(l1 - l2) < r < l1 + l2:
            raise InputError(
                f"hand at {np.round(p, 3).tolist()} m from the shoulder",
                expected=f"three values, and a distance of {abs(l1 - l2):.3g} to {l1 + l2:.3g} m",
            )
        n = p / r
        down = np.array([0.0, 0.0, -1.0]) + n[2] * n
        if np.linalg.norm(down) < _SMALLEST_SINE:
            raise InputError("hand straight above or below the shoulder: it has no swivel")
        down /= np.linalg.norm(down)
        # the elbow lies on a circle about the line from shoulder to hand
        along = (r**2 + l1**2 - l2**2) / (2 * r)
        out = np.cos(swivel_rad) * down + np.sin(swivel_rad) * np.cross(down, n)
        elbow = along * n + np.sqrt(l1**2 - along**2) * out
        return _angles(-elbow / l1, (elbow - p) / l2)

    def posture(self, q: ArrayLike, moving: tuple[int, ...] | None = None) -> ArmPosture:
        """All quantities of the arm at one posture, for the joints that move.

        Parameters
        ----------
        q : (n,)
            All angles, rad.
        moving : tuple of int, optional
            `HELD` if the upper arm is prevented from turning about its own axis; default: all.

        Returns
        -------
        ArmPosture
            n joints, in the order of `moving`; gravity torque and gradient if gravity is known.

        Raises
        ------
        InputError
            The number of finite angles is not that of the joints.
        """
        now, r = self._places(q), list(range(self.joints) if moving is None else moving)
        J = first_derivative(now, now.ends[-1])
        weight = gradient = None
        if self.gravity_m_s2 is not None:
            weight, gradient = self._weight(now)
            weight, gradient = weight[r], gradient[np.ix_(r, r)]
        return ArmPosture(
            joint_angles=np.asarray(q, dtype=float)[r],
            hand_position=now.ends[-1],
            jacobian=J[:, r],
            jacobian_derivative=second_derivative(now.axes, J)[:, r][:, :, r],
            inertia=self._inertia(now)[np.ix_(r, r)],
            gravity_torque=weight,
            gravity_gradient=gradient,
        )

    def _inertia(self, now: Places) -> FloatArray:
        """Joint-space inertia M(q), (n, n), for links symmetric about their long axes."""
        n = self.joints
        M = np.zeros((n, n))
        parts = zip(self.rods, now.long, now.centres, MOVED_BY[n], strict=True)
        for rod, up, centre, last in parts:
            Jc = first_derivative(now, centre, last)
            Jw = np.where(np.arange(n) < last, now.axes, 0.0)
            about = up @ Jw
            # M (n, n) += m J_c^T J_c + J_w^T (across I + (along - across) l l^T) J_w
            M += rod.kg * Jc.T @ Jc + rod.across_kgm2 * Jw.T @ Jw
            M += (rod.along_kgm2 - rod.across_kgm2) * np.outer(about, about)
        return M


def joints_that_move(joints: int, elbow: str, wrist: str | None = None) -> tuple[int, ...]:
    """Joints of an arm in space that move: without the axial joint if the elbow is held.

    Parameters
    ----------
    joints : int
        4, or 7 with a free wrist.
    elbow : {"held", "free"}
    wrist : {"locked", "free"}, optional
        A locked wrist may also have seven measured angles.

    Returns
    -------
    tuple of int

    Examples
    --------
    >>> from armimpedance.limb.arm import joints_that_move
    >>> joints_that_move(7, "held")
    (0, 1, 3, 4, 5, 6)
    """
    locked = {_AXIAL} if elbow == "held" else set()
    locked |= set(_WRIST) if wrist == "locked" else set()
    return tuple(j for j in range(joints) if j not in locked)


def _checked(q: ArrayLike, joints: int) -> FloatArray:
    angles = np.asarray(q, dtype=float)
    if angles.shape != (joints,) or not np.isfinite(angles).all():
        raise InputError(
            f"joint angles of shape {angles.shape}",
            expected=f"{joints} finite ones of an arm in space",
        )
    return angles


def _angles(u: FloatArray, v: FloatArray) -> FloatArray:
    """Four angles of an upper arm along u and a forearm along v, with the elbow bent forward."""
    s2 = float(np.hypot(u[0], u[1]))
    c4 = float(u @ v)
    s4 = float(np.linalg.norm(np.cross(u, v)))
    if s2 < _SMALLEST_SINE or s4 < _SMALLEST_SINE:
        raise NotIdentifiableError(
            "singular posture: the upper arm is vertical, or the elbow straight"
        )
    q1, q2 = np.arctan2(u[0], -u[1]), np.arctan2(s2, u[2])
    x = np.array([np.cos(q1), np.sin(q1), 0.0])
    y = np.cross(u, x)
    front = (c4 * u - v) / s4
    return np.array([q1, q2, np.arctan2(-front @ x, front @ y), np.arctan2(s4, c4)])
