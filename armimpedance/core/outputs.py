"""Outputs that appear whole or not at all. Standard library only.

Everything is written under a temporary name in the folder of the final one, flushed to the disk and
renamed. A process that is killed at any moment leaves the old output or the new one under the final
name; its temporary files are removed by the next run that writes there. If two processes write the
same output at once, the output of one of them remains, whole.
"""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Final

from armimpedance.core.errors import InputError
from armimpedance.core.temporaries import exchange, remove, sweep, temporary_name

#: Files of a recording's folder; a folder with only these may be replaced by a new one.
RECORDING_FILES: Final = ("recording.json", "trials.csv", "samples.parquet", "samples.csv")

_FULL: Final = {errno.ENOSPC, getattr(errno, "EDQUOT", errno.ENOSPC)}
#: Error numbers of a disk.
_DISK: Final = {*_FULL, errno.EFBIG, errno.EIO}

_WITHIN: Final[ContextVar[Path | None]] = ContextVar("folder of all outputs", default=None)


@contextmanager
def written_within(folder: Path) -> Iterator[None]:
    """Refuse, within this block, every output that would lie outside a folder.

    `folder`: must exist."""
    token = _WITHIN.set(folder.resolve())
    try:
        yield
    finally:
        _WITHIN.reset(token)


@contextmanager
def staged_file(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Write a file that appears only when it is complete.

    `path`: the final name. An existing file is replaced in one step; the new one gets its
    permissions.
    Yields: a temporary name in the same folder, with the same suffix, to be written to.
    Raises InputError: the folder does not exist or cannot be written to, or `path` is no regular
    file or write-protected.
    """
    final = _final_path(path)
    check_file_replaceable(final)
    temporary = temporary_name(final, f".partial{final.suffix}")
    try:
        yield temporary
        _flush(temporary)
        _like_the_old(temporary, final)
        os.replace(temporary, final)
        _flush_names(final.parent)
    except Exception as error:
        if (named := _with_its_name(error, temporary, path)) is not error:
            raise named from None
        raise
    finally:
        remove(temporary)


@contextmanager
def staged_folder(
    path: str | os.PathLike[str],
    mark: str = "recording.json",
    known: Collection[str] = RECORDING_FILES,
) -> Iterator[Path]:
    """Write a folder that appears only when it is complete.

    An existing folder of that name is replaced only if it is empty or an earlier output, which
    holds `mark` and only names in `known`. Any other folder may be the only copy of someone's data.

    `path`: the final name.
    `mark`: the file by which an earlier output is recognised.
    `known`: the names (not deeper than one level) that an earlier output may hold.
    Yields: a temporary empty folder beside `path`.
    Raises InputError: the parent folder does not exist or cannot be written to, or `path` must not
    be replaced.
    """
    final = _final_path(path)
    check_replaceable(final, mark, known)
    temporary = temporary_name(final, ".partial")
    try:
        temporary.mkdir()
        yield temporary
        for written in sorted(temporary.rglob("*")):
            _flush_names(written) if written.is_dir() else _flush(written)
        _flush_names(temporary)
        check_replaceable(final, mark, known)
        _like_the_old(temporary, final)
        if exchange(temporary, final):
            _keep_what_came_meanwhile(temporary, final, mark, known)
        _flush_names(final.parent)
    except Exception as error:
        if (named := _with_its_name(error, temporary, path)) is not error:
            raise named from None
        raise
    finally:
        remove(temporary)


def check_replaceable(
    path: str | os.PathLike[str],
    mark: str = "recording.json",
    known: Collection[str] = RECORDING_FILES,
) -> None:
    """Refuse a folder that exists and is neither empty nor an earlier output.

    `mark`, `known`: as for `staged_folder`.
    Raises InputError: it is a file or write-protected, or holds a file that no output has.
    """
    final = Path(path)
    if not final.exists():
        return
    if not final.is_dir():
        raise InputError("is a file", file=final, expected="the name of a new folder")
    if not final.stat().st_mode & 0o222:
        raise InputError("is write-protected", file=final, expected="another name")
    names = _held(final)
    foreign = [name for name in names if name not in known and name != mark]
    if names and (foreign or mark not in names):
        example = (foreign or names)[0]
        raise InputError(
            f"the folder exists and is not an earlier output (it holds {example})",
            file=final,
            expected="a new or empty folder",
        )


def _held(folder: Path) -> list[str]:
    """Names in a folder; listed again if another process replaced the folder meanwhile."""
    while True:
        before = folder.stat().st_ino
        names = sorted(entry.name for entry in folder.iterdir())
        if folder.stat().st_ino == before:
            return names


def check_file_replaceable(path: str | os.PathLike[str]) -> None:
    """Refuse a path that a file must not replace.

    Raises InputError: it is a folder, a device or a pipe, or a write-protected file.
    """
    try:
        mode = os.stat(path).st_mode
    except FileNotFoundError:
        return
    if not stat.S_ISREG(mode):
        raise InputError("is not a regular file", file=path, expected="the name of a file")
    # A rename ignores the file's own protection, and an administrator may write to any file.
    if not mode & 0o222 or not os.access(path, os.W_OK):
        raise InputError("is write-protected", file=path, expected="another name")


def _final_path(path: str | os.PathLike[str]) -> Path:
    # A link is written through, not replaced.
    final = Path(os.path.realpath(path))
    within = _WITHIN.get()
    if within is not None and not final.is_relative_to(within):
        raise InputError("lies outside of the folder of what is written", file=path)
    if final.is_symlink():
        raise InputError("is a link to itself", file=path, expected="the name of a file or folder")
    if not final.parent.is_dir():
        raise InputError("no such folder", file=final.parent, expected="an existing folder")
    if not os.access(final.parent, os.W_OK):
        raise InputError("no permission to write there", file=final.parent)
    sweep(final.parent)
    return final


def _with_its_name(error: Exception, temporary: Path, path: str | os.PathLike[str]) -> Exception:
    """Return the error to raise, which names the output if the system's error names no file.

    Returns: the system's error, also if a library raised another one because of it.
    """
    cause: BaseException | None = error
    while cause is not None and not (isinstance(cause, OSError) and cause.errno in _DISK):
        cause = cause.__context__
    raised = cause if isinstance(cause, OSError) else error
    if isinstance(raised, OSError):
        named = "" if raised.filename is None else os.fsdecode(raised.filename)
        if not named or named.startswith(str(temporary)):
            raised.filename, raised.filename2 = os.fspath(path), None
    return raised


def is_full(error: BaseException) -> bool:
    """Return True if an error says that the disk, or the user's quota on it, is full."""
    return isinstance(error, OSError) and error.errno in _FULL


@contextmanager
def kept_so_far(folder: Path) -> Iterator[None]:
    """Turn an error of a full disk into one that states that the parts written so far are kept.

    `folder`: the folder of the parts, for an error that names no file.
    """
    try:
        yield
    except OSError as error:
        if not is_full(error):
            raise
        problem = f"{error.strerror}; what was done is kept, and the same call goes on from there"
        raise OSError(error.errno, problem, error.filename or os.fspath(folder)) from None


def _like_the_old(temporary: Path, final: Path) -> None:
    """Give a finished output the permissions of the output that it replaces."""
    try:
        mode = stat.S_IMODE(final.stat().st_mode)
    except FileNotFoundError:
        return
    if mode != stat.S_IMODE(temporary.stat().st_mode):
        temporary.chmod(mode)


def _keep_what_came_meanwhile(
    replaced: Path, final: Path, mark: str, known: Collection[str]
) -> None:
    """Undo the exchange if a foreign file was put into the old folder meanwhile."""
    try:
        check_replaceable(replaced, mark, known)
    except InputError:
        exchange(replaced, final)
        check_replaceable(final, mark, known)


def _flush(path: Path) -> None:
    """Have the system write a file to the disk before it is renamed."""
    handle = os.open(path, os.O_RDONLY if os.name != "nt" else os.O_RDWR)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _flush_names(folder: Path) -> None:
    """Flush the names in a folder to the disk, if the system can do so."""
    if os.name == "nt":
        return
    try:
        _flush(folder)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP, errno.EACCES):
            raise
