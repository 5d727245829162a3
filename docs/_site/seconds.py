"""How long the code of a page runs: processor seconds of its notebook and of what that starts.

Processor seconds, and not those of a clock, for a machine may be busy with other things; one thread
each (``conf.py``), so that they are what a reader waits for. They go into the page as ``<meta>``,
and ``check_site.py`` refuses a page that takes longer than it may.
"""

from __future__ import annotations

import os
from typing import Any

from sphinx.application import Sphinx

NAME = "seconds"


def setup(app: Sphinx) -> dict[str, Any]:
    """A page is read, and its notebook runs, between two events of one process."""
    begun: dict[str, float] = {}

    def begin(_app: Sphinx, page: str, _source: list[str]) -> None:
        begun[page] = _of_children()

    def keep(app: Sphinx, _doctree: Any) -> None:
        page = app.env.docname
        if page in begun:
            app.env.metadata[page][NAME] = f"{_of_children() - begun[page]:.1f}"

    app.connect("source-read", begin)
    app.connect("doctree-read", keep)
    app.connect("html-page-context", _say)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _of_children() -> float:
    """User and system seconds of all processes that this one has started and that have ended."""
    times = os.times()
    return times.children_user + times.children_system


def _say(app: Sphinx, page: str, _template: str, context: dict[str, Any], _tree: Any) -> None:
    """Write them into the head of the page."""
    seconds = app.env.metadata.get(page, {}).get(NAME)
    if seconds is not None:
        context["metatags"] += f'\n<meta name="{NAME}" content="{seconds}">'
