"""Any arm through Pinocchio: the general case, and the oracle of the closed forms.

Import this module only where such an arm is used: it loads Pinocchio.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.records import ArmPosture
from armimpedance.limb.arm.anthropometry import SegmentRatios, Sex, arm_ratios

_WORLD = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED


@dataclass(frozen=True)
class PinocchioArm:
    """An arm that Pinocchio knows.

    Parameters
    ----------
    model : pinocchio.Model
        Joints with one coordinate each. **Its gravity counts**: a new model has -9.81 m/s^2
        along z.
    frame : str
        The hand's frame; the shoulder is at the model's origin.
    hand_axes : tuple of int
        Which of x, y, z (0, 1, 2) are hand axes.

    Raises
    ------
    InputError
        The frame does not exist, or the model has joints of several coordinates.
    """

    model: Any
    frame: str
    hand_axes: tuple[int, ...] = (0, 1)

    def __post_init__(self) -> None:
        if not self.model.existFrame(self.frame):
            raise InputError(f"the model has no frame {self.frame!r}")
        if self.model.nq != self.model.nv:
            raise InputError(
                f"{self.model.nq} coordinates for {self.model.nv} velocities",
                expected="joints of one coordinate each",
            )
        if not self.hand_axes or not set(self.hand_axes) <= {0, 1, 2}:
            raise InputError(f"hand axes {self.hand_axes}", expected="some of 0, 1, 2")

    @property
    def joints(self) -> int:
        """Number of joints n."""
        return int(self.model.nv)

    @property
    def axes(self) -> int:
        """Number of hand axes d."""
        return len(self.hand_axes)

    def hand_position(self, q: ArrayLike) -> FloatArray:
        """Hand from the model's origin, m, (..., d)."""

        def one(data: Any, q: FloatArray) -> FloatArray:
            pin.framesForwardKinematics(self.model, data, q)
            return data.oMf[self._frame].translation[list(self.hand_axes)]

        return self._each(one, (self.axes,), q)

    def jacobian(self, q: ArrayLike) -> FloatArray:
        """``J = dp/dq``, (..., d, n)."""

        def one(data: Any, q: FloatArray) -> FloatArray:
            J = pin.computeFrameJacobian(self.model, data, q, self._frame, _WORLD)
            return self._matrix(J, 6)[list(self.hand_axes)]

        return self._each(one, (self.axes, self.joints), q)

    def jacobian_rate(self, q: ArrayLike, qd: ArrayLike) -> FloatArray:
        """``dJ/dt``, (..., d, n)."""

        def one(data: Any, q: FloatArray, qd: FloatArray) -> FloatArray:
            pin.computeJointJacobiansTimeVariation(self.model, data, q, qd)
            rate = pin.getFrameJacobianTimeVariation(self.model, data, self._frame, _WORLD)
            return self._matrix(rate, 6)[list(self.hand_axes)]

        return self._each(one, (self.axes, self.joints), q, qd)

    def jacobian_derivative(self, q: ArrayLike) -> FloatArray:
        """``[k, i, j] = d2 p_k / dq_i dq_j``, (..., d, n, n)."""
        # Jdot is linear in qd: at unit velocity of joint j it is dJ/dq_j (d, n)
        units = np.eye(self.joints)
        return np.stack([self.jacobian_rate(q, unit) for unit in units], axis=-1)

    def inertia(self, q: ArrayLike) -> FloatArray:
        """Joint-space inertia M(q), kg m^2, (..., n, n)."""

        def one(data: Any, q: FloatArray) -> FloatArray:
            upper = np.triu(self._matrix(pin.crba(self.model, data, q), self.joints))
            return upper + np.triu(upper, 1).T

        return self._each(one, (self.joints, self.joints), q)

    def bias(self, q: ArrayLike, qd: ArrayLike) -> FloatArray:
        """Coriolis and centrifugal torque h(q, qd) without gravity, N m, (..., n)."""

        def one(data: Any, q: FloatArray, qd: FloatArray) -> FloatArray:
            C = pin.computeCoriolisMatrix(self.model, data, q, qd)
            return self._matrix(C, self.joints) @ qd

        return self._each(one, (self.joints,), q, qd)

    def gravity(self, q: ArrayLike) -> FloatArray:
        """Gravity torque g(q) of the model's gravity, N m, (..., n)."""

        def one(data: Any, q: FloatArray) -> FloatArray:
            return pin.computeGeneralizedGravity(self.model, data, q)

        return self._each(one, (self.joints,), q)

    def gravity_gradient(self, q: ArrayLike) -> FloatArray:
        """``[i, j] = dg_i / dq_j``, N m/rad, (..., n, n)."""

        def one(data: Any, q: FloatArray) -> FloatArray:
            return pin.computeGeneralizedGravityDerivatives(self.model, data, q)

        return self._each(one, (self.joints, self.joints), q)

    def posture(self, q: ArrayLike) -> ArmPosture:
        """Everything at one posture, `q` (n,) rad."""
        return ArmPosture(
            joint_angles=np.asarray(q, dtype=float),
            hand_position=self.hand_position(q),
            jacobian=self.jacobian(q),
            jacobian_derivative=self.jacobian_derivative(q),
            inertia=self.inertia(q),
            gravity_torque=self.gravity(q),
            gravity_gradient=self.gravity_gradient(q),
        )

    @property
    def _frame(self) -> int:
        return int(self.model.getFrameId(self.frame))

    def _matrix(self, result: FloatArray, rows: int) -> FloatArray:
        """Pinocchio returns a single column as a vector."""
        return result.reshape(rows, self.joints)

    def _each(
        self, function: Callable[..., FloatArray], shape: tuple[int, ...], *states: ArrayLike
    ) -> FloatArray:
        """Apply to every state; Pinocchio's results are views of `data`, so they are copied."""
        arrays = np.broadcast_arrays(*(self._checked(state) for state in states))
        batch = arrays[0].shape[:-1]
        result = np.empty((*batch, *shape))
        data = self.model.createData()
        for index in np.ndindex(batch):
            result[index] = function(data, *(np.array(array[index]) for array in arrays))
        return result

    def _checked(self, values: ArrayLike) -> FloatArray:
        array = np.asarray(values, dtype=float)
        if array.ndim == 0 or array.shape[-1] != self.joints:
            wanted = f"{self.joints} values on the last axis"
            raise InputError(f"arm state of shape {array.shape}", expected=wanted)
        if not np.isfinite(array).all():
            raise InputError("arm state: a value is not finite", expected="finite numbers")
        return array


def planar_chain(
    lengths: Sequence[float],
    masses: Sequence[float],
    coms: Sequence[float],
    inertias: Sequence[float],
    *,
    gravity_m_s2: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> PinocchioArm:
    """An arm of n links in the x-y plane, joints about z; straight along +x at q = 0.

    Parameters
    ----------
    lengths, masses, coms, inertias : n numbers each
        m, kg, m from the proximal joint, kg m^2 about the link's centre of mass.

    Raises
    ------
    InputError
        The four lists differ in length, or a number is not positive.
    """
    table = [np.asarray(values, dtype=float) for values in (lengths, masses, coms, inertias)]
    if len({values.shape for values in table}) != 1 or table[0].ndim != 1 or not table[0].size:
        raise InputError("planar chain: lists of different lengths", expected="one entry per link")
    if not all(np.all(np.isfinite(values) & (values > 0)) for values in table):
        raise InputError("planar chain: a number is not positive", expected="more than 0")
    model, parent, offset = _empty_model(gravity_m_s2), 0, 0.0
    for length, mass, com, inertia in zip(*table, strict=True):
        parent = _add_joint(model, parent, pin.JointModelRZ(), offset)
        # only the moment about z matters in the plane
        body = pin.Inertia(mass, np.array([com, 0.0, 0.0]), np.diag([inertia] * 3))
        model.appendBodyToJoint(parent, body, pin.SE3.Identity())
        offset = length
    _add_hand(model, parent, offset)
    return PinocchioArm(model, "hand")


def seven_joint_arm(
    mass_kg: float,
    height_m: float,
    *,
    sex: Sex = "male",
    gravity_m_s2: tuple[float, float, float] = (0.0, 0.0, -9.81),
) -> PinocchioArm:
    """A right arm with seven joints and three hand axes, segments after de Leva (1996).

    At q = 0 the arm is straight along +x (to the right), z up. Joints in order: shoulder about
    z, y and the arm's own axis; elbow about z; forearm about its own axis; wrist about y and z.
    With joints 1 and 4 alone it is the horizontal two-link arm.

    Raises
    ------
    InputError
        Mass or height is not positive.
    """
    if not (np.isfinite(mass_kg) and mass_kg > 0 and np.isfinite(height_m) and height_m > 0):
        raise InputError(f"mass {mass_kg} kg, height {height_m} m", expected="more than 0")
    ratios = arm_ratios("de_leva", sex)
    x, y, z = pin.JointModelRX, pin.JointModelRY, pin.JointModelRZ
    groups = (
        ((z, y, x), ratios.upper_arm, 1.0),
        ((z, x), ratios.forearm, 1.0),
        ((y, z), ratios.hand, ratios.grip),
    )
    model, parent, offset = _empty_model(gravity_m_s2), 0, 0.0
    for joints, segment, used in groups:
        for joint in joints:
            parent = _add_joint(model, parent, joint(), offset)
            offset = 0.0
        body = _body(segment, mass_kg, height_m)
        model.appendBodyToJoint(parent, body, pin.SE3.Identity())
        offset = used * segment.length * height_m
    _add_hand(model, parent, offset)
    return PinocchioArm(model, "hand", hand_axes=(0, 1, 2))


def _empty_model(gravity_m_s2: tuple[float, float, float]) -> Any:
    model = pin.Model()
    model.gravity.linear = np.array(gravity_m_s2, dtype=float)
    return model


def _along_x(offset_m: float) -> Any:
    return pin.SE3(np.eye(3), np.array([offset_m, 0.0, 0.0]))


def _add_joint(model: Any, parent: int, joint: Any, offset_m: float) -> int:
    return int(model.addJoint(parent, joint, _along_x(offset_m), f"joint_{model.njoints}"))


def _add_hand(model: Any, parent: int, offset_m: float) -> None:
    model.addFrame(pin.Frame("hand", parent, 0, _along_x(offset_m), pin.FrameType.OP_FRAME))


def _body(segment: SegmentRatios, mass_kg: float, height_m: float) -> Any:
    """Long axis x, elbow-flexion axis z, the sagittal one y."""
    length, mass = segment.length * height_m, segment.mass * mass_kg
    radii = (segment.gyration_long, segment.gyration_sagittal, segment.gyration)
    moments = [mass * (float(radius or 0.0) * length) ** 2 for radius in radii]
    return pin.Inertia(mass, np.array([segment.com * length, 0.0, 0.0]), np.diag(moments))
