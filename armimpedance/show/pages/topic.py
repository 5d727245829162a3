"""A topic of the report: which sources are its own, and how they become a page."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from armimpedance.core.method_table import FoundTable
from armimpedance.show.pages.asked import Asked
from armimpedance.show.pages.page import Page


@dataclass(frozen=True)
class Topic:
    """One topic; its name is that of its file.

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


#: A topic's page is a file `<topic>_page.py` among its forms, with the record `TOPIC`.
TOPICS: Final[FoundTable[Topic]] = FoundTable("armimpedance", "_page", "TOPIC", "topic")
