"""Count retired words on the faces and in the messages, and docstrings that begin with a question.

Their numbers may only fall.

    python docs/english.py            exit status 1 where a word stands more often than it may
    python docs/english.py --where told

A face is what a reader of a room sees: the names in its stub and the first sentence of their
docstrings. A message is a text in an error, a finding or the help of an option. The words are our
own where the field has others: stated (told, said, given), detected (found), prior (known); "told
apart" is plain English.
"""

from __future__ import annotations

import argparse
import ast
import re
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]

#: Word -> how often it stands still. Who rewrites a sentence lowers the number.
MOST = {
    "told": 3,
    "tells": 0,
    "said": 0,
    "given": 6,
    "found": 2,
    "known": 29,
    "held": 18,
    "nobody": 0,
    "somebody": 0,
    "is none": 3,
    "none is": 2,
    "stands": 4,
}
#: Docstrings of the whole package that begin so.
OPENING = re.compile(r"(What|Whether|How|Of)\b")
MOST_OPENINGS = 3
#: What is called with a message.
MESSAGES = re.compile(r"(Error|Finding|add_argument|Option|warn)$")


def messages(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Line and text of every message in a module."""
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call):
            continue
        name = getattr(node.func, "id", None) or getattr(node.func, "attr", "")
        if MESSAGES.search(name):
            for part in ast.walk(node):
                if isinstance(part, ast.Constant) and isinstance(part.value, str):
                    yield part.lineno, part.value


def shown_names() -> set[str]:
    """Every name on a face."""
    stubs = (ast.parse(stub.read_text()) for stub in ROOT.glob("armimpedance/**/__init__.pyi"))
    nodes = (node for tree in stubs for node in tree.body if isinstance(node, ast.ImportFrom))
    return {alias.name for node in nodes for alias in node.names}


def sentences(tree: ast.Module, shown: set[str]) -> Iterator[tuple[int, str]]:
    """Line, name and first sentence of what a module has on a face."""
    for node in tree.body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and node.name in shown:
            first = (ast.get_docstring(node) or "").split("\n\n")[0]
            yield node.lineno, f"{node.name.replace('_', ' ')}: {first}"


def texts() -> Iterator[tuple[str, str]]:
    """Place and text of all that is counted."""
    shown = shown_names()
    for path in sorted((ROOT / "armimpedance").rglob("*.py")):
        tree, place = ast.parse(path.read_text()), path.relative_to(ROOT).as_posix()
        for line, text in (*messages(tree), *sentences(tree, shown)):
            yield f"{place}:{line}", text


def openings() -> Iterator[str]:
    """Place and first line of every docstring that begins with a question."""
    for path in sorted((ROOT / "armimpedance").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.FunctionDef | ast.ClassDef | ast.Module):
                text = ast.get_docstring(node) or ""
                if OPENING.match(text):
                    line = getattr(node, "lineno", 1)
                    yield f"{path.relative_to(ROOT)}:{line}: {text.splitlines()[0]}"


def main() -> int:
    """Print the counts, or where a word stands."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--where", metavar="WORD")
    asked = parser.parse_args().where
    counts: Counter[str] = Counter()
    for place, text in texts():
        for word in MOST:
            number = len(re.findall(rf"\b{word}\b(?! apart)", text, re.IGNORECASE))
            counts[word] += number
            if number and word == asked:
                print(f"{place}: {' '.join(text.split())}")
    above = [word for word, most in MOST.items() if counts[word] > most]
    for word in above:
        print(f"{word}: {counts[word]} times (expected at most {MOST[word]}): docs/english.py")
    print("retired words: " + ", ".join(f"{word} {counts[word]}" for word in MOST))
    questions = list(openings())
    if len(questions) > MOST_OPENINGS:
        print("\n".join(questions))
        print(f"{len(questions)} docstrings begin with a question (at most {MOST_OPENINGS})")
    return int(bool(above) or len(questions) > MOST_OPENINGS)


if __name__ == "__main__":
    sys.exit(main())
