"""The shortest use of a name that is kept right by its own checks, where the docstring has none."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from textwrap import dedent

ROOT = Path(__file__).resolve().parents[2]
#: Where a use is looked for -> what it is; a test shows most and is taken before all others.
PLACES = {
    "tests": "A test that uses it",
    "figures": "A figure that uses it",
    "benchmarks": "A study that uses it",
    "armimpedance": "Where another room uses it",
}
#: A longer use shows too much beside the name.
MOST_LINES = 30
SINGLE = (ast.Assign, ast.AnnAssign, ast.Expr, ast.Return)


@dataclass(frozen=True)
class Use:
    """A function or statement, what it is, and where it stands."""

    what: str
    where: str
    source: str


def use_of(room: str, name: str) -> Use | None:
    """The shortest use outside of the room, of a file that imports the name from it.

    A function that is short enough to be read, else a single statement.
    """
    for whole in (True, False):
        for place in PLACES:
            use = _uses(place, whole).get((room, name))
            if use is not None:
                return use
    return None


@cache
def _uses(place: str, whole: bool) -> dict[tuple[str, str], Use]:
    found: dict[tuple[str, str], Use] = {}
    for file in sorted((ROOT / place).rglob("*.py")):
        text = file.read_text()
        if "armimpedance." not in text:
            continue
        lines, tree = text.splitlines(), ast.parse(text)
        own = ".".join(file.relative_to(ROOT / place).parts) if place == "armimpedance" else ""
        imported = {k: local for k, local in _imported(tree) if not own.startswith(f"{k[0]}.")}
        for title, node, last in _pieces(tree, place, whole) if imported else ():
            parts = (part for part in ast.walk(node) if isinstance(part, ast.Name))
            names = {part.id for part in parts if part.lineno <= last}
            source = dedent("\n".join(lines[node.lineno - 1 : last]))
            use = Use(PLACES[place], f"{file.relative_to(ROOT)}{title}", source)
            for key in (key for key, local in imported.items() if local in names):
                known = found.get(key)
                if known is None or len(source) < len(known.source):
                    found[key] = use
    return found


def _imported(tree: ast.Module) -> Iterator[tuple[tuple[str, str], str]]:
    """((Room, name), name in the file) of what is imported from us, inside of functions too."""
    for node in ast.walk(tree):
        parts = (node.module or "").split(".") if isinstance(node, ast.ImportFrom) else []
        if isinstance(node, ast.ImportFrom) and parts[:1] == ["armimpedance"] and parts[1:]:
            rooms = (".".join(parts[1:k]) for k in range(2, len(parts) + 1))
            yield from (((r, p.name), p.asname or p.name) for r in rooms for p in node.names)


def _pieces(tree: ast.Module, place: str, whole: bool) -> Iterator[tuple[str, ast.stmt, int]]:
    """What may be shown of a file, each with its last line.

    Whole functions, of tests the tests; or single statements and the heads of functions.
    """
    for node in ast.walk(tree):
        if isinstance(node, SINGLE) and not whole:
            yield "", node, node.end_lineno or node.lineno
        elif isinstance(node, ast.FunctionDef):
            last = (node.end_lineno or 0) if whole else node.body[0].lineno - 1
            test = place == "tests" and node.name.startswith("test_")
            if (place != "tests" or test) and last - node.lineno < MOST_LINES:
                yield f"::{node.name}", node, last
