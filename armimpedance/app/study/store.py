"""Results of steps, kept under a hash of what they were made of.

A result is a folder that appears whole, under the SHA-256 of all that it depends on. Whoever made
it, and whenever, it is the same; two machines may write into one store.
"""

from __future__ import annotations

import hashlib
import os
import secrets
import shutil
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Final

from armimpedance.core.errors import InputError
from armimpedance.core.json_text import json_text, read_json
from armimpedance.core.outputs import staged_file
from armimpedance.core.program import of_words
from armimpedance.core.temporaries import remove, temporary_name

# What tells that a file, a folder or the program has changed: SHA-256 of the bytes.
#
# A file that has the size, the time and the inode that it had when it was last read is not read
# again; a change that keeps all three is not seen.

_BLOCK: Final = 1 << 20
#: What is younger than this when it is read may be written again within one tick of the clock.
_YOUNG_NS: Final = 2_000_000_000


class Fingerprints:
    """SHA-256 of files and folders, remembered between runs.

    `memory`: file that remembers; made by `save`.
    """

    def __init__(self, memory: Path | None = None) -> None:
        self._memory = memory
        self._known: dict[str, list[int | str]] = {}
        self._changed = False
        if memory is not None and memory.is_file():
            self._known = _remembered(memory)

    def of(self, path: Path) -> str:
        """SHA-256 of a file, or of a folder's files with their names."""
        if not path.is_dir():
            return self._of_file(path)
        files = sorted(entry for entry in path.rglob("*") if entry.is_file())
        named = [(f.relative_to(path).as_posix(), self._of_file(f)) for f in files]
        return of_words(named)

    def save(self) -> None:
        """Remember for the next run."""
        if self._memory is None or not self._changed:
            return
        with staged_file(self._memory) as temporary:
            temporary.write_text(json_text(self._known), encoding="utf-8")
        self._changed = False

    def _of_file(self, file: Path) -> str:
        state = os.stat(file)
        now = [state.st_size, state.st_mtime_ns, state.st_ino]
        remembered = self._known.get(str(file))
        if remembered is not None and remembered[:3] == now:
            return str(remembered[3])
        checksum = _sum_of(file)
        newest = max(state.st_mtime_ns, state.st_ctime_ns)
        if time.time_ns() - newest > _YOUNG_NS:
            self._known[str(file)] = [*now, checksum]
            self._changed = True
        return checksum


def _sum_of(file: Path) -> str:
    total = hashlib.sha256()
    with open(file, "rb") as stream:
        while block := stream.read(_BLOCK):
            total.update(block)
    return total.hexdigest()


def _remembered(memory: Path) -> dict[str, list[int | str]]:
    """Memory of the last run; empty if the file is damaged, so that everything is read again."""
    try:
        content = read_json(memory)
    except InputError:
        return {}
    return {
        name: value
        for name, value in content.items()
        if isinstance(value, list) and len(value) == 4 and isinstance(value[3], str)
    }


_RESULT: Final = "step.json"
_FILES: Final = "files"


@dataclass(frozen=True)
class StepResult:
    """Result of one step: its files, its output and its exit status.

    `status`: exit status of the command.
    `printed`, `complained`: standard output and standard error.
    `files`: name of a file that it wrote, below the session's folder -> SHA-256.
    """

    status: int
    printed: str
    complained: str
    files: Mapping[str, str] = field(default_factory=dict)

    @property
    def lasts(self) -> bool:
        """True if the same call would end alike: it succeeded, or its input is wrong."""
        return self.status in (0, 2, 3)


class Store:
    """Results of steps in a folder.

    `folder`: made where it does not exist.
    `prints`: by which damaged files are known.
    """

    def __init__(self, folder: Path, prints: Fingerprints) -> None:
        self._folder = folder
        self._prints = prints

    def get(self, key: str) -> StepResult | None:
        """The result of a key, if it is there and its files are as they were written."""
        place = self._place(key)
        try:
            result = StepResult(**read_json(place / _RESULT))
        except (InputError, TypeError):
            return None
        if not are_files_below(result.files):
            return None
        return result if self.holds(place / _FILES, result.files) else None

    def holds(self, folder: Path, files: Mapping[str, str]) -> bool:
        """Return True if all files are in a folder, with the bytes that they should have.

        `files`: name -> SHA-256.
        """
        try:
            return all(self._prints.of(folder / name) == of for name, of in files.items())
        except OSError:
            return False

    def put(self, key: str, result: StepResult, work: Path) -> None:
        """Keep a result and its files.

        `work`: folder in which its files lie; they are moved.
        """
        place = self._place(key)
        place.parent.mkdir(parents=True, exist_ok=True)
        with self._aside() as folder:
            for name in result.files:
                (folder / _FILES / name).parent.mkdir(parents=True, exist_ok=True)
                # they may lie on another disk
                shutil.move(work / name, folder / _FILES / name)
            (folder / _RESULT).write_text(json_text(asdict(result)), encoding="utf-8")
            if self.get(key) is None:
                shutil.rmtree(place, ignore_errors=True)
            try:
                folder.rename(place)
            except OSError:
                # Another process was faster; its result is the same.
                if self.get(key) is None:
                    raise

    def lay(self, key: str, result: StepResult, folder: Path) -> None:
        """Put a result's files into a folder: as links to the store where the system can."""
        for name in result.files:
            final = folder / name
            final.parent.mkdir(parents=True, exist_ok=True)
            source = self._place(key) / _FILES / name
            if final.is_file() and final.samefile(source):
                continue
            aside = temporary_name(final, f".partial{final.suffix}")
            try:
                _linked(source, aside)
                os.replace(aside, final)
            except OSError as error:
                error.filename, error.filename2 = os.fspath(final), None
                raise
            finally:
                remove(aside)

    @contextmanager
    def _aside(self) -> Iterator[Path]:
        folder = self._folder / f"partial-{secrets.token_hex(8)}"
        folder.mkdir(parents=True)
        try:
            yield folder
        except OSError as error:
            error.filename, error.filename2 = os.fspath(self._folder), None
            raise
        finally:
            shutil.rmtree(folder, ignore_errors=True)

    def _place(self, key: str) -> Path:
        return self._folder / key[:2] / key


def _linked(source: Path, final: Path) -> None:
    try:
        os.link(source, final)
    except OSError:
        shutil.copyfile(source, final)


def are_files_below(files: Any) -> bool:
    """Return True if this names files with checksums, all below the folder they are in.

    `files`: name -> SHA-256.
    """
    return isinstance(files, Mapping) and all(
        isinstance(of, str) and name and not Path(name).anchor and ".." not in Path(name).parts
        for name, of in files.items()
    )


def states(work: Path) -> dict[str, tuple[int, int, int]]:
    """Name of every file below a folder -> what changes when it is written again."""
    states_by_key = {}
    for path in work.rglob("*"):
        if path.is_file() and not path.is_symlink():
            state = path.stat()
            states_by_key[path.relative_to(work).as_posix()] = (
                state.st_ino,
                state.st_mtime_ns,
                state.st_size,
            )
    return states_by_key
