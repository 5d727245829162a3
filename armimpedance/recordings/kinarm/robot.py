"""The robot of a Kinarm exam: which side and kind, its links, and where they put the hand."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.recordings.kinarm.exam_file import ExamFile, Samples, anything
from armimpedance.recordings.kinarm.files import Exam

Side = Literal["right", "left"]
SIDES: Final[tuple[Side, ...]] = ("right", "left")

Kind = Literal["exoskeleton", "endpoint", "unknown"]


@dataclass(frozen=True)
class Geometry:
    """Where `common.c3d` holds the lengths of one kind of robot.

    `begins`: how the robot's version begins, as in `KINARM_EP_Rev2`.
    `kind`: the links of an exoskeleton lie along the arm, its axes on the arm's joints; those of an
    endpoint robot lie where the robot was put.
    `group`, `links`: the group and the lengths of links 1 and 2 in it; ``{side}`` is RIGHT or LEFT.
    `aside`: how far the hand lies aside of link 2, towards the front on both sides; None: on it.
    """

    begins: str
    kind: Literal["exoskeleton", "endpoint"]
    group: str
    links: tuple[str, str]
    aside: str | None = None


#: The kinds of robots. Classic and newer End-Point robots state their own links; exoskeletons,
#: those for humans (H) and for monkeys (M), are set to the arm by the calibration.
GEOMETRIES: Final = (
    Geometry("KINARM_EP", "endpoint", "{side}_KINARM", ("L1_L", "L2_L")),
    *(
        Geometry(
            begins, "exoskeleton", "CALIBRATION", ("{side}_L1", "{side}_L2"), "{side}_PTR_ANTERIOR"
        )
        for begins in ("KINARM_H", "KINARM_M")
    ),
)


@dataclass(frozen=True)
class Robot:
    """One side's robot.

    `shoulder_m` (2,) or None: the robot's first axis; the subject's shoulder for an exoskeleton
    only.
    `links_m` (3,) or None: lengths of links 1 and 2, and how far the hand lies aside of link 2
    (counter-clockwise).
    """

    side: Side
    version: str
    kind: Kind
    shoulder_m: FloatArray | None
    links_m: FloatArray | None

    @property
    def lengths_m(self) -> FloatArray:
        """`links_m`, (3,), NaN where it is not known."""
        return np.full(3, np.nan) if self.links_m is None else self.links_m

    @property
    def places_hand(self) -> bool:
        """Whether the links' lengths and where they stand are known."""
        return self.shoulder_m is not None and self.links_m is not None

    def hand_position(self, link1_rad: FloatArray, link2_rad: FloatArray) -> FloatArray:
        """Where the links put the hand, (N, 2) in m; NaN where their lengths are not known.

        `link1_rad`, `link2_rad` (N,): both from the x axis.
        """
        first, second, aside = self.lengths_m
        shoulder = np.full(2, np.nan) if self.shoulder_m is None else self.shoulder_m
        along1 = np.column_stack([np.cos(link1_rad), np.sin(link1_rad)])
        along2 = np.column_stack([np.cos(link2_rad), np.sin(link2_rad)])
        across2 = np.column_stack([-along2[:, 1], along2[:, 0]])
        return shoulder + first * along1 + second * along2 + aside * across2


def robot_of(common: ExamFile, side: Side) -> Robot:
    """The robot of one side, from what all trials share, by the table `GEOMETRIES`.

    A robot whose version is not in it has no lengths: the hand is then where it was recorded.
    """
    prefix = side.upper()
    version = common.parameters.text(f"{prefix}_KINARM", "VERSION")
    shoulder = _numbers(common, "CALIBRATION", f"{prefix}_SHO_X", f"{prefix}_SHO_Y")
    geometry = next((each for each in GEOMETRIES if version.startswith(each.begins)), None)
    if geometry is None:
        return Robot(side, version or "not stated", "unknown", shoulder, None)
    group = geometry.group.format(side=prefix)
    links = _numbers(common, group, *(name.format(side=prefix) for name in geometry.links))
    beside = geometry.aside and geometry.aside.format(side=prefix)
    aside = common.parameters.number(group, beside) if beside else None
    # To the front is clockwise of a left arm's link 2.
    turn = -1.0 if side == "left" else 1.0
    lengths = None if links is None else np.append(links, turn * (aside or 0.0))
    return Robot(side, version, geometry.kind, shoulder, lengths)


def with_own_names(exam: Exam) -> tuple[Exam, list[str]]:
    """The exam with the data of its one robot under that robot's names, and a remark on it.

    Where a lab has a left robot only, its hand (and in some exams its channels) stand under the
    names of the right one. They are the left one's where the exam says that there is no right
    robot and the left names hold nothing.
    """
    if _has_robot(exam, "right") or not _has_robot(exam, "left"):
        return exam, []
    trials = [replace(trial, file=_as_left(trial.file)) for trial in exam.trials]
    moved = sum(new.file is not old.file for new, old in zip(trials, exam.trials, strict=True))
    if not moved:
        return exam, []
    remark = f"The left robot is the only one; in {moved} trials its data stand under Right_ names."
    return replace(exam, trials=tuple(trials)), [remark]


def _as_left(file: ExamFile) -> ExamFile:
    hands, channels = _moved(file.hands), _moved(file.channels)
    if hands is file.hands and channels is file.channels:
        return file
    return replace(file, hands=hands, channels=channels)


def _moved(samples: Mapping[str, Samples]) -> Mapping[str, Samples]:
    """The same with what is under a right name only moved to the left one."""

    def empty(label: str) -> bool:
        return label not in samples or not anything(samples[label])

    pairs = {n: f"Left{n[5:]}" for n in samples if n.startswith("Right_")}
    names = {right: left for right, left in pairs.items() if not empty(right) and empty(left)}
    if not names:
        return samples
    kept = {n: v for n, v in samples.items() if n not in names and n not in names.values()}
    return kept | {left: samples[right] for right, left in names.items()}


def choose_side(exam: Exam, asked: Side | None, path: object) -> Side:
    """The side that was recorded with a force sensor.

    Raises InputError: no side has forces, both have and none was asked for, or the one asked for
    has none.
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
    return exam.common.parameters.number(f"{side.upper()}_KINARM", "IS_PRESENT") != 0.0


def _trials_with_force(exam: Exam, side: Side) -> int:
    """In how many trials the sensor of a side shows anything; an absent one reads as zeros."""
    labels = [f"{side.title()}_FS_Force{axis}" for axis in "XY"]
    return sum(
        any(anything(file.channels[n]) for n in labels if n in file.channels)
        for file in (trial.file for trial in exam.trials)
    )


def _numbers(common: ExamFile, group: str, *names: str) -> FloatArray | None:
    values = [common.parameters.number(group, name) for name in names]
    if None in values:
        return None
    return np.array(values, dtype=np.float64)
