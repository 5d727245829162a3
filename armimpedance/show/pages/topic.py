"""A topic of the report: which sources are its own, and how they become a page."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from armimpedance.core.method_table import PlacedTable
from armimpedance.show.pages.asked import Asked
from armimpedance.show.pages.page import Page


@dataclass(frozen=True)
class Topic:
    """One topic; its name is that of `PLACES`.

    Attributes
    ----------
    what : str
        What it reports, for help texts.
    page_of : function
        From what was asked to the page; an `InputError` says what cannot be read, or which check
        stops the analysis.
    """

    what: str
    page_of: Callable[[Asked], Page]


#: Topic -> the module with its page, in the folder of the topic.
PLACES: Final = {
    "body": "armimpedance.joint.body.show.page",
    "comparison": "armimpedance.hand.comparison.show.page",
    "elbow": "armimpedance.joint.elbow.show.page",
    "elbow_emg": "armimpedance.joint.elbow.show.emg_page",
    "elbow_over_time": "armimpedance.joint.elbow.show.over_time_page",
    "fit": "armimpedance.show.pages.any_fit",
    "hand": "armimpedance.hand.still.show.page",
    "joint": "armimpedance.hand.levels.show.page",
    "muscle": "armimpedance.muscles.show.page",
    "passive": "armimpedance.joint.relaxed.show.page",
    "reflex": "armimpedance.hand.still.show.reflex_page",
    "therapy": "armimpedance.joint.therapy.show.page",
}

TOPICS: Final[PlacedTable[Topic]] = PlacedTable(PLACES, "TOPIC", "topic")
