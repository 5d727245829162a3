"""Reading and writing of ROBOT.json and ARM.json: a therapy robot and a person's passive arm.

After a fit, the fields of FIT.json are in the same file, for other scripts; only the record itself
is read again. A robot's file without loads has only its drawings.
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
    """Write a robot; `read_robot` reads it.

    Parameters
    ----------
    robot : TherapyRobot or RobotCalibration
        With a calibration, the results of the identification are written too.
    path : path
        ROBOT.json.

    Raises
    ------
    InputError
        The file cannot be written.
    """
    fields = robot.to_dict() if isinstance(robot, RobotCalibration) else {}
    record = robot.robot if isinstance(robot, RobotCalibration) else robot
    _write(ROBOT_FORMAT, "robot", record, fields, path)


def write_arm(arm: PassiveArm | ArmCalibration, path: str | Path) -> None:
    """Write a passive arm; `read_arm` reads it.

    Parameters
    ----------
    arm : PassiveArm or ArmCalibration
        With a calibration, its results are written too.
    path : path
        ARM.json.

    Raises
    ------
    InputError
        The file cannot be written.
    """
    fields = arm.to_dict() if isinstance(arm, ArmCalibration) else {}
    record = arm.arm if isinstance(arm, ArmCalibration) else arm
    _write(ARM_FORMAT, "arm", record, fields, path)


def read_robot(path: str | Path) -> TherapyRobot:
    """Read a robot from `write_robot`, or drawings in the same form with ``"loads": null``.

    Parameters
    ----------
    path : path
        ROBOT.json.

    Returns
    -------
    TherapyRobot
        Robot with its identified loads; drawings have none.

    Raises
    ------
    InputError
        There is no such file, or a field is not valid.

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
    """Read a passive arm from `write_arm`.

    Parameters
    ----------
    path : path
        ARM.json.

    Returns
    -------
    PassiveArm
        Segments of the person's arm and elastic torques of the axes.

    Raises
    ------
    InputError
        There is no such file, or a field is not valid.

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
    fields: Mapping[str, Any],
    path: str | Path,
) -> None:
    content = {"format": form, "version": VERSION, **fields, name: to_plain(record)}
    write_json(content, path)


def _read(file: Path, form: str, name: str, kind: type[Record]) -> Record:
    fields = Fields(file, read_json(file))
    if fields.values.get("format") != form:
        raise fields.wrong("format", f'"{form}": a file that `armimpedance therapy {name}` wrote')
    if fields.number("version", required=True) != VERSION:
        raise fields.wrong("version", str(VERSION))
    plain = fields.values.get(name)
    if not isinstance(plain, Mapping):
        raise fields.wrong(name, "an object")
    try:
        return from_plain(kind, plain, name)
    except InputError as error:
        expected = error.expected or f"a file that `armimpedance therapy {name}` wrote"
        raise InputError(
            error.problem, file=file, column=error.column or name, expected=expected
        ) from None


# Arguments of the verbs of therapy: a robot and an arm, and checks that they belong together.

Robot = TherapyRobot | RobotCalibration | PathLike
Arm = PassiveArm | ArmCalibration | PathLike

#: Difference below which two lengths of the upper arm are equal, m.
_SAME_LENGTH_M: Final = 1e-3


def robot_of(robot: Robot) -> TherapyRobot:
    """The robot itself, read from its file if `robot` is a path."""
    if isinstance(robot, RobotCalibration):
        return robot.robot
    return robot if isinstance(robot, TherapyRobot) else read_robot(Path(robot))


def identified_robot(robot: Robot) -> TherapyRobot:
    """Robot with known loads; errors name its file."""
    identified = robot_of(robot)
    with naming(robot):
        identified.identified  # noqa: B018 - refuses a robot that was not identified
    return identified


def arm_of(arm: Arm) -> PassiveArm:
    """The arm itself, read from its file if `arm` is a path."""
    if isinstance(arm, ArmCalibration):
        return arm.arm
    return arm if isinstance(arm, PassiveArm) else read_arm(Path(arm))


def refuse_other_robot(arm: PassiveArm, identified: TherapyRobot, robot: Robot) -> None:
    """Refuse an arm that was measured in another robot; `robot` is the caller's argument."""
    if arm.robot == identified.name:
        return
    of_file = f", the robot of {robot}" if isinstance(robot, str | os.PathLike) else ""
    raise InputError(
        f"the arm of subject {arm.subject} was measured in the robot {arm.robot!r}",
        expected=f"one measured in {identified.name!r}{of_file}",
    )


def notes_on_person(arm: PassiveArm, subject: Subject) -> tuple[str, ...]:
    """A note if the robot was adjusted to another length; another person's arm is refused.

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
    """Moving axes without a passive model, each with a sentence with the reason.

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
