"""Rods in a chain of hinges, and the protocol of every arm.

The hinges and the frame are those of `SpatialArm`.
"""

from __future__ import annotations

from typing import Final, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray
from armimpedance.core.records import ArmPosture

#: Joints of an arm in space with its wrist locked, and with its wrist free.
LOCKED_WRIST, FREE_WRIST = 4, 7
IN_SPACE: Final = (LOCKED_WRIST, FREE_WRIST)
#: Index of the rod at whose upper end each joint lies; number of joints that move each rod.
STARTS_AT: Final = (0, 0, 0, 1, 1, 2, 2)
MOVED_BY: Final = {LOCKED_WRIST: (3, 4), FREE_WRIST: (3, 5, 7)}


class Rod(NamedTuple):
    """A segment that is rotationally symmetric about its long axis.

    `length_m`: to the next joint, or to the grip.
    `kg`, `com_m`: mass, and its centre from the upper end.
    `across_kgm2`, `along_kgm2`: moments of inertia about the centre, across the long axis and along
    it.
    """

    length_m: float
    kg: float
    com_m: float
    across_kgm2: float
    along_kgm2: float


class Places(NamedTuple):
    """Axes and origins of the hinges (3, n), and unit vector, centre and end of each rod (3,).

    `long`: unit vectors from the lower end of each rod to its upper end.
    `centres`, `ends`: centres of mass and lower ends.
    """

    axes: FloatArray
    long: tuple[FloatArray, ...]
    origins: FloatArray
    centres: tuple[FloatArray, ...]
    ends: tuple[FloatArray, ...]


def parted(whole: Rod, hand: Rod) -> tuple[Rod, Rod]:
    """Split the rod of forearm and hand with a straight wrist into its two rods."""
    length, kg = whole.length_m - hand.length_m, whole.kg - hand.kg
    at = length + hand.com_m
    com = (whole.kg * whole.com_m - hand.kg * at) / kg
    # parallel axis: I = sum I_i + m_i (c_i - c)^2
    steiner = kg * (com - whole.com_m) ** 2 + hand.kg * (at - whole.com_m) ** 2
    across = whole.across_kgm2 - hand.across_kgm2 - steiner
    return Rod(length, kg, com, across, whole.along_kgm2 - hand.along_kgm2), hand


def places(rods: tuple[Rod, ...], q: FloatArray) -> Places:
    """Compute the positions of hinges and rods at angles (n,)."""
    axes, long = axes_of(q)
    starts, ends, centres = [np.zeros(3)], [], []
    for rod, up in zip(rods, long, strict=True):
        centres.append(starts[-1] - rod.com_m * up)
        ends.append(starts[-1] - rod.length_m * up)
        starts.append(ends[-1])
    origins = np.column_stack([starts[i] for i in STARTS_AT[: len(q)]])
    return Places(axes, long, origins, tuple(centres), tuple(ends))


def axes_of(q: FloatArray) -> tuple[FloatArray, tuple[FloatArray, ...]]:
    """Axes of the hinges (3, n), and the unit vector (3,) up from each rod's lower end."""
    cosines, sines = np.cos(q), np.sin(q)
    (c1, c2, c3, c4), (s1, s2, s3, s4) = cosines[:4], sines[:4]
    # columns: Rz(q1) Rx(q2)
    tilted = np.array([[c1, -s1 * c2, s1 * s2], [s1, c1 * c2, -c1 * s2], [0.0, s2, c2]])
    bend, u = c3 * tilted[:, 0] + s3 * tilted[:, 1], tilted[:, 2]
    front = -s3 * tilted[:, 0] + c3 * tilted[:, 1]
    v = c4 * u - s4 * front
    four = ([0.0, 0.0, 1.0], tilted[:, 0], u, bend)
    if len(q) == LOCKED_WRIST:
        return np.column_stack(four), (u, v)
    (c5, c6, c7), (s5, s6, s7) = cosines[4:], sines[4:]
    front = s4 * u + c4 * front
    # Rz(q5), Rx(q6), Ry(q7) of the forearm's own axes
    side, front = c5 * bend + s5 * front, c5 * front - s5 * bend
    palm, down = c6 * front + s6 * v, c6 * v - s6 * front
    return np.column_stack([*four, v, side, palm]), (u, v, c7 * down + s7 * side)


def first_derivative(now: Places, point: FloatArray, last: int | None = None) -> FloatArray:
    """First derivatives (3, n) of a point that is moved by the first `last` joints.

    ``dp/dq_i = a_i x (p - o_i)``.
    """
    J = _cross(now.axes, point[:, None] - now.origins)
    if last is not None:
        J[:, last:] = 0.0
    return J


def second_derivative(A: FloatArray, J: FloatArray) -> FloatArray:
    """Second derivatives (3, n, n) of a point from the first ones.

    ``d2p/dq_i dq_j = a_i x (a_j x (p - o_j))`` for i nearer to the trunk than j.
    """
    bend = _cross(A[:, :, None], J[:, None, :])
    return np.where(_OUTWARDS[: len(A.T), : len(A.T)], bend, bend.transpose(0, 2, 1))


#: True for joints i, j if i is nearer to the trunk than j, or the same.
_OUTWARDS: Final = np.triu(np.ones((FREE_WRIST, FREE_WRIST), dtype=bool))


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Cross products along the first axis; `np.cross` would take most of a live update's time."""
    (x, y, z), (X, Y, Z) = a, b
    return np.stack([y * Z - z * Y, z * X - x * Z, x * Y - y * X])


# The protocol of every arm.


class Arm(Protocol):
    """An arm of n joints whose hand moves along d axes.

    All methods take leading batch axes: `q` and `qd` are (..., n) in rad and rad/s.
    """

    @property
    def joints(self) -> int:
        """Number of joints n."""

    @property
    def axes(self) -> int:
        """Number of hand axes d."""

    def hand_position(self, q: ArrayLike) -> FloatArray:
        """Position of the hand from the shoulder, m, (..., d)."""

    def jacobian(self, q: ArrayLike) -> FloatArray:
        """Jacobian ``J = dp/dq``, (..., d, n)."""

    def jacobian_derivative(self, q: ArrayLike) -> FloatArray:
        """Second derivatives ``[k, i, j] = d2 p_k / dq_i dq_j``, (..., d, n, n)."""

    def jacobian_rate(self, q: ArrayLike, qd: ArrayLike) -> FloatArray:
        """Rate of the Jacobian ``dJ/dt``, (..., d, n)."""

    def inertia(self, q: ArrayLike) -> FloatArray:
        """Joint-space inertia M(q), kg m^2, (..., n, n)."""

    def bias(self, q: ArrayLike, qd: ArrayLike) -> FloatArray:
        """Coriolis and centrifugal torque h(q, qd), N m, (..., n)."""

    def gravity(self, q: ArrayLike) -> FloatArray:
        """Gravity torque g(q), N m, (..., n)."""

    def gravity_gradient(self, q: ArrayLike) -> FloatArray:
        """Gradient of the gravity torque, ``[i, j] = dg_i / dq_j``, N m/rad, (..., n, n)."""

    def posture(self, q: ArrayLike) -> ArmPosture:
        """All quantities of the arm at one posture, `q` (n,)."""
