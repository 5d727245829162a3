"""Check that a recording can be one of this robot, and how well the robot predicts torques."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.records import Recording
from armimpedance.joint.therapy.robot.steady import no_step, smooth_trials
from armimpedance.joint.therapy.robot.therapy_robot import TherapyRobot, load_torque
from armimpedance.numerics.signals import refuse_degrees

#: Tolerance of an angle beyond its limit, for overshoot and the zero of an encoder, rad.
BEYOND_LIMIT_RAD: Final = 0.05
#: Tolerance factor of a motor torque beyond its limit, for noise on a saturated command.
BEYOND_TORQUE: Final = 1.2
#: Multiple of its limit from which the unit is probably wrong, not the robot.
WRONG_UNIT: Final = 10.0
#: Motor torques (rms over all axes) below this share of the robot's weight cannot hold it, even
#: with its springs.
LEAST_SHARE_OF_WEIGHT: Final = 0.01
#: Least travel of an axis that moves, rad.
MOVES_RAD: Final = 0.05
#: Least net work of the motors, over the sum of its absolute values per trial; -1 if all signs are
#: wrong.
WORST_WORK: Final = -0.5
#: Fall of the robot's potential energy in a trial above which motors may absorb work, J.
FALLS_J: Final = 0.2


def check_recording(recording: Recording, robot: TherapyRobot) -> None:
    """Refuse a recording that this robot cannot have made.

    Parameters
    ----------
    recording : Recording
    robot : TherapyRobot
        With or without identified loads.

    Raises
    ------
    InputError
        Not of kind "joint" with commanded torques, another number of axes, angles in degrees or
        outside the robot's range, torques that are missing, in another unit or of the wrong
        sign.
    """
    _check_kind(recording, robot)
    _check_angles(recording, robot)
    _check_torques(recording, robot)
    _check_weight_and_work(recording, robot)


def refuse_person(recording: Recording) -> None:
    """Refuse a recording with a person in the robot where the empty robot is required.

    Raises InputError: its subject has a body mass.
    """
    if recording.subject.mass_kg is not None:
        raise InputError(
            f"subject {recording.subject.id} is in the robot",
            column="subject.mass_kg",
            expected="a recording of the empty robot, whose subject has no body mass",
        )


def _check_kind(recording: Recording, robot: TherapyRobot) -> None:
    if recording.kind != "joint":
        raise InputError(f"a recording of kind {recording.kind!r}", expected="'joint'")
    if recording.torque != "commanded":
        unsaid = "a recording that does not say what its torques are"
        raise InputError(
            unsaid if recording.torque is None else f"a recording of {recording.torque} torques",
            column="torque",
            expected="'commanded': those of the robot's motors",
        )
    if recording.axes != robot.n_axes:
        raise InputError(
            f"a recording of {recording.axes} axes",
            expected=f"the {robot.n_axes} of robot {robot.name}: {', '.join(robot.axes)}",
        )


def _check_angles(recording: Recording, robot: TherapyRobot) -> None:
    columns = tuple(f"q{i + 1}" for i in range(robot.n_axes))
    refuse_degrees(recording.position, columns)
    low, high = robot.limits_rad.T
    past = np.maximum(recording.position - high, low - recording.position).max(axis=0)
    axis = int(np.argmax(past))
    if past[axis] > BEYOND_LIMIT_RAD:
        angle = recording.position[:, axis]
        raise InputError(
            f"{angle.min():.3g} to {angle.max():.3g} rad on axis {axis + 1}",
            column=f"{columns[axis]}_rad",
            expected=f"{low[axis]:.3g} to {high[axis]:.3g} rad, the range of axis {axis + 1} "
            f"({robot.axes[axis]}) of robot {robot.name}; is this another robot's recording, or "
            "in degrees?",
        )


def _check_torques(recording: Recording, robot: TherapyRobot) -> None:
    largest = np.abs(recording.force).max(axis=0)
    if not largest.any():
        raise InputError("the motor torques are all zero", expected="the motors' command")
    over = largest / robot.torque_limit_Nm
    axis = int(np.argmax(over))
    if over[axis] > BEYOND_TORQUE:
        unit = "; in mNm rather than N m?" if over[axis] > WRONG_UNIT else "; of another robot?"
        raise InputError(
            f"torques of axis {axis + 1} up to {largest[axis]:.4g} N m",
            column=f"tau{axis + 1}_Nm",
            expected=f"at most its motor's {robot.torque_limit_Nm[axis]:g} N m{unit}",
        )
    for dead in np.flatnonzero(largest == 0):
        if _travel(recording)[:, dead].max() > MOVES_RAD:
            raise InputError(
                f"axis {dead + 1} moves with a motor torque of zero throughout",
                column=f"tau{dead + 1}_Nm",
                expected="its motor's command",
            )


def _check_weight_and_work(recording: Recording, robot: TherapyRobot) -> None:
    from armimpedance.joint.therapy.robot.therapy_robot import robot_bodies

    bodies = robot_bodies(robot)
    starts, ends = recording.offsets[:-1], recording.offsets[1:] - 1
    middles = (starts + ends) // 2
    still = np.zeros((len(middles), robot.n_axes))
    weight = _rms(bodies.torque(recording.position[middles], still, still))
    motors = _rms(recording.force)
    if motors < LEAST_SHARE_OF_WEIGHT * weight:
        raise InputError(
            f"motor torques of {motors:.3g} N m (rms over all axes)",
            expected=f"N m that hold and move a robot whose weight asks for {weight:.3g} N m; "
            "is the unit right?",
        )
    rise = bodies.potential_J(recording.position[ends]) - bodies.potential_J(
        recording.position[starts]
    )
    work = motor_work(recording)
    # a motor does work against friction, unless a load that it lowers drives it
    counted = (_travel(recording).max(axis=1) > MOVES_RAD) & (rise > -FALLS_J)
    if work[counted].sum() < WORST_WORK * np.abs(work[counted]).sum():
        raise InputError(
            f"the motors take {-work[counted].sum():.3g} J from a robot with friction",
            expected="torques of the other sign; check force_by in recording.json",
        )


def motor_work(recording: Recording) -> FloatArray:
    """Work ``sum tau_motor dq`` over all axes of every trial, (T,), J."""
    work = np.empty(recording.n_trials)
    for row in range(recording.n_trials):
        samples = recording.samples_of(row)
        motor, q = -recording.force[samples], recording.position[samples]
        work[row] = ((motor[1:] + motor[:-1]) / 2 * np.diff(q, axis=0)).sum()
    return work


def _travel(recording: Recording) -> FloatArray:
    """Range of every axis' angle within every trial, (T, n)."""
    starts = recording.offsets[:-1]
    highest = np.maximum.reduceat(recording.position, starts, axis=0)
    return np.asarray(highest - np.minimum.reduceat(recording.position, starts, axis=0))


def _rms(torque: FloatArray) -> float:
    return float(np.sqrt((torque**2).mean()))


# Quality of the prediction of motor torques in movements that were not used for identification.

#: Below this speed friction is static and not modelled, rad/s.
LEAST_SPEED_RAD_S: Final = float(np.deg2rad(1.0))
#: Conditions of trials that were used to identify the robot.
_USED: Final = ("sweep", "hold")


@dataclass(frozen=True)
class AxisValidation:
    """Comparison of motor torque and model on one axis, over all samples of all trials.

    Attributes
    ----------
    axis : int
        Counted from 0.
    name : str
    rms_Nm, r2 : float
        (16) and (17).
    moving_rms_Nm, moving_r2 : float
        The same over samples at which the axis is faster than the least speed; NaN if there are
        none.
    moving_share : float
        Share of these samples.
    samples : int
        Number of samples.
    least_speed_rad_s : float
        The least speed at which an axis counts as moving.
    """

    axis: int
    name: str
    rms_Nm: float
    r2: float
    moving_rms_Nm: float
    moving_r2: float
    moving_share: float
    samples: int
    least_speed_rad_s: float = LEAST_SPEED_RAD_S


def validate_robot(
    recording: Recording,
    robot: TherapyRobot,
    *,
    least_speed_rad_s: float = LEAST_SPEED_RAD_S,
    step: Callable[[], object] = no_step,
) -> tuple[AxisValidation, ...]:
    """Predict the motor torques of the empty robot's movements, one result per axis.

    Parameters
    ----------
    recording : Recording
        Trials of the conditions "sweep" and "hold" are left out, since they were fitted.
    robot : TherapyRobot
        With its loads.
    least_speed_rad_s : float
        Least speed for the results without static friction.
    step : function, optional
        Called after every trial.

    Returns
    -------
    tuple of AxisValidation

    Raises
    ------
    InputError
        Not a recording of this robot, no movements in it, or a robot without loads.
    """
    predicted, measured, speed = predicted_torque(recording, robot, step)
    return tuple(
        _axis(
            axis,
            robot.axes[axis],
            measured[:, axis],
            predicted[:, axis],
            np.abs(speed[:, axis]),
            least_speed_rad_s,
        )
        for axis in range(robot.n_axes)
    )


def predicted_torque(
    recording: Recording, robot: TherapyRobot, step: Callable[[], object] = no_step
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Torques tau_r (13), tau_motor and velocities (N, n) of all movements, one after another."""
    from armimpedance.joint.therapy.robot.therapy_robot import robot_bodies

    refuse_person(recording)
    check_recording(recording, robot)
    robot.identified  # noqa: B018
    rows = np.flatnonzero(~recording.trials["condition"].astype(str).isin(_USED))
    if len(rows) == 0:
        raise InputError(
            "sweeps and holds only", column="condition", expected="movements that were not fitted"
        )
    length = recording.subject.upper_arm_m
    adjusted = robot if length is None else robot.adjusted_to(length)
    bodies = robot_bodies(adjusted)
    trials = smooth_trials(recording.select(rows))
    model = []
    for t in trials:
        # tau_r (S, n) = M qdd + C qd + G + friction, cables and spring
        model.append(bodies.torque(t.q, t.qd, t.qdd) + load_torque(adjusted, t.q, t.qd))
        step()
    return (
        np.concatenate(model),
        np.concatenate([t.motor for t in trials]),
        np.concatenate([t.qd for t in trials]),
    )


def _axis(
    axis: int,
    name: str,
    measured: FloatArray,
    predicted: FloatArray,
    speed: FloatArray,
    least_speed_rad_s: float,
) -> AxisValidation:
    moving = speed >= least_speed_rad_s
    whole = _rms_and_r2(measured, predicted)
    moved = _rms_and_r2(measured[moving], predicted[moving])
    return AxisValidation(
        axis, name, *whole, *moved, float(moving.mean()), len(measured), least_speed_rad_s
    )


def _rms_and_r2(measured: FloatArray, predicted: FloatArray) -> tuple[float, float]:
    """Root mean square (16) and R^2 (17); NaN without samples or variation."""
    if len(measured) == 0:
        return float("nan"), float("nan")
    residual = float(((measured - predicted) ** 2).sum())
    whole = float(((measured - measured.mean()) ** 2).sum())
    return float(np.sqrt(residual / len(measured))), 1 - residual / whole if whole > 0 else float(
        "nan"
    )
