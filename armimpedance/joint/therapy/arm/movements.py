"""Torques about the moving axis during each movement of a recording."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord, frozen
from armimpedance.core.errors import InputError, RecordError
from armimpedance.core.records import Recording
from armimpedance.joint.therapy.arm.passive_arm import PassiveArm
from armimpedance.joint.therapy.robot.steady import SmoothTrial, no_step, number_in, smooth_trials
from armimpedance.joint.therapy.robot.therapy_robot import TherapyRobot, load_gradient, load_torque

if TYPE_CHECKING:
    from armimpedance.joint.therapy.robot.therapy_robot import RigidBodies

# All torques about the moving axis during one movement.


@dataclass(frozen=True)
class MovementTorques(FrozenRecord):
    """Torques about the moving axis; S samples from the onset of one movement to its end.

    ``user = robot + arm - motor`` (2), ``support = motor - robot`` (18).

    Attributes
    ----------
    trial, condition, movement : str
        As in the trial table.
    axis : int
        Column of the recording, from 0.
    axis_name : str
    sample_rate_hz : float
    time_s : (S,)
    q, qd : (S,)
        rad, rad/s, of this axis.
    motor, robot : (S,)
        Torque of the motor and of the empty robot (13), N m.
    rigid_arm : (S,)
        Torque of the arm's inertia and weight about this axis.
    elastic : (S,)
        ``k_s q + offset``; 0 before it is fitted.
    robot_inertia : (S,)
        Inertia part of `robot`, ``M qdd``.
    robot_gradient : (S, p)
        ``d robot / d theta``.
    notes : tuple of str
        Notes on this movement.
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
        """Torque of the passive arm tau_h (14), (S,)."""
        return self.rigid_arm + self.elastic

    @property
    def support(self) -> FloatArray:
        """Support tau_motor - tau_r (18), (S,)."""
        return self.motor - self.robot

    @property
    def user(self) -> FloatArray:
        """Torque of the person tau_user (2), (S,)."""
        return self.arm - self.support


#: Without times in the trial table, a movement lasts while its axis is faster than this fraction of
#: its peak speed.
SPEED_SHARE: Final = 0.05
#: Peak speed up to which an axis does not move, rad/s.
STILL_RAD_S: Final = 0.01
#: Longest part that the kernel may cut off a movement without a note, s.
_CUT_S: Final = 0.005


@dataclass(frozen=True)
class Movement:
    """One movement of one trial, after the kernel, from its onset to its end.

    `trial`, `condition`, `name`: `name` from the column `movement`, else the axis' name.
    `axis`: column of the recording, from 0.
    """

    trial: str
    condition: str
    name: str
    axis: int
    motion: SmoothTrial
    notes: tuple[str, ...] = ()


def movement_torques(
    recording: Recording,
    robot: TherapyRobot,
    arm: PassiveArm,
    *,
    step: Callable[[], object] = no_step,
) -> tuple[MovementTorques, ...]:
    """Torques about the moving axis, one result per trial in the table's order.

    Parameters
    ----------
    recording : Recording
        Of kind "joint", n axes, commanded torques.
    robot : TherapyRobot
        Identified; it is adjusted to the arm's length here.
    arm : PassiveArm
        `MovementTorques.elastic` is 0 if the stiffness of an axis is not known.
    step : function, optional
        Called after every trial.

    Returns
    -------
    tuple of MovementTorques

    Raises
    ------
    InputError
        A movement is outside its trial, nothing moves in a trial, the loads are not known, or the
        arm was measured in another robot.
    """
    from armimpedance.joint.therapy.arm.passive_arm import arm_bodies
    from armimpedance.joint.therapy.robot.therapy_robot import robot_bodies

    refuse_other_robot(arm, robot)
    fitted = robot.adjusted_to(arm.upper_arm_m)
    bodies = robot_bodies(fitted), arm_bodies(fitted, arm)
    torques = []
    for movement in cut_movements(recording, fitted):
        torques.append(_torques(movement, fitted, arm, *bodies, recording.sample_rate_hz))
        step()
    return tuple(torques)


def refuse_other_robot(arm: PassiveArm, robot: TherapyRobot) -> None:
    """Refuse an arm that was measured in another robot.

    Raises InputError: the arm has the name of another robot.
    """
    if arm.robot != robot.name:
        raise InputError(
            f"the arm of subject {arm.subject} was measured in the robot {arm.robot!r}",
            expected=f"one measured in {robot.name!r}",
        )


def cut_movements(recording: Recording, robot: TherapyRobot) -> tuple[Movement, ...]:
    """Movements with their axis, cut from their trials.

    The axis is from the column `axis` (from 1), else the one that moves most. Times are from the
    columns `onset_s` and `end_s`, else from the first to the last sample whose speed is at least
    `SPEED_SHARE` of the movement's peak.

    Raises InputError: as `movement_torques`.
    """
    if recording.axes != robot.n_axes:
        raise InputError(
            f"a recording of {recording.axes} axes", expected=f"the {robot.n_axes} of {robot.name}"
        )
    return tuple(
        _movement(dict(recording.trials.iloc[trial.row]), trial, robot)
        for trial in smooth_trials(recording)
    )


def _movement(line: dict[Any, Any], trial: SmoothTrial, robot: TherapyRobot) -> Movement:
    label = str(line["trial"])
    axis = _axis(line, trial, robot.n_axes)
    name = line.get("movement")
    first, last, notes = _window(line, trial, axis)
    motion = trial.between(first, last)
    if len(motion.time_s) < 2:
        raise InputError(
            f"trial {label}: nothing recorded from {first:g} to {last:g} s",
            expected=f"a movement between {trial.time_s[0]:g} and {trial.time_s[-1]:g} s",
        )
    named = name if isinstance(name, str) and name else robot.axes[axis]
    if named in robot.axes and named != robot.axes[axis]:
        raise InputError(
            f"trial {label}: the movement {named} is about axis {axis + 1}, {robot.axes[axis]}",
            column="movement",
            expected=f"axis {robot.axes.index(named) + 1} of robot {robot.name}, or another name",
        )
    return Movement(label, str(line["condition"]), named, axis, motion, notes)


def _axis(line: dict[Any, Any], trial: SmoothTrial, n_axes: int) -> int:
    """Moving axis, from 0."""
    stated = number_in(line, "axis")
    if stated is None:
        return int(np.ptp(trial.q, axis=0).argmax())
    if stated not in range(1, n_axes + 1):
        raise InputError(
            f"trial {line['trial']}: axis {stated:g}", column="axis", expected=f"1 to {n_axes}"
        )
    return int(stated) - 1


def _window(
    line: dict[Any, Any], trial: SmoothTrial, axis: int
) -> tuple[float, float, tuple[str, ...]]:
    """Onset and end, s, and notes on them."""
    onset, end = number_in(line, "onset_s"), number_in(line, "end_s")
    notes: tuple[str, ...] = ()
    if onset is None or end is None:
        moving = _moving(line, trial, axis)
        onset = moving[0] if onset is None else onset
        end = moving[1] if end is None else end
        notes += (f"onset or end detected: faster than {100 * SPEED_SHARE:g} % of the peak speed",)
    first, last = float(trial.time_s[0]), float(trial.time_s[-1])
    cut = max(first - onset, 0.0) + max(end - last, 0.0)
    if cut > _CUT_S:
        notes += (
            f"{cut:.2g} s are missing at the ends of the trial, where the kernel has no result",
        )
    return onset, end, notes


def _moving(line: dict[Any, Any], trial: SmoothTrial, axis: int) -> tuple[float, float]:
    speed = np.abs(trial.qd[:, axis])
    if not speed.max() > STILL_RAD_S:
        raise InputError(
            f"trial {line['trial']}: axis {axis + 1} does not move",
            expected="onset_s and end_s in the trial table, or a movement",
        )
    fast = np.flatnonzero(speed >= SPEED_SHARE * speed.max())
    return float(trial.time_s[fast[0]]), float(trial.time_s[fast[-1]])


def _torques(
    movement: Movement,
    robot: TherapyRobot,
    arm: PassiveArm,
    own: RigidBodies,
    carried: RigidBodies,
    sample_rate_hz: float,
) -> MovementTorques:
    motion, axis = movement.motion, movement.axis
    state = motion.q, motion.qd, motion.qdd
    return MovementTorques(
        trial=movement.trial,
        condition=movement.condition,
        movement=movement.name,
        axis=axis,
        axis_name=robot.axes[axis],
        sample_rate_hz=sample_rate_hz,
        time_s=motion.time_s,
        q=motion.q[:, axis],
        qd=motion.qd[:, axis],
        motor=motion.motor[:, axis],
        robot=own.torque(*state)[:, axis] + load_torque(robot, *state[:2])[:, axis],
        rigid_arm=carried.torque(*state)[:, axis],
        elastic=elastic_torque(arm, robot.axes[axis], motion.q[:, axis]),
        robot_inertia=own.inertia_torque(motion.q, motion.qdd)[:, axis],
        robot_gradient=frozen(load_gradient(robot, axis, *state[:2])),
        notes=movement.notes,
    )


def elastic_torque(arm: PassiveArm, axis: str, q: FloatArray) -> FloatArray:
    """``k_s q + offset`` of this axis at its angles (S,), (15); 0 if it was not measured."""
    measured = [e for e in arm.elastic if e.axis == axis]
    return measured[0].stiffness * q + measured[0].offset if measured else np.zeros_like(q)
