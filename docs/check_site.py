"""Check the built site: links and anchors, nothing fetched from elsewhere, every name on a page.

python docs/check_site.py out/site
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

DOCS = Path(__file__).resolve().parent
sys.path.append(str(DOCS / "_site"))
from faces import names_of, rooms  # noqa: E402
from help_pages import runs  # noqa: E402

from armimpedance.app.cli.main import COMMANDS  # noqa: E402

#: Tags whose addresses a browser follows by itself while it shows a page.
FETCHED = {"script", "img", "link", "iframe", "source"}
#: Kinds of <link> that say where something is and fetch nothing.
ONLY_SAID = {"canonical", "index", "search", "next", "prev", "author", "license", "copyright"}
#: Processor seconds that the code of a tutorial may take, written by `_site/seconds.py`.
MOST_SECONDS = 60.0
#: What a shell prints where a command of a tutorial did not run; a notebook goes on after it.
NOT_RUN = (
    *("No such file or directory", "command not found", "Broken pipe"),
    "Traceback (most recent call last)",
)


@dataclass
class Tags(HTMLParser):
    """What a page links to, fetches, and can be linked at."""

    links: list[str] = field(default_factory=list)
    fetched: list[str] = field(default_factory=list)
    anchors: set[str] = field(default_factory=lambda: {""})

    def __post_init__(self) -> None:
        super().__init__()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Take in the tags that say where something is."""
        said = {name: value or "" for name, value in attrs}
        self.anchors |= {said[name] for name in ("id", "name") if name in said}
        target = said.get("href", said.get("src", ""))
        if tag in ("a", "img", "script", "link"):
            self.links.append(target)
        if tag in FETCHED and not ONLY_SAID & set(said.get("rel", "").split()):
            self.fetched.append(target)


@cache
def tags(page: Path) -> Tags:
    """The tags of a page of the site."""
    found = Tags()
    found.feed(page.read_text())
    return found


def dead_links(page: Path) -> Iterator[str]:
    """Links to files or anchors that are not there, and outside addresses of no proper form."""
    for target in tags(page).links:
        parts = urlsplit(target)
        if parts.scheme in ("http", "https"):
            if not re.fullmatch(r"[\w.-]+\.[a-z]{2,}(:\d+)?", parts.netloc) or " " in target:
                yield f"{page}: {target!r} is no address"
        elif not parts.scheme:
            file = (page.parent / unquote(parts.path)).resolve() if parts.path else page.resolve()
            if not file.is_file():
                yield f"{page}: {target!r} is not there"
            elif file.suffix == ".html" and unquote(parts.fragment) not in tags(file).anchors:
                yield f"{page}: {target!r} has no such anchor"


def fetched_from_elsewhere(page: Path) -> Iterator[str]:
    """What a browser would fetch from another machine."""
    for target in tags(page).fetched:
        if target.startswith(("http:", "https:", "//")):
            yield f"{page}: fetches {target}"


def styles_from_elsewhere(sheet: Path) -> Iterator[str]:
    """The same of a style sheet."""
    css = sheet.read_text()
    for target in re.findall(r"(?:url\(|@import)\s*[\"']?((?:https?:)?//[^\"')]+)", css):
        yield f"{sheet}: fetches {target}"


def names_without_a_page(site: Path) -> Iterator[str]:
    """Names of the faces that no page of the API holds."""
    for room in ["", *rooms()]:
        for name in names_of(room):
            page = f"rooms/{room}.html" if room else f"ai/{name}.html"
            file = site / "reference/api" / page
            text = file.read_text() if file.is_file() else ""
            if not re.search(rf"\b{name}\b", text):
                yield f"reference/api/{page}: {name} is missing"


def commands_without_a_run() -> Iterator[str]:
    """Commands of which no example was run; `demo` is run whole, `app` in the browser's tests."""
    for name in set(COMMANDS) - set(runs()) - {"demo", "app"}:
        yield f"reference/commands/{name}.html: no example was run"


def commands_that_failed(page: Path) -> Iterator[str]:
    """Lines of a tutorial's output that say that one of its shell commands did not run."""
    for line in page.read_text().splitlines():
        if any(words in line for words in NOT_RUN):
            yield f"{page}: {re.sub('<[^>]*>', '', line).strip()}"


def seconds_of(page: Path) -> float | None:
    """Processor seconds that the code of a page took."""
    said = re.search(r'<meta name="seconds" content="([\d.]+)"', page.read_text())
    return float(said[1]) if said else None


def slow_tutorials(tutorials: list[Path]) -> Iterator[str]:
    """Tutorials whose code runs longer than a reader should wait, or was not timed."""
    for page in tutorials:
        seconds = seconds_of(page)
        if page.stem != "index" and (seconds is None or not 0 < seconds <= MOST_SECONDS):
            yield f"{page}: {seconds} s (expected at most {MOST_SECONDS:g} s of the processor)"


def main(folder: str) -> int:
    """Print every problem; 1 if there is any."""
    site = Path(folder)
    pages = sorted(p for p in site.rglob("*.html") if "_static" not in p.parts)
    problems = [found for page in pages for found in dead_links(page)]
    problems += [found for page in pages for found in fetched_from_elsewhere(page)]
    problems += [found for sheet in site.rglob("*.css") for found in styles_from_elsewhere(sheet)]
    tutorials = sorted(site.glob("tutorials/*.html"))
    problems += [found for page in tutorials for found in commands_that_failed(page)]
    problems += slow_tutorials(tutorials)
    problems += [*names_without_a_page(site), *commands_without_a_run()]
    for problem in problems:
        print(problem)
    times = ", ".join(f"{page.stem} {seconds_of(page)}" for page in tutorials)
    print(f"tutorials, processor seconds: {times}")
    print(f"site: {len(pages)} pages, {len(problems)} problems")
    return int(bool(problems))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
