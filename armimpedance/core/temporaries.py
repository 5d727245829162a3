"""Temporary names beside outputs: made, exchanged with the final name, swept when a run was killed.

Standard library only. A temporary is called ``.armimpedance-<host>-<process>-<start>-<token>`` and
an ending; what a process that is gone has left in a folder is removed by the next one that writes
there. A process is told by its number and by when it started: numbers are given again, after a
restart of the machine or in a container to the very next run. Where the system can exchange two
names in one call (Linux, macOS), a folder is never absent; elsewhere the old one is put aside, and
put back by the next run if the process was killed in between.
"""

from __future__ import annotations

import ctypes
import errno
import hashlib
import os
import platform
import re
import secrets
import shutil
import sys
from contextlib import suppress
from pathlib import Path
from typing import Final

_NAME: Final = re.compile(
    r"\.armimpedance-([0-9a-f]{8})-(\d+)-(\d+)-[0-9a-f]{8}\.(partial|old)(\..*)?"
)
#: Linux's renameat2: from the working folder, exchange the two names.
_AT_FDCWD, _RENAME_EXCHANGE = -100, 2
#: The same of macOS's renamex_np.
_RENAME_SWAP = 2
#: Two writers of one name meet once, or a few times; this often, something is wrong.
_TRIES: Final = 10


def temporary_name(final: Path, ending: str) -> Path:
    """A new name beside the final one, which says which process made it.

    `ending`: ``.partial`` and a file's suffix, or ``.old``.
    """
    process = os.getpid()
    who = f"{_host()}-{process}-{_start(process) or 0}"
    return final.with_name(f".armimpedance-{who}-{secrets.token_hex(4)}{ending}")


def sweep(folder: Path) -> None:
    """Remove what processes of this machine that are gone left in a folder.

    An old folder whose name is free, since its writer was killed before the new one had it, is put
    back. What cannot be removed, or a folder that cannot be listed, is passed over.
    """
    try:
        entries = [Path(entry.path) for entry in os.scandir(folder)]
    except OSError:
        return
    for entry in entries:
        match = _NAME.fullmatch(entry.name)
        if match is None or match[1] != _host() or _runs(int(match[2]), int(match[3])):
            continue
        # Another run may be sweeping the same folder.
        with suppress(OSError):
            if match[4] == "old":
                _put_back(entry)
            remove(entry)


def exchange(temporary: Path, final: Path) -> bool:
    """Give a finished folder its final name.

    `temporary`, `final`: in one folder.
    Returns: whether a folder had the name until now; it has the temporary one then.
    """
    # Another writer may take the name between the look and the step; the second look sees it.
    for _ in range(_TRIES):
        if not final.exists():
            try:
                temporary.rename(final)
            except OSError as error:
                if error.errno not in (errno.ENOTEMPTY, errno.EEXIST):
                    raise
                continue
            return False
        if _exchanged(temporary, final):
            return True
        if final.exists():
            return _put_aside(temporary, final)
    raise OSError(errno.EBUSY, os.strerror(errno.EBUSY), str(final))


def remove(path: Path) -> None:
    """Remove a temporary file or folder, as far as the system lets us."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
    else:
        with suppress(OSError):
            path.unlink(missing_ok=True)


def _exchanged(first: Path, second: Path) -> bool:
    """Exchange two names in one system call; whether the system could."""
    names = os.fsencode(first), os.fsencode(second)
    try:
        system = ctypes.CDLL(None, use_errno=True)
        if sys.platform == "linux":
            done = system.renameat2(_AT_FDCWD, names[0], _AT_FDCWD, names[1], _RENAME_EXCHANGE)
        elif sys.platform == "darwin":
            done = system.renamex_np(*names, _RENAME_SWAP)
        else:
            return False
    except (OSError, AttributeError, TypeError):
        return False
    return bool(done == 0)


def _put_aside(temporary: Path, final: Path) -> bool:
    """Replace a folder where names cannot be exchanged: the old one can be found again."""
    aside = temporary_name(final, ".old")
    aside.mkdir()
    try:
        final.rename(aside / final.name)
        try:
            temporary.rename(final)
        except OSError:
            (aside / final.name).rename(final)
            raise
        (aside / final.name).rename(temporary)
    finally:
        # Only an empty one goes: what could not be put back waits for the next run.
        with suppress(OSError):
            aside.rmdir()
    return True


def _put_back(aside: Path) -> None:
    for old in list(aside.iterdir()):
        home = aside.with_name(old.name)
        if not home.exists():
            old.rename(home)


def _host() -> str:
    """This machine, as eight letters: a folder may be shared by several.

    A container numbers its processes for itself: it is a machine of its own.
    """
    try:
        numbering = os.stat("/proc/self/ns/pid").st_ino
    except OSError:
        numbering = 0
    return hashlib.sha256(f"{platform.node()} {numbering}".encode()).hexdigest()[:8]


def _runs(process: int, start: int) -> bool:
    """Whether the process of that number that started then still runs."""
    if os.name == "nt":
        return True  # There, asking whether a process runs would end it.
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (PermissionError, OverflowError):
        pass
    known = _start(process)
    return not start or known is None or known == start


def _start(process: int) -> int | None:
    """When a process started, in ticks since the machine did; None where nobody says.

    -1 for one that was killed and that nobody has asked after: it only has a number still.
    """
    try:
        text = Path(f"/proc/{process}/stat").read_text(encoding="utf-8", errors="replace")
        # The name of the program stands in brackets and may hold anything.
        fields = text.rpartition(")")[2].split()
        return -1 if fields[0] in "ZX" else int(fields[19])
    except (OSError, ValueError, IndexError):
        return None
