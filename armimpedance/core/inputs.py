"""Inputs: names that tell them apart; those that change while they are read are refused.

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
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from hashlib import file_digest
from pathlib import Path
from typing import Final

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
