"""Everything that acts on the moving axis during one movement."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.errors import RecordError


@dataclass(frozen=True)
class MovementTorques(FrozenRecord):
    """Torques about the axis that one movement is about; S samples from its onset to its end.

    ``user = robot + arm - motor`` (2), ``support = motor - robot`` (18).

    Attributes
    ----------
    trial, condition, movement : str
        What the trial table calls them.
    axis : int
        Column of the recording, from 0.
    axis_name : str
    sample_rate_hz : float
    time_s : (S,)
    q, qd : (S,)
        rad, rad/s, of this axis.
    motor, robot : (S,)
        N m; of the motor, and what the empty robot needs, (13).
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
    time_s: Annotated[FloatArray, "S"]
    q: Annotated[FloatArray, "S"]
    qd: Annotated[FloatArray, "S"]
    motor: Annotated[FloatArray, "S"]
    robot: Annotated[FloatArray, "S"]
    rigid_arm: Annotated[FloatArray, "S"]
    elastic: Annotated[FloatArray, "S"]
    robot_inertia: Annotated[FloatArray, "S"]
    robot_gradient: Annotated[FloatArray, "S p"]
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.time_s) < 2:
            raise RecordError(f"trial {self.trial}: a movement of {len(self.time_s)} samples")

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
