"""Draw docs/project/house.svg: the rooms of `armimpedance`, upper above those they may import.

Standard library only; run ``python docs/draw_house.py`` after a room has come, gone or moved. The
order stands in `docs/project/data_flow.md`, what a room is for in the first sentence of its own
docstring.
"""

from __future__ import annotations

import ast
import re
from html import escape
from pathlib import Path
from textwrap import wrap

DOCS = Path(__file__).resolve().parent
PAGES = DOCS / "project"
PACKAGE = DOCS.parent / "armimpedance"
WIDTH, LINE, PAD, GAP = 1000, 14, 10, 8
#: Letters of the second line that fit into a box of so many points.
POINTS_PER_LETTER = 5.6


def floors() -> list[list[str]]:
    """Rooms and modules of each floor, the highest first, as `data_flow.md` lists them."""
    page = (PAGES / "data_flow.md").read_text(encoding="utf-8")
    listed = page.split("## Rooms and their faces")[1].split("```")[1]
    return [line.split(" | ") for line in listed.strip().splitlines()]


def purpose(room: str) -> str:
    """The first sentence of a room's or module's docstring."""
    folder = PACKAGE / room
    file = folder / "__init__.py" if folder.is_dir() else folder.with_suffix(".py")
    first = (ast.get_docstring(ast.parse(file.read_text(encoding="utf-8"))) or "").split("\n\n")[0]
    return " ".join(re.split(r"(?<=\.)\s", first.replace("`", ""), maxsplit=1)[0].split())


def floor(rooms: list[str], y: float) -> tuple[list[str], float]:
    """Boxes of one floor, and how high they are."""
    width = (WIDTH - 2 * PAD - GAP * (len(rooms) - 1)) / len(rooms)
    texts = [wrap(purpose(room), int((width - 2 * PAD) / POINTS_PER_LETTER)) for room in rooms]
    height = 2 * PAD + LINE * (1 + max(map(len, texts)))
    drawn = []
    for i, (room, lines) in enumerate(zip(rooms, texts, strict=True)):
        x = PAD + i * (width + GAP)
        is_folder = (PACKAGE / room).is_dir()
        fill, edge = ("#e8f1fa", "#0072B2") if is_folder else ("#f4f4f4", "#777")
        drawn.append(
            f'<rect x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="{height}" rx="5" '
            f'fill="{fill}" stroke="{edge}"/>'
        )
        for row, (text, look) in enumerate(
            [(room, 'font-weight="bold" font-size="13"'), *((t, 'font-size="11"') for t in lines)]
        ):
            drawn.append(
                f'<text x="{x + PAD:.1f}" y="{y + PAD + LINE * (row + 0.8):.1f}" {look} '
                f'fill="#222">{escape(text)}</text>'
            )
    return drawn, height


def picture() -> str:
    """The whole drawing as SVG."""
    parts, y = [], float(PAD)
    for rooms in floors():
        drawn, height = floor(rooms, y)
        parts += drawn
        y += height + GAP
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {y + PAD:.0f}" '
        'font-family="Helvetica, Arial, sans-serif" role="img" aria-label="The rooms of '
        'armimpedance: each may import those below it">'
    )
    ground = f'<rect width="{WIDTH}" height="{y + PAD:.0f}" fill="#fff"/>'
    return "\n".join([head, ground, *parts, "</svg>"]) + "\n"


if __name__ == "__main__":
    (PAGES / "house.svg").write_text(picture(), encoding="utf-8")
