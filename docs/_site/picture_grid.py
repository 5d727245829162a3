"""The gallery: each picture a figure that can be linked to, and a grid of all of them first."""

from __future__ import annotations

from typing import Any

from docutils import nodes
from sphinx.application import Sphinx

PAGE = "gallery"


def setup(app: Sphinx) -> dict[str, Any]:
    """Change the gallery's page once it is read."""
    app.connect("doctree-read", _arrange)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _arrange(app: Sphinx, doctree: nodes.document) -> None:
    if app.env.docname != PAGE:
        return
    grid = nodes.container(classes=["picture-grid"])
    for number, image in enumerate(doctree.findall(nodes.image)):
        name = f"picture-{number + 1}"
        image["ids"].append(name)
        small = nodes.image(uri=image["uri"], candidates=image.get("candidates", {}), alt="")
        link = nodes.reference("", "", internal=True, refid=name, classes=["picture-link"])
        link += [small, nodes.inline(text=image.get("alt", ""))]
        grid += nodes.paragraph("", "", link)
    section = next(doctree.findall(nodes.section))
    section.insert(2, grid)
