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
#: A page that a docstring or comment names.
PAGE = re.compile(r"docs/[a-z_/]+\.(?:md|svg)")
FENCE = re.compile(r"^```([^\n`]*)\n(.*?)^```", re.MULTILINE | re.DOTALL)
HEADING = re.compile(r"^#+ (.*)$", re.MULTILINE)
#: What measures: a script, a command, a file of tests; or that there is none.
MEASURES = re.compile(
    r"\w\.py\b|`armimpedance \w|`make \w|^armimpedance \w|No script here", re.MULTILINE
)
TABLE = re.compile(r"^\|[ :|-]+\|$", re.MULTILINE)
#: A check's name where it is made.
CHECK_NAME = re.compile(
    r"""(?:\b(?:Finding|Cause)\(\s*|^_NAME: Final = )"([^"]+)"[,\n]""", re.MULTILINE
)
MADE = re.compile(r"^<!-- made by: python (.*?) -->\n\n((?:\|.*\n)+)", re.MULTILINE)
#: Shelf -> most words of a page, tables included: it is read in one go, or split.
MOST_WORDS = {"README.md": 400, "tutorials": 900, "how_to": 400}
MOST_ELSEWHERE = 1200
#: Words outside of tables that all shelves may have together: who adds a page shortens another.
MOST_PROSE = 55_000
#: Page or folder -> why it is no part of that, and may be longer.
WRITTEN_BY_PROGRAMS = {
    "CHANGELOG.md": "a history is looked up, not read",
    "docs/project/licences.md": "docs/licences.py writes it from the lock",
    "docs/evidence/benchmark_table.md": "`armimpedance benchmark table` writes it from the scores",
    "docs/evidence/what_can_go_wrong": "`benchmarks/broken_assumptions.py` writes it",
}
#: Lists of links, and captions of pictures, each by itself.
LISTS = ("docs/gallery.md", "docs/how_to/index.md")


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
    name = named(page)
    if is_written_by_a_program(page) or name in LISTS:
        return
    most = MOST_WORDS.get(name.removeprefix("docs/").split("/")[0], MOST_ELSEWHERE)
    if words(text) > most:
        yield f"{name}: {words(text)} words (expected at most {most}: split it)"


def lost_pages() -> Iterator[str]:
    """Pages that the code names and that are not there."""
    for top in ("armimpedance", "manipulandum_sim", "benchmarks", "tests", "release"):
        for file in sorted((ROOT / top).rglob("*.py")):
            for page in PAGE.findall(file.read_text()):
                if not (ROOT / page).is_file():
                    yield f"{named(file)}: {page}, which does not exist"


def checks_without_a_line() -> Iterator[str]:
    """Names of checks in the code that the page of checks does not list."""
    from armimpedance.core.findings import GRAVEST

    listed = (DOCS / "reference/checks.md").read_text()
    names = dict.fromkeys(GRAVEST, "armimpedance/core/findings.py")
    for file in sorted((ROOT / "armimpedance").rglob("*.py")):
        text = file.read_text()
        if "Finding(" in text or "Cause(" in text:
            names |= dict.fromkeys(CHECK_NAME.findall(text), named(file))
    for name, file in names.items():
        if f"`{name}`" not in listed:
            yield f"{file}: the check {name!r} has no line in docs/reference/checks.md"


def words(text: str) -> int:
    """Words of a text; bars of tables and marks of lists are none."""
    return sum(any(letter.isalnum() for letter in word) for word in text.split())


def is_written_by_a_program(page: Path) -> bool:
    """Whether a page is made anew from something else."""
    return any(f"{named(page)}/".startswith(f"{name}/") for name in WRITTEN_BY_PROGRAMS)


def by_shelf() -> dict[str, tuple[int, int, int]]:
    """Shelf -> pages, words outside of tables and words in tables, of what people wrote."""
    counted: dict[str, tuple[int, int, int]] = {}
    for page in sorted(DOCS.rglob("*.md")):
        if is_written_by_a_program(page):
            continue
        place = page.relative_to(DOCS).parts
        lines = page.read_text().splitlines()
        rows = [line for line in lines if line.startswith("|")]
        prose = words("\n".join(line for line in lines if not line.startswith("|")))
        shelf = place[0] if len(place) > 1 else "(top)"
        known = counted.get(shelf, (0, 0, 0))
        counted[shelf] = (known[0] + 1, known[1] + prose, known[2] + words("\n".join(rows)))
    return counted


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


def tables_without_a_command(page: Path, text: str) -> Iterator[str]:
    """Sections of the evidence whose table nobody can measure again, nor is told so."""
    if not named(page).startswith("docs/evidence/") or is_written_by_a_program(page):
        return
    beginning, *sections = re.split(r"^## ", text, flags=re.MULTILINE)
    for section in [] if MEASURES.search(beginning) else sections or [beginning]:
        if TABLE.search(section) and not MEASURES.search(section):
            title = section.partition("\n")[0]
            yield f"{named(page)}, {title}: a table without its command (or: No script here ...)"


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


OF_A_PAGE = (
    broken_links,
    too_long,
    other_tables,
    tables_without_a_command,
    wrong_commands,
    failing_examples,
)


def main() -> int:
    """Print every problem; 1 if there is any."""
    problems = [*lost_pages(), *checks_without_a_line()]
    for page in pages():
        text = page.read_text()
        for check in OF_A_PAGE:
            problems += check(page, text)
    shelves = by_shelf()
    if (prose := sum(count for _, count, _ in shelves.values())) > MOST_PROSE:
        problems.append(f"docs: {prose} words (expected at most {MOST_PROSE}: shorten a page)")
    for shelf, (count, outside, inside) in shelves.items():
        print(f"{shelf}: {count} pages, {outside} words, and {inside} in tables")
    for problem in problems:
        print(problem)
    print(f"docs: {len(pages())} pages, {len(problems)} problems")
    return int(bool(problems))


if __name__ == "__main__":
    sys.exit(main())
