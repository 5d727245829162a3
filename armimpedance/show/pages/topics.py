"""The topics of the report, by the names of their files; none is imported for its name."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from armimpedance.core.method_table import FoundTable

if TYPE_CHECKING:
    from armimpedance.show.pages.asked import Topic

#: A topic's page is a file `<topic>_page.py` among its forms, with the record `TOPIC`.
TOPICS: Final[FoundTable[Topic]] = FoundTable("armimpedance", "_page", "TOPIC", "topic")
