"""What every arm can tell, however it is computed."""

from __future__ import annotations

from typing import Protocol

from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray
from armimpedance.core.records import ArmPosture


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
        """Hand from the shoulder, m, (..., d)."""

    def jacobian(self, q: ArrayLike) -> FloatArray:
        """``J = dp/dq``, (..., d, n)."""

    def jacobian_derivative(self, q: ArrayLike) -> FloatArray:
        """``[k, i, j] = d2 p_k / dq_i dq_j``, (..., d, n, n)."""

    def jacobian_rate(self, q: ArrayLike, qd: ArrayLike) -> FloatArray:
        """``dJ/dt``, (..., d, n)."""

    def inertia(self, q: ArrayLike) -> FloatArray:
        """Joint-space inertia M(q), kg m^2, (..., n, n)."""

    def bias(self, q: ArrayLike, qd: ArrayLike) -> FloatArray:
        """Coriolis and centrifugal torque h(q, qd), N m, (..., n)."""

    def gravity(self, q: ArrayLike) -> FloatArray:
        """Gravity torque g(q), N m, (..., n)."""

    def gravity_gradient(self, q: ArrayLike) -> FloatArray:
        """``[i, j] = dg_i / dq_j``, N m/rad, (..., n, n)."""

    def posture(self, q: ArrayLike) -> ArmPosture:
        """Everything at one posture, `q` (n,)."""
