"""The kinds of file whose columns a mapping explains, and where the mapping of a file lies."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from armimpedance.core.errors import InputError
from armimpedance.core.inputs import unchanged
from armimpedance.core.method_table import MethodTable
from armimpedance.recordings.mapped.apply import ReadFile
from armimpedance.recordings.mapped.columns_toml import MAPPING_FILE
from armimpedance.recordings.mapped.raw_file import Source, Wanted
from armimpedance.recordings.mapped.side_by_side import natural

#: One file in the folder is one kind.
SOURCES: Final = MethodTable[Source]("armimpedance.recordings.sources", "SOURCE", "kind of file")

#: Files of notes that lie in any folder: they do not make it a recording.
_NOTES: Final = (".txt", ".dat")


def source_of(path: Path) -> Source | None:
    """The kind of an existing file or folder, or None."""
    return next((source for source in SOURCES.values() if source.recognises(path)), None)


def is_mapped(path: Path) -> bool:
    """Whether a mapping can explain what is at an existing path."""
    if source_of(path) is not None:
        return True
    if not path.is_dir():
        return False
    return (path / MAPPING_FILE).is_file() or any(
        child.suffix.lower() not in _NOTES and source_of(child) is not None
        for child in sorted(path.iterdir())
        if child.is_file()
    )


def mapping_of(path: Path, stated: Path | None) -> Path:
    """The mapping file for a file or folder: the stated one, or `columns.toml` with it.

    Raises
    ------
    InputError
        There is none.
    """
    if stated is not None:
        return stated
    found = (path if path.is_dir() else path.parent) / MAPPING_FILE
    if found.is_file():
        return found
    raise InputError(
        "nothing says what its columns mean",
        file=path,
        expected=f"--mapping FILE, or {found.name} beside it: `armimpedance map-columns "
        f"{path.name}` proposes one",
    )


def files_of(path: Path, pattern: str | None) -> tuple[Path, ...]:
    """The files that a path stands for: itself, or those of a folder, in their natural order.

    Raises
    ------
    InputError
        The folder has none, or files of several kinds and nothing says which.
    """
    if source_of(path) is not None:
        return (path,)
    if not path.is_dir():
        names = "; ".join(source.name for source in SOURCES.values())
        raise InputError("is of no known kind", file=path, expected=names)
    wanted = "*" if pattern is None else pattern
    if Path(wanted).is_absolute() or ".." in Path(wanted).parts:
        raise InputError(f"files = {wanted!r}", file=path, expected="names inside of the folder")
    there = [file for file in path.glob(wanted) if file.is_file() and file.name != MAPPING_FILE]
    known = [file for file in there if source_of(file) is not None]
    if pattern is None:
        known = [f for f in known if f.suffix.lower() not in _NOTES] or known
    if not known:
        raise InputError("holds no file of a known kind", file=path, expected=f"files = {wanted!r}")
    endings = sorted({file.suffix.lower() for file in known})
    if len(endings) > 1:
        expected = 'files = "*.csv" or the like in the mapping'
        raise InputError(f"holds {' and '.join(endings)} files", file=path, expected=expected)
    return tuple(sorted(known, key=lambda file: natural(str(file.relative_to(path)))))


def read_files(files: tuple[Path, ...], wanted: Wanted) -> tuple[ReadFile, ...]:
    """Read files of known kinds.

    Raises
    ------
    InputError
        What is wrong with one of them.
    """
    found = []
    for file in files:
        source = source_of(file)
        if source is None:
            raise InputError("is of no known kind", file=file)
        with unchanged(file):
            found.append(ReadFile(file, source.read(file, wanted)))
    return tuple(found)
