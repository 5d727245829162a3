"""What the verbs of therapy are given: a robot and an arm, and whether they belong together."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Final

from armimpedance.core.errors import InputError
from armimpedance.core.records import Subject
from armimpedance.joint.therapy.arm.calibration import ArmCalibration
from armimpedance.joint.therapy.arm.passive_arm import PassiveArm
from armimpedance.joint.therapy.robot.calibrate import RobotCalibration
from armimpedance.joint.therapy.robot.therapy_robot import TherapyRobot
from armimpedance.joint.therapy.show.models_json import read_arm, read_robot
from armimpedance.show.verbs.sources import PathLike, naming

Robot = TherapyRobot | RobotCalibration | PathLike
Arm = PassiveArm | ArmCalibration | PathLike

#: Lengths of the upper arm that differ by less than this are the same, m.
_SAME_LENGTH_M: Final = 1e-3


def robot_of(robot: Robot) -> TherapyRobot:
    """The robot itself, read from its file where that is given."""
    if isinstance(robot, RobotCalibration):
        return robot.robot
    return robot if isinstance(robot, TherapyRobot) else read_robot(Path(robot))


def identified_robot(robot: Robot) -> TherapyRobot:
    """A robot whose loads are known; errors name the file at fault."""
    known = robot_of(robot)
    with naming(robot):
        known.identified  # noqa: B018 - refuses a robot that was not identified
    return known


def arm_of(arm: Arm) -> PassiveArm:
    """The arm itself, read from its file where that is given."""
    if isinstance(arm, ArmCalibration):
        return arm.arm
    return arm if isinstance(arm, PassiveArm) else read_arm(Path(arm))


def refuse_other_robot(arm: PassiveArm, identified: TherapyRobot, robot: Robot) -> None:
    """Refuse an arm that was measured in another robot; `robot` is what the caller gave."""
    if arm.robot == identified.name:
        return
    of_file = f", the robot of {robot}" if isinstance(robot, str | os.PathLike) else ""
    raise InputError(
        f"the arm of subject {arm.subject} was measured in the robot {arm.robot!r}",
        expected=f"one measured in {identified.name!r}{of_file}",
    )


def notes_on_person(arm: PassiveArm, subject: Subject) -> tuple[str, ...]:
    """A note where the robot was adjusted differently; another person's arm is refused.

    Raises
    ------
    InputError
        The arm and the recording are of different subjects.
    """
    if Subject.id not in (arm.subject, subject.id) and arm.subject != subject.id:
        raise InputError(
            f"the passive arm of subject {arm.subject}",
            expected=f"that of subject {subject.id}, whose recording this is",
        )
    length = subject.upper_arm_m
    if length is None or abs(length - arm.upper_arm_m) < _SAME_LENGTH_M:
        return ()
    return (
        f"the robot was adjusted to {arm.upper_arm_m:.3f} m when the arm was measured, and "
        f"that was used; the recording says {length:.3f} m",
    )


def axes_without_model(axes: Iterable[str], arm: PassiveArm, unrepeatable: bool) -> dict[str, str]:
    """The moving axes that have no passive model, each with a sentence that says why.

    Raises
    ------
    InputError
        An axis without passive calibration, or no axis with a model.
    """
    moving = [arm.elastic_of(axis) for axis in dict.fromkeys(axes)]
    refused = {
        e.axis: f"subject {arm.subject}: axis {e.axis} has no passive model, {e.verdict}"
        for e in moving
        if not (e.repeatable or unrepeatable)
    }
    if len(refused) == len(moving):
        raise InputError(
            next(iter(refused.values())),
            expected="passive repetitions that agree, or --unrepeatable to go on with these",
        )
    return {axis: f"{problem}; --unrepeatable goes on" for axis, problem in refused.items()}
