"""What the theme's pages lack for readers who listen: names of buttons, lists that are lists."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx

#: A button's spoken name has to hold the words that it shows.
_SEARCH = ('title="Search" aria-label="Search"', 'title="Search" aria-label="Search Ctrl+K"')
#: A summary that shows nothing but an arrow.
_TOGGLE = ("<summary><span", '<summary aria-label="Pages below"><span')
_SIGNATURE = re.compile(r'(<span class="sig-paren">\(</span>\s*)<dl>(.*?)</dl>', re.DOTALL)
_EMPTY_HEAD = re.compile(r'<th class="head(?:\s[^"]*)?">(?:<p></p>)?</th>')


def setup(app: Sphinx) -> dict[str, Any]:
    """Change the pages once they are written."""
    app.connect("build-finished", _finish)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _finish(app: Sphinx, error: Exception | None) -> None:
    if error is not None or app.builder.format != "html":
        return
    for page in Path(app.outdir).rglob("*.html"):
        text = page.read_text()
        changed = _EMPTY_HEAD.sub("<td></td>", _SIGNATURE.sub(_as_blocks, text))
        changed = changed.replace(*_SEARCH).replace(*_TOGGLE)
        if changed != text:
            page.write_text(changed)


def _as_blocks(found: re.Match[str]) -> str:
    """A signature over several lines, which Sphinx writes as definitions without terms."""
    lines = found[2].replace("<dd>", '<span class="sig-list">').replace("</dd>", "</span>")
    return f"{found[1]}{lines}"
