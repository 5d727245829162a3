"""Check the documentation: links resolve, commands parse, Python examples run."""

from __future__ import annotations

import contextlib
import io
import re
import shlex
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
LINK = re.compile(r"\[[^\]]*\]\(([^)#\s]+)[^)]*\)")
FENCE = re.compile(r"^```(\w*)\n(.*?)^```", re.MULTILINE | re.DOTALL)


def pages() -> list[Path]:
    """Every Markdown page of the project."""
    return sorted([*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md")])


def broken_links(page: Path, text: str) -> Iterator[str]:
    """Relative links to files that are not there."""
    for target in LINK.findall(text):
        if "://" not in target and not (page.parent / target).exists():
            yield f"{page.name}: link to {target}, which does not exist"


def wrong_commands(page: Path, text: str) -> Iterator[str]:
    """`armimpedance …` lines that its parser refuses."""
    from armimpedance.cli.main import make_parser

    for _, block in FENCE.findall(text):
        for line in block.splitlines():
            words = shlex.split(line.split("  #")[0]) if line.startswith("armimpedance ") else []
            if not words or "--help" in words:
                continue
            try:
                with contextlib.redirect_stderr(io.StringIO()) as message:
                    make_parser(words).parse_args(words[1:])
            except SystemExit:
                yield f"{page.name}: {line!r}: {message.getvalue().strip()}"


def failing_examples(page: Path, text: str) -> Iterator[str]:
    """Python blocks of a page, run one after another in one namespace."""
    namespace: dict[str, object] = {}
    for language, block in FENCE.findall(text):
        if language != "python":
            continue
        try:
            with contextlib.redirect_stdout(io.StringIO()):
                exec(compile(block, page.name, "exec"), namespace)  # noqa: S102 - our own pages
        except Exception as error:  # noqa: BLE001 - whatever an example raises is what is told
            yield f"{page.name}: example fails: {type(error).__name__}: {error}"


def main() -> int:
    """Print every problem; 1 if there is any."""
    problems: list[str] = []
    for page in pages():
        text = page.read_text()
        for check in (broken_links, wrong_commands, failing_examples):
            problems += check(page, text)
    for problem in problems:
        print(problem)
    print(f"docs: {len(pages())} pages, {len(problems)} problems")
    return int(bool(problems))


if __name__ == "__main__":
    sys.exit(main())
