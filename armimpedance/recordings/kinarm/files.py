"""The files of a Kinarm exam, loose in a folder or in a zip: `BB_TT_RR.c3d` and `common.c3d`."""

from __future__ import annotations

import os
import re
import zipfile
import zlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Final

from armimpedance.errors import InputError
from armimpedance.recordings.c3d_file import C3DFile, parse_c3d

#: More than any exam unpacked: an hour at 1 kHz with 100 channels is 1.4 GB.
LARGEST_EXAM_BYTES: Final = 4 * 1024**3

#: How deep below its root an exam may lie: `raw/`, or `name/raw/`.
DEEPEST: Final = 2

_TRIAL_NAME: Final = re.compile(r"(\d+)_(\d+)_(\d+)\.c3d", re.IGNORECASE)
_COMMON_NAME: Final = "common.c3d"
_NEW_FORMAT: Final = "a C3D export: in Dexterit-E, export the exam as C3D files (.zip)"


@dataclass(frozen=True)
class ExamTrial:
    """One trial: block (set), row of the trial-protocol table, repetition, and its C3D file."""

    block: int
    protocol: int
    repetition: int
    c3d: C3DFile


@dataclass(frozen=True)
class Exam:
    """An exam: what all trials share, and the trials in the order of their file names."""

    common: C3DFile
    trials: tuple[ExamTrial, ...]


def is_exam(path: Path) -> bool:
    """Whether `path` is a zip or `.kinarm` file, or a folder with a `common.c3d` in it."""
    if path.is_dir():
        return any(_is_common(name) for name in _folder_files(path))
    return path.suffix.lower() in (".zip", ".kinarm")


def refuse_new_format(path: Path) -> None:
    """Refuse `.kinarm` files, the format of newer exports, which nothing here reads.

    Raises
    ------
    InputError
        It says how to export the exam instead.
    """
    if path.suffix.lower() == ".kinarm":
        raise InputError("the .kinarm format is not read", file=path, expected=_NEW_FORMAT)


def read_exam(path: str | os.PathLike[str]) -> Exam:
    """Read all C3D files of an exam.

    Nothing is unpacked to the disk.

    Raises
    ------
    InputError
        There is no exam at `path`, a zip is broken, too large or has paths outside of its folder,
        or a C3D file in it cannot be read.
    """
    with _files(Path(path)) as files:
        root = _root(Path(path), files)
        common = parse_c3d(files[root + _COMMON_NAME](), f"{path}:{root}{_COMMON_NAME}")
        trials = []
        for name in sorted(files):
            match = _TRIAL_NAME.fullmatch(name[len(root) :]) if name.startswith(root) else None
            if match:
                block, protocol, repetition = (int(part) for part in match.groups())
                c3d = parse_c3d(files[name](), f"{path}:{name}")
                trials.append(ExamTrial(block, protocol, repetition, c3d))
    if not trials:
        raise InputError("holds no trials", file=path, expected="files such as 01_02_03.c3d")
    return Exam(common, tuple(trials))


_Files = Mapping[str, Callable[[], bytes]]


@contextmanager
def _files(path: Path) -> Iterator[_Files]:
    """The files by their names relative to `path`, each with what reads it."""
    refuse_new_format(path)
    if path.is_dir():
        yield {n.as_posix(): _reading(path / n) for n in map(Path, _folder_files(path))}
        return
    if not path.is_file():
        raise InputError("no such file or folder", file=path, expected="a Kinarm exam")
    try:
        archive = zipfile.ZipFile(path)
    except (zipfile.BadZipFile, OSError) as error:
        raise InputError(f"not a readable zip: {error}", file=path) from None
    with archive:
        yield _zip_files(path, archive)


def _folder_files(path: Path) -> list[str]:
    """C3D files at most `DEEPEST` folders below `path`."""
    patterns = ["*/" * depth + "*" for depth in range(DEEPEST + 1)]
    candidates = (file for pattern in patterns for file in path.glob(pattern))
    return [
        file.relative_to(path).as_posix()
        for file in candidates
        if file.suffix.lower() == ".c3d" and file.is_file()
    ]


def _reading(file: Path) -> Callable[[], bytes]:
    def read() -> bytes:
        try:
            return file.read_bytes()
        except OSError as error:
            raise InputError(f"cannot be read: {error.strerror}", file=file) from None

    return read


def _zip_files(path: Path, archive: zipfile.ZipFile) -> _Files:
    members = [info for info in archive.infolist() if not info.is_dir()]
    total = sum(info.file_size for info in members)
    if total > LARGEST_EXAM_BYTES:
        limit = LARGEST_EXAM_BYTES / 1024**3
        raise InputError(
            f"would unpack to {total / 1024**3:.0f} GiB", file=path, expected=f"at most {limit:g}"
        )
    files: dict[str, Callable[[], bytes]] = {}
    for info in members:
        # The name as stored: the library has cut it at a NUL and turned the system's separators.
        name = info.orig_filename.replace("\\", "/")
        parts = PurePosixPath(name).parts
        outside = name.startswith("/") or ".." in parts or re.match(r"[A-Za-z]:", name)
        if outside or not name.isprintable():
            raise InputError(
                f"holds a path outside of its folder: {name[:80]!r}",
                file=path,
                expected="a zip as Dexterit-E writes it",
            )
        if name in files:
            raise InputError(f"holds {name} twice", file=path, expected="every trial once")
        files[name] = _unpacking(path, archive, info)
    return files


def _unpacking(path: Path, archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> Callable[[], bytes]:
    def read() -> bytes:
        try:
            # Reads no more than the size that was checked above; a longer member fails its CRC.
            return archive.read(info)
        except (zipfile.BadZipFile, zlib.error, EOFError, OSError, MemoryError) as error:
            problem = f"{info.filename} cannot be unpacked: {error}"
        except (RuntimeError, NotImplementedError):
            problem = f"{info.filename} is encrypted or packed in an unknown way"
        raise InputError(problem, file=path, expected="a zip that is whole and not encrypted")

    return read


def _root(path: Path, files: _Files) -> str:
    """The folder of the one exam among the files, with its slash; empty at the top."""
    roots = {name[: -len(_COMMON_NAME)] for name in files if _is_common(name)}
    if len(roots) == 1:
        return roots.pop()
    if roots:
        raise InputError(f"holds {len(roots)} exams", file=path, expected="one common.c3d")
    if any("/common/" in f"/{name}" for name in files):
        raise InputError("the .kinarm format is not read", file=path, expected=_NEW_FORMAT)
    raise InputError("holds no common.c3d", file=path, expected="a Kinarm exam of C3D files")


def _is_common(name: str) -> bool:
    return name.rsplit("/", 1)[-1] == _COMMON_NAME and name.count("/") <= DEEPEST
