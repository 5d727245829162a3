"""Check the documentation: links resolve, pages are short, commands parse, examples run."""

from __future__ import annotations

import contextlib
import io
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)[^)]*\)")
FENCE = re.compile(r"^```([^\n`]*)\n(.*?)^```", re.MULTILINE | re.DOTALL)
HEADING = re.compile(r"^#+ (.*)$", re.MULTILINE)
MADE = re.compile(r"^<!-- made by: python (.*?) -->\n\n((?:\|.*\n)+)", re.MULTILINE)
#: A page is read in one go, or split.
MOST_WORDS = 1500
#: Page -> why it may be longer.
MAY_BE_LONG = {
    "CHANGELOG.md": "a history is looked up, not read",
    "docs/project/licences.md": "docs/licences.py writes it from the lock",
    "docs/evidence/benchmark_table.md": "`armimpedance benchmark table` writes it from the scores",
    "docs/gallery.md": "captions of pictures, each by itself",
}


def pages() -> list[Path]:
    """Every Markdown page of the project."""
    return sorted([*ROOT.glob("*.md"), *DOCS.rglob("*.md")])


def broken_links(page: Path, text: str) -> Iterator[str]:
    """Relative links to files or headings that are not there."""
    for target in LINK.findall(FENCE.sub("", text)):
        file, _, heading = target.partition("#")
        there = page.parent / file if file else page
        if "://" in target:
            continue
        if not there.exists():
            yield f"{named(page)}: link to {target}, which does not exist"
        elif heading and there.suffix == ".md" and heading not in anchors(there):
            yield f"{named(page)}: link to {target}, but the page has no such heading"


def anchors(page: Path) -> set[str]:
    """What a page's headings can be linked at, on a code host and on the site."""
    titles = HEADING.findall(FENCE.sub("", page.read_text()))
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


def too_long(page: Path, text: str) -> Iterator[str]:
    """Pages that should be split."""
    words = len(text.split())
    if words > MOST_WORDS and named(page) not in MAY_BE_LONG:
        yield f"{named(page)}: {words} words (expected at most {MOST_WORDS}: split it)"


def named(page: Path) -> str:
    """The page's place in the project."""
    return page.relative_to(ROOT).as_posix()


def other_tables(page: Path, text: str) -> Iterator[str]:
    """Tables below `<!-- made by: python ... -->` that are not what the command prints."""
    for command, table in MADE.findall(text):
        call = [sys.executable, *shlex.split(command)]
        made = subprocess.run(call, cwd=ROOT, capture_output=True, text=True, check=False)  # noqa: S603
        if made.returncode or made.stdout.strip() != table.strip():
            yield f"{named(page)}: the table is not what `python {command}` prints: copy it anew"


def wrong_commands(page: Path, text: str) -> Iterator[str]:
    """`armimpedance …` lines that its parser refuses."""
    from armimpedance.app.cli.main import make_parser

    for _, block in FENCE.findall(text):
        for line in block.splitlines():
            words = shlex.split(line.split("  #")[0]) if line.startswith("armimpedance ") else []
            if not words or "--help" in words:
                continue
            try:
                with contextlib.redirect_stderr(io.StringIO()) as message:
                    make_parser(words).parse_args(words[1:])
            except SystemExit:
                yield f"{named(page)}: {line!r}: {message.getvalue().strip()}"


def failing_examples(page: Path, text: str) -> Iterator[str]:
    """Python blocks of a page, run one after another in one namespace."""
    namespace: dict[str, object] = {}
    for language, block in FENCE.findall(text):
        if language != "python":
            continue
        try:
            with contextlib.redirect_stdout(io.StringIO()):
                exec(compile(block, named(page), "exec"), namespace)  # noqa: S102 - our own pages
        except Exception as error:  # noqa: BLE001 - whatever an example raises is what is told
            yield f"{named(page)}: example fails: {type(error).__name__}: {error}"


def main() -> int:
    """Print every problem; 1 if there is any."""
    problems: list[str] = []
    for page in pages():
        text = page.read_text()
        for check in (broken_links, too_long, other_tables, wrong_commands, failing_examples):
            problems += check(page, text)
    for problem in problems:
        print(problem)
    print(f"docs: {len(pages())} pages, {len(problems)} problems")
    return int(bool(problems))


if __name__ == "__main__":
    sys.exit(main())
