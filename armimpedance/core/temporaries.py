"""Temporary names of outputs: creation, exchange with the final name, removal after a killed run.

Standard library only. A temporary is called ``.armimpedance-<host>-<process>-<start>-<token>`` and
an ending. Temporaries of a process that has ended are removed by the next process that writes to
the folder. A process is identified by its number and its start time: numbers are reused, after a
restart of the machine or, in a container, by the very next run. Where the system can exchange two
names in one call (Linux, macOS), a folder is never absent; elsewhere the old folder is moved aside,
and moved back by the next run if the process was killed in between.
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
#: The same for macOS's renamex_np.
_RENAME_SWAP = 2
#: Most attempts to take a name that other processes write to; more conflicts are an error.
_TRIES: Final = 10


def temporary_name(final: Path, ending: str) -> Path:
    """Return a new name in the folder of the final one, which identifies the process.

    `ending`: ``.partial`` and a file's suffix, or ``.old``.
    """
    process = os.getpid()
    who = f"{_host()}-{process}-{_start(process) or 0}"
    return final.with_name(f".armimpedance-{who}-{secrets.token_hex(4)}{ending}")


def sweep(folder: Path) -> None:
    """Remove temporaries of this machine's ended processes from a folder.

    An old folder that was moved aside by a killed process is moved back if its name is still free.
    Entries that cannot be removed and folders that cannot be listed are skipped.
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
    Returns: True if another folder had the final name; it has the temporary name now.
    """
    # Another process may take the name after the test; the next round sees it.
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
    """Remove a temporary file or folder, as far as the system allows."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
    else:
        with suppress(OSError):
            path.unlink(missing_ok=True)


def _exchanged(first: Path, second: Path) -> bool:
    """Exchange two names in one system call; return whether the system could."""
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
    """Replace a folder where names cannot be exchanged; the old folder is never lost."""
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
        # Removed only if empty: a folder that could not be moved back waits for the next run.
        with suppress(OSError):
            aside.rmdir()
    return True


def _put_back(aside: Path) -> None:
    for old in list(aside.iterdir()):
        home = aside.with_name(old.name)
        if not home.exists():
            old.rename(home)


def _host() -> str:
    """Identifier of this machine, eight letters: several may share a folder.

    A container, which numbers its own processes, counts as a machine.
    """
    try:
        numbering = os.stat("/proc/self/ns/pid").st_ino
    except OSError:
        numbering = 0
    return hashlib.sha256(f"{platform.node()} {numbering}".encode()).hexdigest()[:8]


def _runs(process: int, start: int) -> bool:
    """True if the process of this number and start time still runs."""
    if os.name == "nt":
        return True  # On Windows this test would end the process.
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (PermissionError, OverflowError):
        pass
    started = _start(process)
    return not start or started is None or started == start


def _start(process: int) -> int | None:
    """Start time of a process in ticks since the machine started; None if unknown.

    -1 for a process that was killed and whose parent has not yet collected its status.
    """
    try:
        text = Path(f"/proc/{process}/stat").read_text(encoding="utf-8", errors="replace")
        # The name of the program is in brackets and may contain anything.
        fields = text.rpartition(")")[2].split()
        return -1 if fields[0] in "ZX" else int(fields[19])
    except (OSError, ValueError, IndexError):
        return None
