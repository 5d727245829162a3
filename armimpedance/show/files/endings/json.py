"""JSON: matrices nested where the result has them, else a list of objects."""

from __future__ import annotations

from pathlib import Path

from armimpedance.show.files.content import Content
from armimpedance.show.files.endings import Ending


def write(content: Content, path: Path) -> None:
    """Write the objects of the result, or one object a row."""
    from armimpedance.core.json_text import json_text

    rows = [{name: row.get(name) for name in content.columns} for row in content.rows]
    path.write_text(json_text(rows if content.objects is None else content.objects()), "utf-8")


ENDING = Ending("nested matrices, for scripts", write, long=True)
