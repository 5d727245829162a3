"""The channels of a Kinarm exam that a recording of it does not take, in a few words."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Sequence

from armimpedance.core.not_taken import not_taken
from armimpedance.recordings.kinarm.channels import force_labels
from armimpedance.recordings.kinarm.exam_file import ExamFile, anything
from armimpedance.recordings.kinarm.robot import Side


def labels_there(files: Sequence[ExamFile]) -> set[str]:
    """Labels of all channels and hands; those that were read and are zero are nobody's."""
    there = {label for file in files for label in file.others}
    for file in files:
        read = {**file.channels, **file.hands}
        there |= {label for label in read.keys() - there if anything(read[label])}
    return there


def channels_not_taken(there: set[str], side: Side, taken: Collection[str]) -> tuple[str, ...]:
    """Sentences of the provenance on the channels that are there and not in the recording.

    Parameters
    ----------
    there : set of str
    side : {"right", "left"}
        The arm of the recording.
    taken : collection of str
        Labels that are in the recording, beside the force and the hand.
    """
    left = there - {*taken, *force_labels(side), f"{side.title()}_Hand"}
    other = "Left_" if side == "right" else "Right_"
    of_other = {label for label in left if label.startswith(other)}
    return (
        *not_taken(grouped(left - of_other), "the recording has no use for these channels"),
        *not_taken(grouped(of_other), "the other arm's"),
    )


def grouped(labels: Iterable[str]) -> list[str]:
    """Labels that differ at their end only, together: `FS_TorqueX/Y/Z`, `ACH1/2/3`."""
    ends: dict[str, list[str]] = {}
    for label in sorted(labels, key=_in_order):
        match = re.fullmatch(r"(.*[a-z_])([U-Z])|(.*?\D)(\d+)", label)
        stem, end = [part for part in match.groups() if part] if match else (label, "")
        ends.setdefault(stem, []).append(end)
    return [stem + "/".join(each) for stem, each in ends.items()]


def _in_order(label: str) -> tuple[str, int]:
    """What labels are sorted by: ACH9 before ACH10."""
    match = re.fullmatch(r"(.*?)(\d{1,9})", label)
    return (match[1], int(match[2])) if match else (label, -1)
