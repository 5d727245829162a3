"""The shortest use of a name that is kept right by its own checks, where the docstring has none."""

from __future__ import annotations

import ast
from bisect import bisect_left
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
            uses = [
                pieces[room, name]
                for path in _files_that_may_use(place, room, name)
                if (room, name) in (pieces := _uses(path, place, whole))
            ]
            if uses:
                return min(uses, key=lambda use: len(use.source))
    return None


def _files_that_may_use(place: str, room: str, name: str) -> Iterator[Path]:
    """The files whose text holds both words: only these are worth reading as Python."""
    for path, text in _texts(place):
        if name in text and f"armimpedance.{room}" in text:
            yield path


@cache
def _texts(place: str) -> list[tuple[Path, str]]:
    return [(path, path.read_text()) for path in sorted((ROOT / place).rglob("*.py"))]


@cache
def _uses(path: Path, place: str, whole: bool) -> dict[tuple[str, str], Use]:
    """The shortest use that a file has of each name that it imports."""
    found: dict[tuple[str, str], Use] = {}
    file = _read(path, place)
    for title, first, last in file.pieces(place, whole):
        names = file.names_in(first, last)
        if not names:
            continue
        source = dedent("\n".join(file.lines[first - 1 : last]))
        use = Use(PLACES[place], f"{file.path}{title}", source)
        for key in (key for key, local in file.imported.items() if local in names):
            known = found.get(key)
            if known is None or len(source) < len(known.source):
                found[key] = use
    return found


@dataclass(frozen=True)
class File:
    """What one walk through a file finds.

    `imported`: (room, name) of what comes from us -> its name in the file.
    `used`: (line, name) of every use of one of these names, in the order of the lines.
    `shown`: functions and single statements.
    """

    path: Path
    lines: list[str]
    imported: dict[tuple[str, str], str]
    used: list[tuple[int, str]]
    shown: list[ast.stmt]

    def names_in(self, first: int, last: int) -> set[str]:
        """The imported names that stand in these lines."""
        begin, end = bisect_left(self.used, (first, "")), bisect_left(self.used, (last + 1, ""))
        return {name for _, name in self.used[begin:end]}

    def pieces(self, place: str, whole: bool) -> Iterator[tuple[str, int, int]]:
        """What may be shown, each with its first and last line.

        Whole functions, of tests the tests; or single statements and the heads of functions.
        """
        for node in self.shown:
            if isinstance(node, ast.FunctionDef):
                last = (node.end_lineno or 0) if whole else node.body[0].lineno - 1
                test = place == "tests" and node.name.startswith("test_")
                if (place != "tests" or test) and last - node.lineno < MOST_LINES:
                    yield f"::{node.name}", node.lineno, last
            elif not whole:
                yield "", node.lineno, node.end_lineno or node.lineno


@cache
def _read(path: Path, place: str) -> File:
    text = path.read_text()
    nodes = list(ast.walk(ast.parse(text)))
    own = ".".join(path.relative_to(ROOT / place).parts) if place == "armimpedance" else ""
    imported = {k: local for k, local in _imported(nodes) if not own.startswith(f"{k[0]}.")}
    names = set(imported.values())
    used = [(n.lineno, n.id) for n in nodes if isinstance(n, ast.Name) and n.id in names]
    shown = [node for node in nodes if isinstance(node, (ast.FunctionDef, *SINGLE))]
    return File(path.relative_to(ROOT), text.splitlines(), imported, sorted(used), shown)


def _imported(nodes: list[ast.AST]) -> Iterator[tuple[tuple[str, str], str]]:
    """((Room, name), name in the file) of what is imported from us, inside of functions too."""
    for node in nodes:
        parts = (node.module or "").split(".") if isinstance(node, ast.ImportFrom) else []
        if isinstance(node, ast.ImportFrom) and parts[:1] == ["armimpedance"] and parts[1:]:
            rooms = (".".join(parts[1:k]) for k in range(2, len(parts) + 1))
            yield from (((r, p.name), p.asname or p.name) for r in rooms for p in node.names)
