"""Input files: refusal of what is no file, too large or changing; distinct names; TOML.

Standard library only.

Before and after reading, a file's identity on the disk, its size and its time of last change are
compared. This takes microseconds, while a checksum of a recording of an hour takes as long as
reading it. A file that was changed in the last two seconds could change again with the same time
stamp, since clocks of file systems are coarse: such a file, if it is not huge, is compared by
checksum too.
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
#: No checksum is made of a recently changed file that is larger, bytes.
_LARGEST_SUMMED: Final = 64_000_000


@dataclass(frozen=True)
class _Look:
    """Identity, size, time of last change and (or b"") checksum of a file."""

    place: tuple[int, int]
    size: int
    written_ns: int
    sum: bytes


@dataclass(frozen=True)
class Inputs:
    """State of input files before they were read.

    `looks` tuple of (Path, state): of every regular file, those in a folder included.
    """

    looks: tuple[tuple[Path, _Look], ...]

    def check(self) -> None:
        """Refuse files that changed meanwhile.

        Raises InputError: a file was written to, cut, replaced or removed.
        """
        for path, before in self.looks:
            if _look(path, summed=bool(before.sum)) != before:
                expected = "one that nobody writes to; try again when it is complete"
                raise InputError("changed while it was read", file=path, expected=expected)


def inputs_now(*paths: str | os.PathLike[str] | None) -> Inputs:
    """Return the state of files before they are read.

    `*paths`: files and folders; None, missing paths, pipes and devices are skipped.
    """
    looks = []
    for path in paths:
        for file in () if path is None else _files(Path(path)):
            look = _look(file)
            if look is not None:
                looks.append((file, look))
    return Inputs(tuple(looks))


@contextmanager
def unchanged(*paths: str | os.PathLike[str] | None) -> Iterator[None]:
    """Check that files do not change within this block; a change is reported before other errors.

    `*paths`: as for `inputs_now`.
    Raises InputError: a file changed meanwhile; it names the file.
    """
    before = inputs_now(*paths)
    try:
        yield
    except Exception:
        # An error in a file that is half written is not the cause: report the change instead.
        before.check()
        raise
    before.check()


#: Tests of a mode for what is no regular file, and its name.
_NO_FILES: Final = (
    (stat.S_ISDIR, "is a folder"),
    (stat.S_ISFIFO, "is a pipe"),
    (stat.S_ISSOCK, "is a socket"),
    (lambda mode: stat.S_ISCHR(mode) or stat.S_ISBLK(mode), "is a device"),
)


def check_regular(file: Path, most_bytes: int | None = None, expected: str = "a file") -> None:
    """Refuse, before reading, anything that may never end or is too large for memory.

    `most_bytes`: None: any size.
    Raises InputError: it is no regular file, or larger. A missing file is reported on opening it.
    """
    try:
        status = file.stat()
    except (OSError, ValueError):
        return
    for is_such, problem in _NO_FILES:
        if is_such(status.st_mode):
            raise InputError(f"{problem}, no file", file=file, expected=expected)
    if most_bytes is not None and status.st_size > most_bytes:
        problem = f"{status.st_size / 1e6:.3g} MB, more than {most_bytes / 1e6:g} MB"
        raise InputError(problem, file=file, expected=expected)


def text_of(file: Path, most_bytes: int, expected: str, absent: str | None = None) -> str:
    """Return the UTF-8 text of a file, which is read whole and must not change meanwhile.

    `absent`: what was expected if the file is missing.
    Raises InputError: as `check_regular`; or it cannot be read, or is not UTF-8 text.
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
    """Yield a file, or the files of a folder except hidden ones, such as temporaries."""
    if not path.is_dir():
        yield path
        return
    for folder, inner, names in os.walk(path):
        inner[:] = [name for name in inner if not name.startswith(".")]
        yield from (Path(folder, name) for name in names if not name.startswith("."))


def _look(path: Path, *, summed: bool | None = None) -> _Look | None:
    """Return the state of a file; None if there is no such regular file.

    `summed`: whether to make a checksum; None: if the file changed recently.
    """
    try:
        status = path.stat()
        if not stat.S_ISREG(status.st_mode):
            return None
        if summed is None:
            age = time.time_ns() - status.st_mtime_ns
            summed = age < _TICK_NS and status.st_size <= _LARGEST_SUMMED
        digest = b""
        if summed:
            with path.open("rb") as stream:
                digest = file_digest(stream, "sha256").digest()
    except OSError:
        return None
    return _Look((status.st_dev, status.st_ino), status.st_size, status.st_mtime_ns, digest)


def distinct_names(paths: Sequence[Path]) -> list[str]:
    """Return a name for each path: its own, with as many folders as make all names different.

    Returns: such as ``["monday/session", "tuesday/session"]``.
    Raises InputError: a file or folder is stated twice.
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


# The size that a file claims is checked before memory is allocated for it.

#: Bytes that a file may always claim.
PLENTY: Final = 300_000_000
#: Beyond that, it may claim this many times its size: the most that real samples are compressed.
MOST_PACKED: Final = 30


def check_claim(claimed: int, file: Path, part: str | None = None) -> None:
    """Refuse a claimed size that the size of the file makes impossible.

    `claimed`: bytes that the content would take in memory.
    `part`: name of the column or variable.
    """
    if claimed <= PLENTY or claimed <= MOST_PACKED * file.stat().st_size:
        return
    problem = f"claims {claimed / 1e9:.3g} GB in a file of {file.stat().st_size / 1e6:.3g} MB"
    raise InputError(problem, file=file, column=part, expected="a file that is not damaged")


# TOML: one reader for mappings, designs of studies and their settings.

#: Bytes; no file that is typed by hand is larger.
_LARGEST_TOML: Final = 1_000_000
#: Most parts of a key, ``a.b.c = 1``: the reader makes a table for each part on every line.
_MOST_PARTS: Final = 20


def read_toml(file: Path, expected: str) -> tuple[dict[str, Any], str]:
    """Return the values in a TOML file, and its text.

    `expected`: what the file should be, such as "a mapping".
    Raises InputError: it is missing, no regular file, too large, or no TOML.
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
    """Yield the keys of dates and times: TOML allows them, the toolkit does not."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from _dates(inner, f"{name}.{key}" if name else key)
    elif isinstance(value, list):
        for inner in value:
            yield from _dates(inner, name)
    elif isinstance(value, date | time_of_day):
        yield name
