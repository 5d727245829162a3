"""The robot of a Kinarm exam: side, kind, links, and the position of the hand."""

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
    """Parameters of `common.c3d` with the lengths of one kind of robot.

    `begins`: beginning of the robot's version, as in `KINARM_EP_Rev2`.
    `kind`: the links of an exoskeleton lie along the arm, with axes at the arm's joints; those of
    an endpoint robot do not.
    `group`, `links`: the group and the lengths of links 1 and 2 in it; ``{side}`` is RIGHT or LEFT.
    `aside`: parameter of the hand's distance from the axis of link 2, positive to the front; None:
    no distance.
    """

    begins: str
    kind: Literal["exoskeleton", "endpoint"]
    group: str
    links: tuple[str, str]
    aside: str | None = None


#: Known kinds of robots. Classic and newer End-Point robots state their own links; exoskeletons,
#: for humans (H) and for monkeys (M), are adjusted to the arm by the calibration.
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

    `shoulder_m` (2,) or None: the robot's first axis, which is the subject's shoulder only for an
    exoskeleton.
    `links_m` (3,) or None: lengths of links 1 and 2, and distance of the hand from the axis of
    link 2 (positive counter-clockwise).
    """

    side: Side
    version: str
    kind: Kind
    shoulder_m: FloatArray | None
    links_m: FloatArray | None

    @property
    def lengths_m(self) -> FloatArray:
        """Lengths `links_m` (3,); NaN if they are not known."""
        return np.full(3, np.nan) if self.links_m is None else self.links_m

    @property
    def places_hand(self) -> bool:
        """True if the links' lengths and the position of the robot are known."""
        return self.shoulder_m is not None and self.links_m is not None

    def hand_position(self, link1_rad: FloatArray, link2_rad: FloatArray) -> FloatArray:
        """Hand position from the link angles, (N, 2), m; NaN if the lengths are not known.

        `link1_rad`, `link2_rad` (N,): angles, both from the x axis.
        """
        first, second, aside = self.lengths_m
        shoulder = np.full(2, np.nan) if self.shoulder_m is None else self.shoulder_m
        along1 = np.column_stack([np.cos(link1_rad), np.sin(link1_rad)])
        along2 = np.column_stack([np.cos(link2_rad), np.sin(link2_rad)])
        across2 = np.column_stack([-along2[:, 1], along2[:, 0]])
        return shoulder + first * along1 + second * along2 + aside * across2


def robot_of(common: ExamFile, side: Side) -> Robot:
    """Return the robot of one side, from the common data and the table `GEOMETRIES`.

    A robot whose version is not in the table has no lengths: the recorded hand is then used.
    """
    prefix = side.upper()
    version = common.parameters.text(f"{prefix}_KINARM", "VERSION")
    shoulder = _numbers(common, "CALIBRATION", f"{prefix}_SHO_X", f"{prefix}_SHO_Y")
    geometry = next(
        (
            known_geometry
            for known_geometry in GEOMETRIES
            if version.startswith(known_geometry.begins)
        ),
        None,
    )
    if geometry is None:
        return Robot(side, version or "not stated", "unknown", shoulder, None)
    group = geometry.group.format(side=prefix)
    links = _numbers(common, group, *(name.format(side=prefix) for name in geometry.links))
    aside_name = geometry.aside and geometry.aside.format(side=prefix)
    aside = common.parameters.number(group, aside_name) if aside_name else None
    # the front is clockwise of a left arm's link 2
    turn = -1.0 if side == "left" else 1.0
    lengths = None if links is None else np.append(links, turn * (aside or 0.0))
    return Robot(side, version, geometry.kind, shoulder, lengths)


def with_own_names(exam: Exam) -> tuple[Exam, list[str]]:
    """Rename the data of an exam's only robot to that robot's names; return a remark on it.

    If a lab has only a left robot, its hand (and in some exams its channels) have the names of the
    right one. They are renamed if the exam states that there is no right robot and the left names
    hold no data.
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
    """Rename right-hand samples to left-hand names, if only the right names hold data."""

    def empty(label: str) -> bool:
        return label not in samples or not anything(samples[label])

    pairs = {n: f"Left{n[5:]}" for n in samples if n.startswith("Right_")}
    names = {right: left for right, left in pairs.items() if not empty(right) and empty(left)}
    if not names:
        return samples
    kept = {n: v for n, v in samples.items() if n not in names and n not in names.values()}
    return kept | {left: samples[right] for right, left in names.items()}


def choose_side(exam: Exam, asked: Side | None, path: object) -> Side:
    """Return the side that was recorded with a force sensor.

    Raises InputError: no side has forces, both have and no side was requested, or the requested
    side has none.
    """
    counts = {side: _trials_with_force(exam, side) for side in SIDES if _has_robot(exam, side)}
    # one or two damaged trials of an absent sensor do not count as a second arm
    with_force = [side for side, n in counts.items() if n and 2 * n >= max(counts.values())]
    if asked is not None and not counts.get(asked):
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
    # an exam that does not state whether a robot is present is judged by its channels only
    return exam.common.parameters.number(f"{side.upper()}_KINARM", "IS_PRESENT") != 0.0


def _trials_with_force(exam: Exam, side: Side) -> int:
    """Number of trials in which a side's sensor is not zero; an absent sensor reads zero."""
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
