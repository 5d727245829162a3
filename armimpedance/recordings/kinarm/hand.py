"""Hand position in a Kinarm exam: from the links' angles, compared with the recorded hand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.recordings.kinarm.channels import channels, link_labels
from armimpedance.recordings.kinarm.exam_file import ExamFile, anything, joined
from armimpedance.recordings.kinarm.robot import GEOMETRIES, Robot

#: Largest difference of the recorded hand and that from the links; in a real exam it is 0.001 mm.
HAND_TOLERANCE_M: Final = 1e-4

#: Largest residual with a fitted handle: single precision of positions of about a metre.
FITTED_TOLERANCE_M: Final = 2e-6


@dataclass(frozen=True)
class Hand:
    """Position of the hand and its source.

    `position` (N, 2): in the robot's frame, all trials one after another, m.
    `robot`: with the fitted position of the handle.
    `source`: a sentence on the source of the position.
    """

    position: FloatArray
    robot: Robot
    source: str


def hand_position(files: Sequence[ExamFile], robot: Robot) -> Hand:
    """Determine the position of the hand in the robot's frame.

    If the handle is not at the end of link 2 as stated in `common.c3d`, its position on link 2 is
    fitted to the recorded hand.

    `files`: one valid file per trial.
    Raises InputError: the files have neither the hand nor the links.
    """
    hand = f"{robot.side.title()}_Hand"
    seen = all(hand in file.hands for file in files) and any(
        anything(file.hands[hand]) for file in files
    )
    linked = robot.places_hand and all(
        label in file.channels for label in link_labels(robot.side) for file in files
    )
    if not linked and not seen:
        problem = "neither the hand nor the link angles with the links' lengths are there"
        raise InputError(problem, file=files[0].name, expected=hand)
    if not linked:
        text = f"Hand position: as recorded ({_why_not(robot)})."
        return Hand(_recorded(files, hand), robot, text)
    if not seen:
        text = "Hand position: from the link angles, with no recorded hand to check."
        return Hand(_from_links(files, robot), robot, text)
    return _checked_hand(files, robot, hand)


def _why_not(robot: Robot) -> str:
    if robot.kind == "unknown":
        known = ", ".join(f"{geometry.begins}..." for geometry in GEOMETRIES)
        return f"the geometry of the robot {robot.version} is not known, those of {known} are"
    return "the links' lengths are not known"


def _checked_hand(files: Sequence[ExamFile], robot: Robot, hand: str) -> Hand:
    """Hand from the links if the recorded hand agrees, with a fitted handle if necessary."""
    error_m = _farthest(files, robot, hand)
    if error_m > FITTED_TOLERANCE_M:
        fitted = _with_handle(files, robot, hand)
        residual_m = _farthest(files, fitted, hand)
        if residual_m <= FITTED_TOLERANCE_M:
            sentence = _handle_sentence(robot, fitted, residual_m)
            return Hand(_from_links(files, fitted), fitted, sentence)
    if error_m > HAND_TOLERANCE_M:
        text = (
            "Hand position: as recorded; the one from the link angles is up to "
            f"{1e3 * error_m:.3g} mm away, which no place of the handle on link 2 explains: the "
            "links' lengths cannot be right."
        )
        return Hand(_recorded(files, hand), robot, text)
    text = (
        f"Hand position: from the link angles, within {1e3 * error_m:.2g} mm of the recorded hand."
    )
    return Hand(_from_links(files, robot), robot, text)


def _recorded(files: Sequence[ExamFile], hand: str) -> FloatArray:
    return joined([file.frames for file in files], (file.place(hand) for file in files), 2)


def _from_links(files: Sequence[ExamFile], robot: Robot) -> FloatArray:
    return joined([file.frames for file in files], (_placed(file, robot) for file in files), 2)


def _placed(file: ExamFile, robot: Robot) -> FloatArray:
    """Hand position from the links of one trial, (F, 2), m."""
    return robot.hand_position(*channels([file], *link_labels(robot.side)).T)


def _farthest(files: Sequence[ExamFile], robot: Robot, hand: str) -> float:
    """Largest distance between the hand from the links and the recorded hand, m."""
    differences = (_placed(file, robot) - file.place(hand) for file in files)
    return max(float(np.linalg.norm(difference, axis=1).max()) for difference in differences)


def _with_handle(files: Sequence[ExamFile], robot: Robot, hand: str) -> Robot:
    """Fit the position of the handle on link 2 to the recorded hand."""
    # [u(a2)  n(a2)] (2 N, 2) times [along, aside] = hand - shoulder - L1 u(a1) (2 N), by least
    # squares; u is the direction of link 2, n across it, counter-clockwise. For each trial only the
    # triangular factor of both sides is needed.
    probes = [
        replace(robot, links_m=np.append(robot.lengths_m[:1], offset))
        for offset in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))
    ]
    factors = []
    for file in files:
        elbow, along, aside = (_placed(file, probe) for probe in probes)
        sides = (along - elbow, aside - elbow, file.place(hand) - elbow)
        factors.append(np.linalg.qr(np.column_stack([s.ravel() for s in sides]), mode="r"))
    both = np.concatenate(factors)
    offset = np.linalg.lstsq(both[:, :2], both[:, 2], rcond=None)[0]
    return replace(robot, links_m=np.append(robot.lengths_m[:1], offset))


def _handle_sentence(robot: Robot, fitted: Robot, residual_m: float) -> str:
    along, aside = 1e3 * (fitted.lengths_m - robot.lengths_m)[1:]
    return (
        "Hand position: from the link angles; the handle lies "
        f"{_plain(aside)} mm across link 2 (counter-clockwise positive) and {_plain(along)} mm "
        "beyond its stated length, fitted to the recorded hand, which leaves "
        f"{1e3 * residual_m:.2g} mm."
    )


def _plain(millimetres: float) -> str:
    """Text with three decimals, without minus zero."""
    return f"{round(millimetres, 3) + 0.0:.3f}"
