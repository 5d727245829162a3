"""The options of a report."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from armimpedance.hand.show import BY, FORCE_BY
from armimpedance.hand.still.show import COVARIANCE
from armimpedance.show.pages import TOPICS
from armimpedance.show.verbs.kinds import AnyWord, OneOf, PlaceToRead, Whole
from armimpedance.show.verbs.options import DESPITE, LEAVE_OUT, Option, Verb

REPORT: Final = Verb(
    "write_report",
    (
        Option(
            "topic",
            OneOf(values=TOPICS.names),
            "default: what the source is",
            doc="a name of `TOPICS`; default: what the source is",
        ),
        replace(BY, doc="columns of the trial table whose groups are reported"),
        Option(
            "method",
            AnyWord(),
            "an estimator of the topic; all: side by side (hand)",
            doc='an estimator of the topic; "all" sets every method of the hand side by side',
        ),
        replace(COVARIANCE, help=f"of the hand: {COVARIANCE.help}"),
        Option("seed", Whole(low=0), "of what is drawn (default: {default})", 0),
        replace(FORCE_BY, doc="whose force a Kinarm's sensor holds; see `estimate`"),
        DESPITE,
        LEAVE_OUT,
        Option("robot", PlaceToRead("ROBOT.json", "path"), "of a therapy session"),
        Option("arm", PlaceToRead("ARM.json", "path"), "of a therapy session"),
    ),
)
