"""Outputs appear whole or not at all. Standard library only.

Everything is written under a temporary name beside the final one, flushed to the disk and renamed:
a process that is killed at any moment leaves the old output or the new one under the final name,
and what it leaves beside it is swept by the next run that writes there.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from armimpedance.errors import InputError
from armimpedance.temporaries import exchange, sweep, temporary_name

#: What a recording's folder may hold; such a folder may be replaced by a new one.
RECORDING_FILES: Final = ("recording.json", "trials.csv", "samples.parquet", "samples.csv")


@contextmanager
def staged_file(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Write a file that appears only when it is complete.

    Parameters
    ----------
    path : path
        The final name. An existing file is replaced in one step.

    Yields
    ------
    Path
        A temporary name in the same folder, with the same suffix, to be written to.

    Raises
    ------
    InputError
        The folder does not exist or cannot be written to, or `path` is no regular file.
    """
    final = _final_path(path)
    if final.exists() and not final.is_file():
        raise InputError("is not a regular file", file=path, expected="the name of a file")
    temporary = temporary_name(final, f".partial{final.suffix}")
    try:
        yield temporary
        _flush(temporary)
        os.replace(temporary, final)
        _flush(final.parent)
    finally:
        temporary.unlink(missing_ok=True)


@contextmanager
def staged_folder(
    path: str | os.PathLike[str],
    mark: str = "recording.json",
    known: Collection[str] = RECORDING_FILES,
) -> Iterator[Path]:
    """Write a folder that appears only when it is complete.

    A folder of that name that is there already is replaced only if it is empty, or is plainly an
    earlier output: it holds `mark`, and nothing that is not `known`. Anything else may be
    somebody's only copy.

    Parameters
    ----------
    path : path
        The final name.
    mark : str
        The file by which an earlier output is known.
    known : collection of str
        The names (not deeper than one level) that an earlier output may hold.

    Yields
    ------
    Path
        A temporary empty folder beside `path`.

    Raises
    ------
    InputError
        The parent folder does not exist or cannot be written to, or `path` must not be replaced.
    """
    final = _final_path(path)
    check_replaceable(final, mark, known)
    temporary = temporary_name(final, ".partial")
    temporary.mkdir()
    try:
        yield temporary
        for written in sorted(temporary.rglob("*")):
            _flush(written)
        _flush(temporary)
        check_replaceable(final, mark, known)
        exchange(temporary, final)
        _flush(final.parent)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def check_replaceable(
    path: str | os.PathLike[str],
    mark: str = "recording.json",
    known: Collection[str] = RECORDING_FILES,
) -> None:
    """Refuse a folder that is neither new nor empty nor plainly an earlier output.

    Parameters
    ----------
    path : path
    mark, known
        As for `staged_folder`.

    Raises
    ------
    InputError
        It is a file, or holds what no earlier output holds.
    """
    final = Path(path)
    if not final.exists():
        return
    if not final.is_dir():
        raise InputError("is a file", file=final, expected="the name of a new folder")
    held = sorted(entry.name for entry in final.iterdir())
    foreign = [name for name in held if name not in known and name != mark]
    if held and (foreign or mark not in held):
        example = (foreign or held)[0]
        raise InputError(
            f"the folder exists and is not an earlier output (it holds {example})",
            file=final,
            expected="a new or empty folder",
        )


def _final_path(path: str | os.PathLike[str]) -> Path:
    # A link is written through, not replaced.
    final = Path(os.path.realpath(path))
    if not final.parent.is_dir():
        raise InputError("no such folder", file=final.parent, expected="an existing folder")
    if not os.access(final.parent, os.W_OK):
        raise InputError("no permission to write there", file=final.parent)
    sweep(final.parent)
    return final


def _flush(path: Path) -> None:
    """Have the system put a file or folder on the disk before it is renamed."""
    if os.name == "nt" and path.is_dir():
        return
    handle = os.open(path, os.O_RDONLY if os.name != "nt" else os.O_RDWR)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
