"""What a run of a command must keep, whatever its inputs hold."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

LONGEST_LINE = 400
NO_NUMBER = re.compile(r"^[+-]?(nan|inf|infinity)$", re.IGNORECASE)
#: Columns that hold what somebody wrote.
TEXTS = ("condition", "method", "muscles", "subject")
#: Commands that show why a recording cannot be used: in a page, in a figure.
MAY_WRITE_REFUSED = ("report", "inspect")


@dataclass(frozen=True)
class Run:
    """A call, whether a word of it was damaged, where it ran, what it said, and the files."""

    words: list[str]
    of_call: bool
    home: Path
    status: int
    out: bytes
    err: bytes
    before: dict[str, tuple[int, int, int]]
    after: dict[str, tuple[int, int, int]]


def misses(run: Run) -> list[str]:
    """Every promise that a run did not keep."""
    return [*_of_status(run), *_of_screen(run), *_of_files(run), *_of_numbers(run)]


def _of_status(run: Run) -> Iterator[str]:
    allowed = (0, 2, 3) if run.words[0] in ("convert", "study") else (0, 2)
    err = run.err.decode("utf-8", "replace")
    if run.status < 0:
        yield f"ended by signal {-run.status}"
    elif run.status not in allowed:
        yield f"status {run.status}: {_last(err)}"
    if run.status == 2:
        lines = err.splitlines()
        if not lines and run.words[0] in MAY_WRITE_REFUSED:
            return  # the page or the text that was asked for says why
        if len(lines) != 1:
            yield f"refused in {len(lines)} lines: {_last(err)}"
        # The line begins with the command's own name.
        elif len(re.sub(r"^armimpedance[a-z -]*: ", "", lines[0])) > LONGEST_LINE:
            yield "a line of more than 400 characters"
        elif not _names_an_input(run, lines[0]):
            yield f"names no input: {_last(err)}"


def _names_an_input(run: Run, line: str) -> bool:
    if run.of_call or "--" in line:
        return True
    tops = {path.split("/")[0] for path in run.before}
    return any(name in line for name in tops | {Path(path).name for path in run.before})


def _of_screen(run: Run) -> Iterator[str]:
    for name, data in (("stdout", run.out), ("stderr", run.err)):
        text = data.decode("utf-8", "replace")
        if any(not c.isprintable() and c not in "\n\t" for c in text):
            yield f"a control character on {name}"
        warned = [line for line in text.splitlines() if "Warning" in line or "Traceback" in line]
        if name == "stderr" and warned:
            yield f"a warning: {_last(warned[-1])}"
        if name == "stderr" and any(len(line) > LONGEST_LINE + 60 for line in text.splitlines()):
            yield "a long line on stderr"


def _of_files(run: Run) -> Iterator[str]:
    for path, state in run.before.items():
        if run.after.get(path) != state and not path.startswith("out"):
            yield f"input altered: {path}"
    new = [path for path in run.after if path not in run.before]
    for path in new:
        if not path.startswith("out"):
            yield f"left behind: {re.sub('[0-9a-f]{6,}', '#', path)}"
    if run.status not in (0, 3) and new and run.words[0] not in MAY_WRITE_REFUSED:
        yield "an output although it was refused"
    wanted = [word for word in run.words if word == "out" or word.startswith("out.")]
    if (
        run.status == 0
        and "--dry-run" not in run.words
        and any(not (run.home / word).exists() for word in wanted)
    ):
        yield "status 0 without its output"


def _of_numbers(run: Run) -> Iterator[str]:
    """Numbers that are none, in outputs of text."""
    if run.status != 0:
        return
    for path in run.after:
        file = run.home / path
        if path in run.before or path.startswith("out/"):
            continue
        if file.suffix == ".csv":
            yield from _of_csv(file)
        elif file.suffix in (".json", ".jsonld"):
            yield from _of_json(file)


def _of_csv(file: Path) -> Iterator[str]:
    with file.open(encoding="utf-8", newline="") as stream:
        rows = list(csv.reader(stream))
    found = {
        (name, cell.strip())
        for row in rows[1:]
        for name, cell in zip(rows[0], row, strict=False)
        if NO_NUMBER.match(cell.strip()) and name not in TEXTS
    }
    for name, cell in sorted(found)[:2]:
        yield f"{cell} in column {name[:30]} of a CSV"


def _of_json(file: Path) -> Iterator[str]:
    def refuse(word: str) -> NoReturn:
        raise ValueError(word)

    try:
        json.loads(file.read_text(encoding="utf-8"), parse_constant=refuse)
    except ValueError as error:
        yield f"no JSON: {str(error)[:40]}"


def _last(text: str) -> str:
    """The last line, its numbers and names aside, so that like lines are counted as one."""
    line = (text.strip().splitlines() or [""])[-1]
    return re.sub(r"'[^']*'|\d[\d.e+-]*", "#", line)[:110]
