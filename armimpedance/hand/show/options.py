"""Options that several verbs of the hand have."""

from __future__ import annotations

from typing import Final

from armimpedance.show.verbs.kinds import AnyWord, OneOf
from armimpedance.show.verbs.options import Option

#: The columns of the groups.
BY: Final = Option(
    "by",
    AnyWord("COLUMN", "str or sequence of str"),
    "trials alike in this column of trials.csv form a group; may be repeated (default: condition)",
    "condition",
    many=True,
    doc="columns of the trial table; trials alike in all of them form a group",
)

#: The sign of a Kinarm exam's force sensor.
FORCE_BY: Final = Option(
    "force_by",
    OneOf(values=("limb", "device")),
    "Kinarm exams: whose force on the other the sensor's columns hold",
    doc="whose force on the other a Kinarm's sensor holds",
)
