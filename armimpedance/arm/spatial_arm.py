"""The arm in space as two links: three hinges in the shoulder, one in the elbow, the wrist locked.

Frame of a right arm: origin at the shoulder, x to the subject's right, y forward, z up. At zero
angles the arm hangs. The hinges turn about the vertical (positive to the left), then forward and up
(elevation), then about the upper arm's own axis (axial); the elbow bends forward. The swivel is the
turn of the elbow about the line from shoulder to hand: zero with the elbow lowest, positive where
it moves to the right.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.arm.anthropometry import DE_LEVA
from armimpedance.arm.two_link import TwoLinkArm
from armimpedance.arrays import FloatArray
from armimpedance.errors import InputError, NotIdentifiableError
from armimpedance.records import ArmPosture

#: All joints, and those that move where the upper arm is kept from turning about its own axis.
FREE: Final = (0, 1, 2, 3)
HELD: Final = (0, 1, 3)
#: Sine of an angle below which the directions that it separates count as one.
_SMALLEST_SINE: Final = 1e-3


@dataclass(frozen=True)
class SpatialArm:
    """An arm in space with the lengths, masses and inertias of a planar one.

    Attributes
    ----------
    links : TwoLinkArm
        Lengths, masses, centres, moments of inertia across the long axes.
    gravity_m_s2 : (x, y, z) or None
        None: not known.
    """

    links: TwoLinkArm
    gravity_m_s2: tuple[float, float, float] | None = None

    joints, axes = len(FREE), 3

    def hand_position(self, q: ArrayLike) -> FloatArray:
        """Hand from the shoulder, m, (3,), at the four angles."""
        _, u, v = _axes(_checked(q))
        return np.asarray(-self.links.upper_arm_m * u - self.links.forearm_hand_m * v)

    def jacobian(self, q: ArrayLike) -> FloatArray:
        """``J = dp/dq`` of all joints, (3, 4)."""
        A, elbow, hand = self._places(q)
        return _first(A, elbow, hand)

    def jacobian_derivative(self, q: ArrayLike) -> FloatArray:
        """``[k, i, j] = d2 p_k / dq_i dq_j``, (3, 4, 4)."""
        A, elbow, hand = self._places(q)
        return _second(A, _first(A, elbow, hand))

    def gravity_gradient(self, q: ArrayLike) -> FloatArray:
        """``[i, j] = dg_i / dq_j``, N m/rad, (4, 4); zero where gravity is not known."""
        if self.gravity_m_s2 is None:
            return np.zeros((4, 4))
        A, u, v = _axes(_checked(q))
        return self._weight(A, self._parts(u, v), -self.links.upper_arm_m * u)[1]

    def _places(self, q: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The hinges' axes (3, 4), the elbow's and the hand's place (3,)."""
        A, u, v = _axes(_checked(q))
        elbow = -self.links.upper_arm_m * u
        return A, elbow, elbow - self.links.forearm_hand_m * v

    def _parts(self, u: FloatArray, v: FloatArray) -> tuple[tuple[float, FloatArray], ...]:
        """Mass and centre (3,) of both links."""
        links, elbow = self.links, -self.links.upper_arm_m * u
        return (
            (links.upper_arm_kg, -links.upper_arm_com_m * u),
            (links.forearm_hand_kg, elbow - links.forearm_hand_com_m * v),
        )

    def _weight(
        self, A: FloatArray, parts: tuple[tuple[float, FloatArray], ...], elbow: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """The weight's torque (4,) and its gradient (4, 4)."""
        gravity, weight, gradient = np.array(self.gravity_m_s2), np.zeros(4), np.zeros((4, 4))
        for (kg, centre), last in zip(parts, (3, 4), strict=True):
            Jc = _first(A, elbow, centre, last)
            # V = -m gravity . c: g (n,) = -m J_c^T gravity, dg/dq (n, n) = -m gravity . d2c
            weight -= kg * Jc.T @ gravity
            gradient -= kg * np.einsum("k,kij->ij", gravity, _second(A, Jc))
        return weight, gradient

    def joint_angles(self, hand: ArrayLike, swivel_rad: float) -> FloatArray:
        """The four angles of a hand's place (3,) and a swivel.

        Raises
        ------
        InputError
            The hand is out of reach, straight above or below the shoulder, or not in space.
        NotIdentifiableError
            The upper arm is vertical: turn and axial angle are then one.
        """
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

    def posture(self, q: ArrayLike, moving: tuple[int, ...] = FREE) -> ArmPosture:
        """Everything at one posture, of the joints that move.

        Parameters
        ----------
        q : (4,)
            All angles, rad.
        moving : tuple of int
            `HELD` where the upper arm is kept from turning about its own axis.

        Returns
        -------
        ArmPosture
            n joints, in the order of `moving`; weight and its gradient where gravity is known.

        Raises
        ------
        InputError
            Not four finite angles.
        """
        q = _checked(q)
        A, u, v = _axes(q)
        links, r = self.links, list(moving)
        elbow = -links.upper_arm_m * u
        J = _first(A, elbow, elbow - links.forearm_hand_m * v)
        bend, parts = _second(A, J), self._parts(u, v)
        weight = gradient = None
        if self.gravity_m_s2 is not None:
            weight, gradient = self._weight(A, parts, elbow)
            weight, gradient = weight[r], gradient[np.ix_(r, r)]
        return ArmPosture(
            joint_angles=q[r],
            hand_position=elbow - links.forearm_hand_m * v,
            jacobian=J[:, r],
            jacobian_derivative=bend[:, r][:, :, r],
            inertia=self._inertia(A, (u, v), parts)[np.ix_(r, r)],
            gravity_torque=weight,
            gravity_gradient=gradient,
        )

    def _inertia(
        self,
        A: FloatArray,
        long: tuple[FloatArray, FloatArray],
        parts: tuple[tuple[float, FloatArray], ...],
    ) -> FloatArray:
        """Joint-space inertia M(q), (4, 4): links round about their long axes."""
        links, ratios = self.links, DE_LEVA["male"]
        across = (links.upper_arm_inertia_kgm2, links.forearm_hand_inertia_kgm2)
        thin = (ratios.upper_arm.gyration_long, ratios.forearm.gyration_long)
        lengths = (links.upper_arm_m, links.forearm_hand_m)
        M, elbow = np.zeros((4, 4)), -links.upper_arm_m * long[0]
        for i, (kg, centre) in enumerate(parts):
            Jc = _first(A, elbow, centre, 3 + i)
            Jw = np.where(np.arange(4) < 3 + i, A, 0.0)
            about = long[i] @ Jw
            round_kgm2 = kg * ((thin[i] or 0.0) * lengths[i]) ** 2
            # M (4, 4) += m J_c^T J_c + J_w^T (across I + (along - across) l l^T) J_w
            M += kg * Jc.T @ Jc + across[i] * Jw.T @ Jw
            M += (round_kgm2 - across[i]) * np.outer(about, about)
        return M


def _checked(q: ArrayLike) -> FloatArray:
    angles = np.asarray(q, dtype=float)
    if angles.shape != (4,) or not np.isfinite(angles).all():
        raise InputError(
            f"joint angles of shape {angles.shape}", expected="four finite ones of an arm in space"
        )
    return angles


def _axes(q: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The hinges' axes (3, 4), and unit vectors (3,) from elbow to shoulder and hand to elbow."""
    (c1, c2, c3, c4), (s1, s2, s3, s4) = np.cos(q), np.sin(q)
    # columns: Rz(q1) Rx(q2)
    tilted = np.array([[c1, -s1 * c2, s1 * s2], [s1, c1 * c2, -c1 * s2], [0.0, s2, c2]])
    bend, u = c3 * tilted[:, 0] + s3 * tilted[:, 1], tilted[:, 2]
    front = -s3 * tilted[:, 0] + c3 * tilted[:, 1]
    axes = np.column_stack([[0.0, 0.0, 1.0], tilted[:, 0], u, bend])
    return axes, u, c4 * u - s4 * front


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


def _first(A: FloatArray, elbow: FloatArray, point: FloatArray, last: int = 4) -> FloatArray:
    """First derivatives (3, 4) of a point that the first `last` joints move.

    ``dp/dq_i = a_i x (p - o_i)``.
    """
    arm = np.empty((3, 4))
    arm[:, :3], arm[:, 3] = point[:, None], point - elbow
    J = _cross(A, arm)
    J[:, last:] = 0.0
    return J


def _second(A: FloatArray, J: FloatArray) -> FloatArray:
    """Second derivatives (3, 4, 4) of a point from the first ones.

    ``d2p/dq_i dq_j = a_i x (a_j x (p - o_j))`` for i nearer to the trunk than j.
    """
    bend = _cross(A[:, :, None], J[:, None, :])
    return np.where(_OUTWARDS, bend, bend.transpose(0, 2, 1))


#: Joints i, j of which i is the nearer to the trunk, or the same.
_OUTWARDS: Final = np.triu(np.ones((4, 4), dtype=bool))


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Cross products along the first axis; `np.cross` takes most of a live update's time."""
    (x, y, z), (X, Y, Z) = a, b
    return np.stack([y * Z - z * Y, z * X - x * Z, x * Y - y * X])
