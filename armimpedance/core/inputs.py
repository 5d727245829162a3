"""Inputs: what is no file, too large or changing is refused; names tell them apart; TOML.

Standard library only.

Before and after the reading a file is asked for its place on the disk, its size and when it was
last written to: two questions of microseconds, where a sum over an hour's recording would take as
long as the reading. A file that was written to in the last moments could change again without
another time of change, since clocks of file systems tick: of such a file, if it is not huge, the
contents are summed too.
"""

from __future__ import annotations

import os
import stat
import time
import tomllib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import date, time as time_of_day
from hashlib import file_digest
from pathlib import Path
from typing import Any, Final

from armimpedance.core.errors import InputError

#: The coarsest clock of a file system in use, FAT's, ns.
_TICK_NS: Final = 2_000_000_000
#: A fresh file that is larger is not summed, bytes.
_LARGEST_SUMMED: Final = 64_000_000


@dataclass(frozen=True)
class _Look:
    """What a file looked like."""

    place: tuple[int, int]
    size: int
    written_ns: int
    sum: bytes


@dataclass(frozen=True)
class Inputs:
    """What inputs looked like before they were read.

    `looks` tuple of (Path, look): of every regular file, those of a folder one by one.
    """

    looks: tuple[tuple[Path, _Look], ...]

    def check(self) -> None:
        """Whether they still look like that.

        Raises InputError: a file was written to, cut, replaced or removed.
        """
        for path, before in self.looks:
            if _look(path, summed=bool(before.sum)) != before:
                expected = "one that nobody writes to; try again when it is complete"
                raise InputError("changed while it was read", file=path, expected=expected)


def inputs_now(*paths: str | os.PathLike[str] | None) -> Inputs:
    """What files look like now, before they are read.

    `*paths`: files and folders; None, what is not there, and pipes and devices are passed over.
    """
    found = []
    for path in paths:
        for file in () if path is None else _files(Path(path)):
            look = _look(file)
            if look is not None:
                found.append((file, look))
    return Inputs(tuple(found))


@contextmanager
def unchanged(*paths: str | os.PathLike[str] | None) -> Iterator[None]:
    """Read files in here: whatever the reading ends in, a change of them comes first.

    `*paths`: as for `inputs_now`.
    Raises InputError: a file changed meanwhile; it names the file.
    """
    before = inputs_now(*paths)
    try:
        yield
    except Exception:
        # What is wrong with half a file is not what is wrong.
        before.check()
        raise
    before.check()


#: What an input may be in place of a file, in words.
_NO_FILES: Final = (
    (stat.S_ISDIR, "is a folder"),
    (stat.S_ISFIFO, "is a pipe"),
    (stat.S_ISSOCK, "is a socket"),
    (lambda mode: stat.S_ISCHR(mode) or stat.S_ISBLK(mode), "is a device"),
)


def check_regular(file: Path, most_bytes: int | None = None, expected: str = "a file") -> None:
    """Refuse what may never end, or no memory bears, before a byte of it is read.

    `most_bytes`: None: any size.
    Raises InputError: it is no regular file, or larger. What is not there is left to the opener.
    """
    try:
        seen = file.stat()
    except (OSError, ValueError):
        return
    for is_one, problem in _NO_FILES:
        if is_one(seen.st_mode):
            raise InputError(f"{problem}, no file", file=file, expected=expected)
    if most_bytes is not None and seen.st_size > most_bytes:
        problem = f"{seen.st_size / 1e6:.3g} MB, more than {most_bytes / 1e6:g} MB"
        raise InputError(problem, file=file, expected=expected)


def text_of(file: Path, most_bytes: int, expected: str, absent: str | None = None) -> str:
    """The UTF-8 text in a file, which is read whole and does not change meanwhile.

    `absent`: what is expected where the file is not there.
    Raises InputError: as `check_regular`; or it cannot be read, or is no such text.
    """
    check_regular(file, most_bytes, expected)
    try:
        with unchanged(file):
            return file.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise InputError("is not UTF-8 text", file=file, expected=expected) from None
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=file, expected=absent) from None


def _files(path: Path) -> Iterator[Path]:
    """A file, or the files of a folder; not those that are hidden, such as temporaries."""
    if not path.is_dir():
        yield path
        return
    for folder, inner, names in os.walk(path):
        inner[:] = [name for name in inner if not name.startswith(".")]
        yield from (Path(folder, name) for name in names if not name.startswith("."))


def _look(path: Path, *, summed: bool | None = None) -> _Look | None:
    """None where there is no such regular file; whether it is summed follows from its age."""
    try:
        held = path.stat()
        if not stat.S_ISREG(held.st_mode):
            return None
        if summed is None:
            age = time.time_ns() - held.st_mtime_ns
            summed = age < _TICK_NS and held.st_size <= _LARGEST_SUMMED
        total = b""
        if summed:
            with path.open("rb") as stream:
                total = file_digest(stream, "sha256").digest()
    except OSError:
        return None
    return _Look((held.st_dev, held.st_ino), held.st_size, held.st_mtime_ns, total)


def distinct_names(paths: Sequence[Path]) -> list[str]:
    """A name for each path: its own, with as many folders before it as make all different.

    Returns: such as ``["monday/session", "tuesday/session"]``.
    Raises InputError: one place is given twice.
    """
    places = [path.resolve() for path in paths]
    for number, place in enumerate(places):
        if place in places[:number]:
            raise InputError("is given twice", file=paths[number], expected="each input once")
    names = [place.parts for place in places]
    for length in range(1, max(map(len, names), default=0) + 1):
        short = ["/".join(parts[-length:]) for parts in names]
        if len(set(short)) == len(short):
            return short
    return [str(path) for path in paths]


# What a file claims to hold is checked before room is made for it.

#: So much may always be asked for...
PLENTY: Final = 300_000_000
#: ... and beyond it this many times the size of the file: what compression does to real samples.
MOST_PACKED: Final = 30


def check_claim(claimed: int, file: Path, part: str | None = None) -> None:
    """Refuse a claim that the size of the file makes impossible, or that no memory bears.

    `claimed`: bytes that its content would take.
    `part`: name of the column or variable.
    """
    if claimed <= PLENTY or claimed <= MOST_PACKED * file.stat().st_size:
        return
    problem = f"claims {claimed / 1e9:.3g} GB in a file of {file.stat().st_size / 1e6:.3g} MB"
    raise InputError(problem, file=file, column=part, expected="a file that is not damaged")


# TOML: mappings, designs of studies and their settings, by one reader.

#: Nobody types more.
_LARGEST_TOML: Final = 1_000_000
#: Parts of a key, ``a.b.c = 1``: the reader makes a table for each of them on every line.
_MOST_PARTS: Final = 20


def read_toml(file: Path, expected: str) -> tuple[dict[str, Any], str]:
    """The values in a TOML file, and its text.

    `expected`: what the file should be, such as "a mapping".
    Raises InputError: it is not there, no regular file, too large, or no TOML.
    """
    text = text_of(file, _LARGEST_TOML, expected, absent=expected)
    for row, line in enumerate(text.splitlines(), start=1):
        key = line.partition("=")[0]
        is_key = "=" in line or line.lstrip().startswith("[")
        if is_key and key.count(".") >= _MOST_PARTS:
            problem = f"a key of {key.count('.') + 1} parts"
            raise InputError(problem, file=file, row=row, expected=f"at most {_MOST_PARTS}")
    try:
        values = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(f"broken TOML: {error}", file=file, expected=expected) from None
    if dated := next(_dates(values, ""), None):
        raise InputError(
            "holds a date or a time", file=file, column=dated, expected="a text in quotes"
        )
    return values, text


def _dates(value: Any, name: str) -> Iterator[str]:
    """The keys of dates and times: TOML has them, nothing here takes one."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from _dates(inner, f"{name}.{key}" if name else key)
    elif isinstance(value, list):
        for inner in value:
            yield from _dates(inner, name)
    elif isinstance(value, date | time_of_day):
        yield name
