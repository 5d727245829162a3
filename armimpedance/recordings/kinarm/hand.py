"""Where the hand of a Kinarm exam is: from the links' angles, held against the recorded hand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from armimpedance.arrays import FloatArray
from armimpedance.errors import InputError
from armimpedance.recordings.kinarm.channels import channels, link_labels
from armimpedance.recordings.kinarm.exam_file import ExamFile
from armimpedance.recordings.kinarm.robot import Robot

#: The hand as recorded and as its links put it agree within 0.001 mm in a real exam.
HAND_TOLERANCE_M: Final = 1e-4

#: What a handle's fitted place may leave: single precision in the file, of a metre.
FITTED_TOLERANCE_M: Final = 2e-6


@dataclass(frozen=True)
class Hand:
    """Where the hand was.

    Attributes
    ----------
    position : (N, 2)
        In the robot's frame, all trials one after another.
    robot : Robot
        With the handle where it was found.
    source : str
        A sentence on where the position is from.
    """

    position: FloatArray
    robot: Robot
    source: str


def hand_position(files: Sequence[ExamFile], robot: Robot) -> Hand:
    """Position of the hand in the robot's frame.

    Where the handle is not at the end of link 2 as `common.c3d` has it, its place on link 2 is
    fitted to the recorded hand.

    Parameters
    ----------
    files : sequence of ExamFile
        One per trial, sound.
    robot : Robot

    Returns
    -------
    Hand

    Raises
    ------
    InputError
        Neither the hand nor the links are there.
    """
    hand, angles = f"{robot.side.title()}_Hand", link_labels(robot.side)
    recorded = _recorded_hand(files, hand)
    links, from_links = None, None
    if all(label in file.channels for label in angles for file in files):
        links = channels(files, *angles)
        from_links = robot.hand_position(*links.T)
    if recorded is None:
        if from_links is None:
            problem = "neither the hand nor the link angles with the links' lengths are there"
            raise InputError(problem, file=files[0].name, expected=hand)
        text = "Hand position: from the link angles, with no recorded hand to check."
        return Hand(from_links, robot, text)
    if from_links is None or links is None:
        text = "Hand position: as recorded (the links' lengths are not known)."
        return Hand(recorded, robot, text)
    apart_m = _farthest(from_links, recorded)
    if apart_m > FITTED_TOLERANCE_M:
        fitted = _with_handle(robot, links, recorded)
        placed = fitted.hand_position(*links.T)
        if placed is not None and _farthest(placed, recorded) <= FITTED_TOLERANCE_M:
            return Hand(placed, fitted, _told_handle(robot, fitted, _farthest(placed, recorded)))
    if apart_m > HAND_TOLERANCE_M:
        text = (
            "Hand position: as recorded; the one from the link angles is up to "
            f"{1e3 * apart_m:.3g} mm away, which no place of the handle on link 2 explains: the "
            "links' lengths cannot be right."
        )
        return Hand(recorded, robot, text)
    text = (
        f"Hand position: from the link angles, within {1e3 * apart_m:.2g} mm of the recorded hand."
    )
    return Hand(from_links, robot, text)


def _farthest(a: FloatArray, b: FloatArray) -> float:
    return float(np.linalg.norm(a - b, axis=1).max())


def _with_handle(robot: Robot, links: FloatArray, recorded: FloatArray) -> Robot:
    """The robot with its handle on link 2 where the recorded hand, (N, 2), puts it."""
    # [u(a2)  n(a2)] (2 N, 2) times [along, aside] = hand - shoulder - L1 u(a1) (2 N), by least
    # squares; u is the direction of link 2, n across it, counter-clockwise.
    at = [
        replace(robot, links_m=np.append(robot.lengths_m[:1], place)).hand_position(*links.T)
        for place in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))
    ]
    elbow, along, aside = (np.asarray(each) for each in at)
    columns = np.column_stack([(along - elbow).ravel(), (aside - elbow).ravel()])
    place = np.linalg.lstsq(columns, (recorded - elbow).ravel(), rcond=None)[0]
    return replace(robot, links_m=np.append(robot.lengths_m[:1], place))


def _told_handle(robot: Robot, fitted: Robot, left_m: float) -> str:
    along, aside = 1e3 * (fitted.lengths_m - robot.lengths_m)[1:]
    return (
        "Hand position: from the link angles; the handle lies "
        f"{_plain(aside)} mm across link 2 (counter-clockwise positive) and {_plain(along)} mm "
        "beyond its stated length, fitted to the recorded hand, which leaves "
        f"{1e3 * left_m:.2g} mm."
    )


def _plain(millimetres: float) -> str:
    """To a thousandth of a millimetre, never minus zero."""
    return f"{round(millimetres, 3) + 0.0:.3f}"


def _recorded_hand(files: Sequence[ExamFile], label: str) -> FloatArray | None:
    """The recorded hand, (N, 2) in m; None where it is absent or zero throughout."""
    if any(label not in file.hands for file in files):
        return None
    hand = np.concatenate([file.place(label) for file in files])
    return hand if hand.any() else None
