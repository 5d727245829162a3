"""ROBOT.json and ARM.json: a therapy robot and a person's passive arm, written and read back.

The fields of FIT.json stand beside the record where something was fitted, for other scripts; the
record itself is what is read again. A robot's file without loads holds its drawings only.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Final, TypeVar

from armimpedance.core.arrays import from_plain, to_plain
from armimpedance.core.errors import InputError
from armimpedance.core.json_text import Fields, read_json
from armimpedance.core.records import Subject
from armimpedance.joint.therapy.arm.passive_arm import PassiveArm
from armimpedance.joint.therapy.arm.verdict import ArmCalibration
from armimpedance.joint.therapy.robot.calibrate import RobotCalibration
from armimpedance.joint.therapy.robot.therapy_robot import TherapyRobot
from armimpedance.show.files import write_json
from armimpedance.show.verbs.results import PathLike, naming

ROBOT_FORMAT: Final = "armimpedance-robot"
ARM_FORMAT: Final = "armimpedance-arm"
VERSION: Final = 1

Record = TypeVar("Record")


def write_robot(robot: TherapyRobot | RobotCalibration, path: str | Path) -> None:
    """Write a robot; `read_robot` gives it back.

    Parameters
    ----------
    robot : TherapyRobot or RobotCalibration
        Of a calibration also what the identification says of itself.
    path : path
        ROBOT.json.

    Raises
    ------
    InputError
        The file cannot be written.
    """
    told = robot.to_dict() if isinstance(robot, RobotCalibration) else {}
    record = robot.robot if isinstance(robot, RobotCalibration) else robot
    _write(ROBOT_FORMAT, "robot", record, told, path)


def write_arm(arm: PassiveArm | ArmCalibration, path: str | Path) -> None:
    """Write a passive arm; `read_arm` gives it back.

    Parameters
    ----------
    arm : PassiveArm or ArmCalibration
        Of a calibration also what it says of itself.
    path : path
        ARM.json.

    Raises
    ------
    InputError
        The file cannot be written.
    """
    told = arm.to_dict() if isinstance(arm, ArmCalibration) else {}
    record = arm.arm if isinstance(arm, ArmCalibration) else arm
    _write(ARM_FORMAT, "arm", record, told, path)


def read_robot(path: str | Path) -> TherapyRobot:
    """A robot that `write_robot` wrote, or drawings in the same form with ``"loads": null``.

    Parameters
    ----------
    path : path
        ROBOT.json.

    Returns
    -------
    TherapyRobot
        The robot with its identified loads; drawings have none.

    Raises
    ------
    InputError
        No such file, or a field that is not what it must be.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> import armimpedance as ai
    >>> from armimpedance.lab.simulated.therapy import drawings_of
    >>> from armimpedance.joint.therapy.show import write_robot
    >>> from manipulandum_sim.therapy import therapy_device
    >>> with TemporaryDirectory() as folder:
    ...     write_robot(drawings_of(therapy_device()), Path(folder) / "robot.json")
    ...     robot = ai.read_robot(Path(folder) / "robot.json")
    >>> robot.axes
    ('elevation', 'horizontal', 'rotation', 'elbow', 'pronation')
    """
    return _read(Path(path), ROBOT_FORMAT, "robot", TherapyRobot)


def read_arm(path: str | Path) -> PassiveArm:
    """An arm that `write_arm` wrote.

    Parameters
    ----------
    path : path
        ARM.json.

    Returns
    -------
    PassiveArm
        The segments of the person's arm and the elastic torques of the axes.

    Raises
    ------
    InputError
        No such file, or a field that is not what it must be.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> import armimpedance as ai
    >>> from armimpedance.joint.therapy.show import write_arm
    >>> arm = ai.PassiveArm("P1", "bench", upper_arm_m=0.3, segments=())
    >>> with TemporaryDirectory() as folder:
    ...     write_arm(arm, Path(folder) / "arm.json")
    ...     again = ai.read_arm(Path(folder) / "arm.json")
    >>> again.subject
    'P1'
    """
    return _read(Path(path), ARM_FORMAT, "arm", PassiveArm)


def _write(
    form: str,
    name: str,
    record: TherapyRobot | PassiveArm,
    told: Mapping[str, Any],
    path: str | Path,
) -> None:
    content = {"format": form, "version": VERSION, **told, name: to_plain(record)}
    write_json(content, path)


def _read(file: Path, form: str, name: str, kind: type[Record]) -> Record:
    given = Fields(file, read_json(file))
    if given.values.get("format") != form:
        raise given.wrong("format", f'"{form}": a file that `armimpedance therapy {name}` wrote')
    if given.number("version", required=True) != VERSION:
        raise given.wrong("version", str(VERSION))
    plain = given.values.get(name)
    if not isinstance(plain, Mapping):
        raise given.wrong(name, "an object")
    try:
        return from_plain(kind, plain, name)
    except InputError as error:
        expected = error.expected or f"a file that `armimpedance therapy {name}` wrote"
        raise InputError(
            error.problem, file=file, column=error.column or name, expected=expected
        ) from None


# What the verbs of therapy are given: a robot and an arm, and whether they belong together.

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

    Raises InputError: the arm and the recording are of different subjects.
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

    Raises InputError: an axis without passive calibration, or no axis with a model.
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
