"""The robot of a Kinarm exam: which side and kind, its links, and where they put the hand."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from armimpedance.arrays import FloatArray
from armimpedance.errors import InputError
from armimpedance.recordings.kinarm.exam_file import ExamFile
from armimpedance.recordings.kinarm.files import Exam

Side = Literal["right", "left"]
SIDES: Final[tuple[Side, ...]] = ("right", "left")

#: Beginnings of RIGHT_KINARM:VERSION. The links of an exoskeleton lie along the arm, its axes on
#: the arm's joints; those of an endpoint robot lie where the robot was put.
ENDPOINT: Final = ("KINARM_EP",)
EXOSKELETON: Final = ("KINARM_H", "KINARM_M")


@dataclass(frozen=True)
class Robot:
    """One side's robot.

    Attributes
    ----------
    kind : {"exoskeleton", "endpoint", "unknown"}
    shoulder_m : (2,) or None
        The robot's first axis; the subject's shoulder for an exoskeleton only.
    links_m : (3,) or None
        Lengths of links 1 and 2, and how far the hand lies aside of link 2 (counter-clockwise).
    """

    side: Side
    version: str
    kind: Literal["exoskeleton", "endpoint", "unknown"]
    shoulder_m: FloatArray | None
    links_m: FloatArray | None

    @property
    def lengths_m(self) -> FloatArray:
        """`links_m`, (3,), NaN where it is not known."""
        return np.full(3, np.nan) if self.links_m is None else self.links_m

    def hand_position(self, link1_rad: FloatArray, link2_rad: FloatArray) -> FloatArray | None:
        """Where the links put the hand, (N, 2) in m; None where their lengths are not known.

        Parameters
        ----------
        link1_rad, link2_rad : (N,)
            Both from the x axis.
        """
        if self.shoulder_m is None or self.links_m is None:
            return None
        first, second, aside = self.links_m
        along1 = np.column_stack([np.cos(link1_rad), np.sin(link1_rad)])
        along2 = np.column_stack([np.cos(link2_rad), np.sin(link2_rad)])
        across2 = np.column_stack([-along2[:, 1], along2[:, 0]])
        return self.shoulder_m + first * along1 + second * along2 + aside * across2


def robot_of(common: ExamFile, side: Side) -> Robot:
    """The robot of one side, from `common.c3d`.

    An endpoint robot's lengths are its own, `L1_L` and `L2_L`; an exoskeleton's are set to the
    subject's arm by the calibration, with the fingertip aside of the second link (`PTR_ANTERIOR`,
    towards the front on both sides, hence clockwise on the left).
    """
    prefix = side.upper()
    version = common.text(f"{prefix}_KINARM", "VERSION") or ""
    shoulder = _numbers(common, "CALIBRATION", f"{prefix}_SHO_X", f"{prefix}_SHO_Y")
    if version.startswith(ENDPOINT):
        links = _numbers(common, f"{prefix}_KINARM", "L1_L", "L2_L")
        lengths = None if links is None else np.append(links, 0.0)
        return Robot(side, version, "endpoint", shoulder, lengths)
    if version.startswith(EXOSKELETON):
        links = _numbers(common, "CALIBRATION", f"{prefix}_L1", f"{prefix}_L2")
        aside = common.number("CALIBRATION", f"{prefix}_PTR_ANTERIOR") or 0.0
        turn = -1.0 if side == "left" else 1.0
        lengths = None if links is None else np.append(links, turn * aside)
        return Robot(side, version, "exoskeleton", shoulder, lengths)
    return Robot(side, version or "not stated", "unknown", shoulder, None)


def choose_side(exam: Exam, asked: Side | None, path: object) -> Side:
    """The side that was recorded with a force sensor.

    Raises
    ------
    InputError
        No side has forces, both have and none was asked for, or the one asked for has none.
    """
    seen = {side: _trials_with_force(exam, side) for side in SIDES if _has_robot(exam, side)}
    # A damaged trial or two do not make an absent sensor a second arm.
    with_force = [side for side, n in seen.items() if n and 2 * n >= max(seen.values())]
    if asked is not None and not seen.get(asked):
        raise _no_force(asked, path)
    if asked is not None:
        return asked
    if not with_force:
        raise _no_force("either", path)
    if len(with_force) == 2:
        expected = "a choice: --side right or --side left"
        raise InputError("both arms were recorded", file=path, expected=expected)
    return with_force[0]


def _no_force(side: str, path: object) -> InputError:
    channel = "FS_ForceX, FS_ForceY"
    return InputError(
        f"no force of {side} side: the channels are absent or zero throughout",
        file=path,
        column=channel if side == "either" else f"{side.title()}_FS_ForceX",
        expected="a recording with a force sensor",
    )


def _has_robot(exam: Exam, side: Side) -> bool:
    # An exam that does not say whether a robot is there is judged by its channels alone.
    return exam.common.number(f"{side.upper()}_KINARM", "IS_PRESENT") != 0.0


def _trials_with_force(exam: Exam, side: Side) -> int:
    """In how many trials the sensor of a side shows anything; an absent one reads as zeros."""
    labels = [f"{side.title()}_FS_Force{axis}" for axis in "XY"]
    return sum(
        any(file.channels[n].any() for n in labels if n in file.channels)
        for file in (trial.file for trial in exam.trials)
    )


def _numbers(common: ExamFile, group: str, *names: str) -> FloatArray | None:
    values = [common.number(group, name) for name in names]
    if None in values:
        return None
    return np.array(values, dtype=np.float64)
