"""The shortest test that uses a name: an example that runs, where the docstring has none."""

from __future__ import annotations

import ast
from dataclasses import dataclass
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
#: A longer test shows too much beside the name.
MOST_LINES = 30


@dataclass(frozen=True)
class Use:
    """A test, and where it stands."""

    where: str
    source: str


def use_of(name: str) -> Use | None:
    """The shortest test in whose body the name stands, of a file that imports it from us."""
    return _uses().get(name)


@cache
def _uses() -> dict[str, Use]:
    found: dict[str, Use] = {}
    for file in sorted((ROOT / "tests").rglob("test_*.py")):
        text = file.read_text()
        tree = ast.parse(text)
        imported = _imported(tree)
        for test in tree.body:
            if not isinstance(test, ast.FunctionDef) or not test.name.startswith("test_"):
                continue
            source = ast.get_source_segment(text, test) or ""
            use = Use(f"{file.relative_to(ROOT)}::{test.name}", source)
            for name in imported & _names(test):
                if name not in found or len(source) < len(found[name].source):
                    found[name] = use
    return {n: use for n, use in found.items() if use.source.count("\n") < MOST_LINES}


def _imported(tree: ast.Module) -> set[str]:
    """What a file imports from the package, also inside of its functions."""
    imports = (node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom))
    ours = (node for node in imports if (node.module or "").startswith("armimpedance"))
    return {alias.name for node in ours for alias in node.names if alias.asname is None}


def _names(test: ast.FunctionDef) -> set[str]:
    return {node.id for node in ast.walk(test) if isinstance(node, ast.Name)}
