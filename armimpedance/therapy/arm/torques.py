"""Everything that acts on the moving axis during one movement."""

from __future__ import annotations

from dataclasses import dataclass

from armimpedance.arrays import FloatArray, frozen_array
from armimpedance.errors import RecordError


@dataclass(frozen=True)
class MovementTorques:
    """Torques about the axis that one movement is about; S samples from its onset to its end.

    ``user = robot + arm - motor`` (2), ``support = motor - robot`` (18).

    Attributes
    ----------
    trial, condition, movement : str
    axis : int
        Column of the recording, from 0.
    axis_name : str
    sample_rate_hz : float
    time_s : (S,)
    q, qd : (S,)
        rad, rad/s, of this axis.
    motor, robot : (S,)
        Nm; of the motor, and what the empty robot needs, (13).
    rigid_arm : (S,)
        Inertia and weight of the arm about this axis.
    elastic : (S,)
        ``k_s q + offset``; 0 where it is not known yet.
    robot_inertia : (S,)
        The part of `robot` that accelerates it, ``M qdd``.
    robot_gradient : (S, p)
        ``d robot / d theta``.
    notes : tuple of str
        What a reader must know of this movement.
    """

    trial: str
    condition: str
    movement: str
    axis: int
    axis_name: str
    sample_rate_hz: float
    time_s: FloatArray
    q: FloatArray
    qd: FloatArray
    motor: FloatArray
    robot: FloatArray
    rigid_arm: FloatArray
    elastic: FloatArray
    robot_inertia: FloatArray
    robot_gradient: FloatArray
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "time_s", frozen_array(self.time_s, "time_s", (None,)))
        if len(self.time_s) < 2:
            raise RecordError(f"trial {self.trial}: a movement of {len(self.time_s)} samples")
        shape = self.time_s.shape
        for name in ("q", "qd", "motor", "robot", "rigid_arm", "elastic", "robot_inertia"):
            put(self, name, frozen_array(getattr(self, name), name, shape))
        gradient = frozen_array(self.robot_gradient, "robot_gradient", (shape[0], None))
        put(self, "robot_gradient", gradient)
        put(self, "notes", tuple(self.notes))

    @property
    def arm(self) -> FloatArray:
        """tau_h (14), (S,)."""
        return self.rigid_arm + self.elastic

    @property
    def support(self) -> FloatArray:
        """tau_motor - tau_r (18), (S,)."""
        return self.motor - self.robot

    @property
    def user(self) -> FloatArray:
        """tau_user (2), (S,)."""
        return self.arm - self.support
