"""Results of steps, found again by what they were made of: inputs, words and program.

A result is a folder that appears whole, under the SHA-256 of all that it depends on. Whoever made
it, and whenever, it is the same; two machines may write into one store.
"""

from __future__ import annotations

import os
import secrets
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Final

from armimpedance.app.study.fingerprints import Fingerprints
from armimpedance.core.errors import InputError
from armimpedance.core.json_text import json_text, read_json
from armimpedance.core.temporaries import temporary_name

_RESULT: Final = "step.json"
_FILES: Final = "files"


@dataclass(frozen=True)
class Result:
    """What one step left.

    Attributes
    ----------
    status : int
        Exit status of the command.
    printed, complained : str
        Standard output and standard error.
    files : mapping
        Name of a file that it wrote, below the session's folder -> SHA-256.
    """

    status: int
    printed: str
    complained: str
    files: Mapping[str, str] = field(default_factory=dict)

    @property
    def lasts(self) -> bool:
        """Whether the same call would end in the same way: done, or the input is wrong."""
        return self.status in (0, 2, 3)


class Store:
    """Results of steps in a folder.

    Parameters
    ----------
    folder : Path
        Made where it does not exist.
    prints : Fingerprints
        By which damaged files are known.
    """

    def __init__(self, folder: Path, prints: Fingerprints) -> None:
        self._folder = folder
        self._prints = prints

    def get(self, key: str) -> Result | None:
        """The result of a key, if it is there and its files are as they were written.

        Parameters
        ----------
        key : str

        Returns
        -------
        Result or None
        """
        place = self._place(key)
        try:
            result = Result(**read_json(place / _RESULT))
        except (InputError, TypeError):
            return None
        if not are_files_below(result.files):
            return None
        return result if self.holds(place / _FILES, result.files) else None

    def holds(self, folder: Path, files: Mapping[str, str]) -> bool:
        """Whether all files are in a folder, with the bytes that they should have.

        Parameters
        ----------
        folder : Path
        files : mapping
            Name -> SHA-256.

        Returns
        -------
        bool
        """
        try:
            return all(self._prints.of(folder / name) == of for name, of in files.items())
        except OSError:
            return False

    def put(self, key: str, result: Result, work: Path) -> None:
        """Keep a result and its files.

        Parameters
        ----------
        key : str
        result : Result
        work : Path
            Folder in which its files lie; they are moved.
        """
        place = self._place(key)
        place.parent.mkdir(parents=True, exist_ok=True)
        with self._aside() as folder:
            for name in result.files:
                (folder / _FILES / name).parent.mkdir(parents=True, exist_ok=True)
                os.replace(work / name, folder / _FILES / name)
            (folder / _RESULT).write_text(json_text(asdict(result)), encoding="utf-8")
            if self.get(key) is None:
                shutil.rmtree(place, ignore_errors=True)
            try:
                folder.rename(place)
            except OSError:
                # Another process was faster; its result is the same.
                if self.get(key) is None:
                    raise

    def lay(self, key: str, result: Result, folder: Path) -> None:
        """Put a result's files into a folder: as links to the store where the system can.

        Parameters
        ----------
        key : str
        result : Result
        folder : Path
        """
        for name in result.files:
            final = folder / name
            final.parent.mkdir(parents=True, exist_ok=True)
            source = self._place(key) / _FILES / name
            if final.is_file() and final.samefile(source):
                continue
            aside = temporary_name(final, f".partial{final.suffix}")
            try:
                os.link(source, aside)
            except OSError:
                shutil.copyfile(source, aside)
            os.replace(aside, final)

    @contextmanager
    def _aside(self) -> Iterator[Path]:
        folder = self._folder / f"partial-{secrets.token_hex(8)}"
        folder.mkdir(parents=True)
        try:
            yield folder
        finally:
            shutil.rmtree(folder, ignore_errors=True)

    def _place(self, key: str) -> Path:
        return self._folder / key[:2] / key


def are_files_below(files: Any) -> bool:
    """Whether this names files with their checksums, all of them below the folder they are in.

    Parameters
    ----------
    files : object
        Name -> SHA-256.

    Returns
    -------
    bool
    """
    return isinstance(files, Mapping) and all(
        isinstance(of, str) and name and not Path(name).anchor and ".." not in Path(name).parts
        for name, of in files.items()
    )


def states(work: Path) -> dict[str, tuple[int, int, int]]:
    """Name of every file below a folder -> what changes when it is written again.

    Parameters
    ----------
    work : Path

    Returns
    -------
    dict
    """
    found = {}
    for path in work.rglob("*"):
        if path.is_file() and not path.is_symlink():
            state = path.stat()
            found[path.relative_to(work).as_posix()] = (
                state.st_ino,
                state.st_mtime_ns,
                state.st_size,
            )
    return found
