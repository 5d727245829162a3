"""ROBOT.json and ARM.json: a therapy robot and a person's passive arm, written and read back.

The fields of FIT.json stand beside the record where something was fitted, for other scripts; the
record itself is what is read again. A robot's file without loads holds its drawings only.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, TypeVar

from armimpedance.errors import InputError
from armimpedance.files.fit_json import write_json
from armimpedance.json_text import Fields, read_json
from armimpedance.plain import from_plain, to_plain
from armimpedance.regression import FitSummary
from armimpedance.therapy import PassiveArm, TherapyRobot

ROBOT_FORMAT: Final = "armimpedance-robot"
ARM_FORMAT: Final = "armimpedance-arm"
VERSION: Final = 1

Record = TypeVar("Record")


def write_robot(
    robot: TherapyRobot, path: str | Path, summary: FitSummary | None = None, **more: Any
) -> None:
    """Write a robot, and what its identification says of itself; `read_robot` gives it back."""
    _write(ROBOT_FORMAT, "robot", robot, path, summary, more)


def write_arm(
    arm: PassiveArm, path: str | Path, summary: FitSummary | None = None, **more: Any
) -> None:
    """Write a passive arm, and what its calibration says of itself; `read_arm` gives it back."""
    _write(ARM_FORMAT, "arm", arm, path, summary, more)


def read_robot(path: str | Path) -> TherapyRobot:
    """A robot that `write_robot` wrote, or drawings in the same form with ``"loads": null``.

    Raises
    ------
    InputError
        No such file, or a field that is not what it must be.
    """
    return _read(Path(path), ROBOT_FORMAT, "robot", TherapyRobot)


def read_arm(path: str | Path) -> PassiveArm:
    """An arm that `write_arm` wrote.

    Raises
    ------
    InputError
        No such file, or a field that is not what it must be.
    """
    return _read(Path(path), ARM_FORMAT, "arm", PassiveArm)


def _write(
    form: str,
    name: str,
    record: TherapyRobot | PassiveArm,
    path: str | Path,
    summary: FitSummary | None,
    more: Mapping[str, Any],
) -> None:
    told = {} if summary is None else summary.to_dict()
    content = {"format": form, "version": VERSION, **told, **more, name: to_plain(record)}
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
