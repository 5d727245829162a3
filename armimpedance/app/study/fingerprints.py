"""What tells that a file, a folder or the program has changed: SHA-256 of the bytes.

A file that has the size, the time and the inode that it had when it was last read is not read
again; a change that keeps all three is not seen.
"""

from __future__ import annotations

import hashlib
import os
import time
from pathlib import Path
from typing import Final

from armimpedance.core.errors import InputError
from armimpedance.core.json_text import json_text, read_json
from armimpedance.core.outputs import staged_file
from armimpedance.core.program import of_words

_BLOCK: Final = 1 << 20
#: What is younger than this when it is read may be written again within one tick of the clock.
_YOUNG_NS: Final = 2_000_000_000


class Fingerprints:
    """SHA-256 of files and folders, remembered between runs.

    Parameters
    ----------
    memory : Path, optional
        File that remembers; made by `save`.
    """

    def __init__(self, memory: Path | None = None) -> None:
        self._memory = memory
        self._known: dict[str, list[int | str]] = {}
        self._changed = False
        if memory is not None and memory.is_file():
            self._known = _remembered(memory)

    def of(self, path: Path) -> str:
        """SHA-256 of a file, or of a folder's files with their names.

        Parameters
        ----------
        path : Path

        Returns
        -------
        str
        """
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
        known = self._known.get(str(file))
        if known is not None and known[:3] == now:
            return str(known[3])
        found = _sum_of(file)
        newest = max(state.st_mtime_ns, state.st_ctime_ns)
        if time.time_ns() - newest > _YOUNG_NS:
            self._known[str(file)] = [*now, found]
            self._changed = True
        return found


def _sum_of(file: Path) -> str:
    total = hashlib.sha256()
    with open(file, "rb") as stream:
        while block := stream.read(_BLOCK):
            total.update(block)
    return total.hexdigest()


def _remembered(memory: Path) -> dict[str, list[int | str]]:
    """What the last run remembered; nothing where the file is damaged: all is read again."""
    try:
        content = read_json(memory)
    except InputError:
        return {}
    return {
        name: value
        for name, value in content.items()
        if isinstance(value, list) and len(value) == 4 and isinstance(value[3], str)
    }
