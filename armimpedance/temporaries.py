"""Temporary names beside outputs: made, exchanged with the final name, swept when a run was killed.

Standard library only. A temporary is called ``.armimpedance-<host>-<process>-<token>`` and an
ending; what a process that is gone has left in a folder is removed by the next one that writes
there. Where the system can exchange two names in one call (Linux, macOS), a folder is never
absent; elsewhere the old one is put aside, and put back by the next run if the process was killed
in between.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import platform
import re
import secrets
import shutil
import sys
from pathlib import Path
from typing import Final

_NAME: Final = re.compile(r"\.armimpedance-([0-9a-f]{8})-(\d+)-[0-9a-f]{8}\.(partial|old)(\..*)?")
#: Linux's renameat2: from the working folder, exchange the two names.
_AT_FDCWD, _RENAME_EXCHANGE = -100, 2
#: The same of macOS's renamex_np.
_RENAME_SWAP = 2


def temporary_name(final: Path, ending: str) -> Path:
    """A new name beside the final one, which says which process made it.

    Parameters
    ----------
    final : Path
    ending : str
        ``.partial`` and a file's suffix, or ``.old``.

    Returns
    -------
    Path
    """
    name = f".armimpedance-{_host()}-{os.getpid()}-{secrets.token_hex(4)}{ending}"
    return final.with_name(name)


def sweep(folder: Path) -> None:
    """Remove what processes of this machine that are gone left in a folder.

    An old folder whose name is free, since its writer was killed before the new one had it, is put
    back.

    Parameters
    ----------
    folder : Path
    """
    for entry in list(os.scandir(folder)):
        match = _NAME.fullmatch(entry.name)
        if match is None or match[1] != _host() or _runs(int(match[2])):
            continue
        if match[3] == "old":
            _put_back(Path(entry.path))
        _remove(Path(entry.path))


def exchange(temporary: Path, final: Path) -> None:
    """Give a finished folder its final name; the one that had it is removed.

    Parameters
    ----------
    temporary, final : Path
        In one folder.
    """
    if not final.exists():
        temporary.rename(final)
    elif not _exchanged(temporary, final):
        _put_aside(temporary, final)


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


def _put_aside(temporary: Path, final: Path) -> None:
    """Replace a folder where names cannot be exchanged: the old one can be found again."""
    aside = temporary_name(final, ".old")
    aside.mkdir()
    final.rename(aside / final.name)
    try:
        temporary.rename(final)
    except OSError:
        (aside / final.name).rename(final)
        raise
    finally:
        shutil.rmtree(aside, ignore_errors=True)


def _put_back(aside: Path) -> None:
    for old in list(aside.iterdir()):
        home = aside.with_name(old.name)
        if not home.exists():
            old.rename(home)


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)


def _host() -> str:
    """This machine, as eight letters: a folder may be shared by several."""
    return hashlib.sha256(platform.node().encode()).hexdigest()[:8]


def _runs(process: int) -> bool:
    if os.name == "nt":
        return True  # There, asking whether a process runs would end it.
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (PermissionError, OverflowError):
        return True
    return True
