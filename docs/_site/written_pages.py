"""Write the pages that follow from the code: the faces, the commands, the columns.

They are written before Sphinx looks for sources, and only where they change.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from column_pages import column_pages
from faces import api_pages
from help_pages import command_pages
from sphinx.application import Sphinx

#: Folders that hold nothing else: what is no longer written there is taken away.
FOLDERS = ("reference/api", "reference/commands")


def setup(app: Sphinx) -> dict[str, Any]:
    """Write before the first page is read."""
    app.connect("config-inited", lambda app, _: write(Path(app.srcdir)))
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def write(source: Path) -> None:
    """Write all of them below the folder of the sources."""
    pages = {**api_pages(), **command_pages(), **column_pages()}
    for name, text in pages.items():
        path = source / f"{name}.rst"
        path.parent.mkdir(parents=True, exist_ok=True)
        if not path.exists() or path.read_text() != text:
            path.write_text(text)
    for folder in FOLDERS:
        for path in (source / folder).rglob("*.rst"):
            if str(path.relative_to(source).with_suffix("")) not in pages:
                path.unlink()
