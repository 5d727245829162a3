"""The arm in space: three hinges in the shoulder, one in the elbow, and three more of a free wrist.

Frame of a right arm: origin at the shoulder, x to the subject's right, y forward, z up. At zero
angles the arm hangs, the palm to the left. The hinges turn about the vertical (positive to the
left), then forward and up (elevation), then about the upper arm's own axis (axial); the elbow bends
forward. With the wrist locked these four are all. With a free one the forearm pronates, the hand
deviates to the thumb's side, and then it flexes. The swivel is the turn of the elbow about the line
from shoulder to hand: zero with the elbow lowest, positive where it moves to the right.
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

#: The joints of a locked wrist, and those that move where the upper arm is kept from turning about
#: its own axis.
FREE: Final = (0, 1, 2, 3)
HELD: Final = (0, 1, 3)
#: The joint that turns the upper arm about its own axis, and those of the wrist.
_AXIAL: Final = 2
_WRIST: Final = (4, 5, 6)
#: Sine of an angle below which the directions that it separates count as one.
_SMALLEST_SINE: Final = 1e-3


@dataclass(frozen=True)
class SpatialArm:
    """An arm in space with the lengths, masses and inertias of a planar one.

    Attributes
    ----------
    links : TwoLinkArm
        Lengths, masses, centres, moments of inertia across the long axes; forearm and hand are one.
    gravity_m_s2 : (x, y, z) or None
        None: not known.
    hand : Rod, optional
        What moves beyond a free wrist, a part of the second link. Without it the wrist is locked.
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
        """Upper arm and forearm with hand; with a free wrist upper arm, forearm and hand."""
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
        """Hand from the shoulder, m, (3,), at all angles (n,)."""
        return self._places(q).ends[-1]

    def jacobian(self, q: ArrayLike) -> FloatArray:
        """``J = dp/dq`` of all joints, (3, n)."""
        now = self._places(q)
        return first_derivative(now, now.ends[-1])

    def jacobian_derivative(self, q: ArrayLike) -> FloatArray:
        """``[k, i, j] = d2 p_k / dq_i dq_j``, (3, n, n)."""
        now = self._places(q)
        return second_derivative(now.axes, first_derivative(now, now.ends[-1]))

    def gravity_gradient(self, q: ArrayLike) -> FloatArray:
        """``[i, j] = dg_i / dq_j``, N m/rad, (n, n); zero where gravity is not known."""
        if self.gravity_m_s2 is None:
            return np.zeros((self.joints, self.joints))
        return self._weight(self._places(q))[1]

    def _places(self, q: ArrayLike) -> Places:
        """Where everything is at these angles."""
        return places(self.rods, _checked(q, self.joints))

    def _weight(self, now: Places) -> tuple[FloatArray, FloatArray]:
        """The weight's torque (n,) and its gradient (n, n)."""
        n, gravity = self.joints, np.array(self.gravity_m_s2)
        weight, gradient = np.zeros(n), np.zeros((n, n))
        for rod, centre, last in zip(self.rods, now.centres, MOVED_BY[n], strict=True):
            Jc = first_derivative(now, centre, last)
            # V = -m gravity . c: g (n,) = -m J_c^T gravity, dg/dq (n, n) = -m gravity . d2c
            weight -= rod.kg * Jc.T @ gravity
            gradient -= rod.kg * np.einsum("k,kij->ij", gravity, second_derivative(now.axes, Jc))
        return weight, gradient

    def joint_angles(self, hand: ArrayLike, swivel_rad: float) -> FloatArray:
        """The four angles of a hand's place (3,) and a swivel.

        Raises
        ------
        InputError
            The hand is out of reach, straight above or below the shoulder, or not in space; or the
            wrist is free.
        NotIdentifiableError
            The upper arm is vertical: turn and axial angle are then one.
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
        """Everything at one posture, of the joints that move.

        Parameters
        ----------
        q : (n,)
            All angles, rad.
        moving : tuple of int, optional
            `HELD` where the upper arm is kept from turning about its own axis; default: all.

        Returns
        -------
        ArmPosture
            n joints, in the order of `moving`; weight and its gradient where gravity is known.

        Raises
        ------
        InputError
            Not as many finite angles as joints.
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
        """Joint-space inertia M(q), (n, n): links round about their long axes."""
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
    """The joints of an arm in space that move: without the axial one where the elbow is held.

    Parameters
    ----------
    joints : int
        4, or 7 with a free wrist.
    elbow : {"held", "free"}
    wrist : {"locked", "free"}, optional
        Seven angles may be known of a wrist that is locked.

    Returns
    -------
    tuple of int

    Examples
    --------
    >>> from armimpedance.limb.arm import joints_that_move
    >>> joints_that_move(7, "held")
    (0, 1, 3, 4, 5, 6)
    """
    kept = {_AXIAL} if elbow == "held" else set()
    kept |= set(_WRIST) if wrist == "locked" else set()
    return tuple(j for j in range(joints) if j not in kept)


def _checked(q: ArrayLike, joints: int) -> FloatArray:
    angles = np.asarray(q, dtype=float)
    if angles.shape != (joints,) or not np.isfinite(angles).all():
        raise InputError(
            f"joint angles of shape {angles.shape}",
            expected=f"{joints} finite ones of an arm in space",
        )
    return angles


def _angles(u: FloatArray, v: FloatArray) -> FloatArray:
    """The four angles of an upper arm along u and a forearm along v, the elbow bent forward."""
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
