"""How well the identified robot predicts the motor torques of movements that it has not seen."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.records import Recording
from armimpedance.joint.therapy.robot.checks import check_recording, refuse_person
from armimpedance.joint.therapy.robot.smooth import no_step, smooth_trials
from armimpedance.joint.therapy.robot.therapy_robot import TherapyRobot, load_torque

#: Below this speed friction is static, which the model leaves out, rad/s.
LEAST_SPEED_RAD_S: Final = float(np.deg2rad(1.0))
#: Trials of these conditions were used to identify the robot.
_USED: Final = ("sweep", "hold")


@dataclass(frozen=True)
class AxisValidation:
    """Motor torque against model of one axis, over all samples of all trials.

    Attributes
    ----------
    axis : int
        Counted from 0.
    name : str
    rms_Nm, r2 : float
        (16) and (17).
    moving_rms_Nm, moving_r2 : float
        The same without the samples at which the axis is slower than the least speed; NaN where
        it never is faster.
    moving_share : float
        Share of the samples that are left then.
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
        Trials of the conditions "sweep" and "hold" are left out: they were fitted.
    robot : TherapyRobot
        With its loads.
    least_speed_rad_s : float
        For the numbers without static friction.
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
    """tau_r (13), tau_motor and the velocities (N, n) of all movements, one after another."""
    from armimpedance.joint.therapy.robot.rigid import robot_bodies

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
    """(16) and (17); NaN where there is nothing to explain."""
    if len(measured) == 0:
        return float("nan"), float("nan")
    left = float(((measured - predicted) ** 2).sum())
    whole = float(((measured - measured.mean()) ** 2).sum())
    return float(np.sqrt(left / len(measured))), 1 - left / whole if whole > 0 else float("nan")
