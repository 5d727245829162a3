"""The files of a Kinarm exam: `BB_TT_RR.c3d` and `common.c3d`, in a folder, a zip, or one alone."""

from __future__ import annotations

import os
import re
import zipfile
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Final

from armimpedance.errors import InputError
from armimpedance.recordings.c3d_file import BLOCK, is_c3d, parse_c3d
from armimpedance.recordings.c3d_parameters import Groups, read_groups, texts_of
from armimpedance.recordings.kinarm.exam_file import ExamFile, from_c3d

#: More than any exam unpacked: an hour at 1 kHz with 100 channels is 1.4 GB.
LARGEST_EXAM_BYTES: Final = 4 * 1024**3

#: How deep below its root an exam may lie: `raw/`, or `name/raw/`.
DEEPEST: Final = 2

_TRIAL_NAME: Final = re.compile(r"(?:raw/)?(\d+)_(\d+)_(\d+)\.c3d", re.IGNORECASE)
_COMMON_NAME: Final = "common.c3d"
_NEW_FORMAT: Final = "a C3D export: in Dexterit-E, export the exam as C3D files (.zip)"


@dataclass(frozen=True)
class ExamTrial:
    """One trial: its file's own name and content, block (set), protocol, repetition.

    Folders and exams are often named after people, and are no part of `name`.
    """

    name: str
    file: ExamFile
    block: int
    protocol: int
    repetition: int


@dataclass(frozen=True)
class LeftOut:
    """A trial that is not in the recording; `error` says why, None: it holds no samples."""

    name: str
    error: InputError | None = None

    @property
    def reason(self) -> str:
        """What is wrong, where, in a few words, without the path."""
        if self.error is None:
            return "no samples"
        row = None if self.error.row is None else f"sample {self.error.row}"
        places = ", ".join(filter(None, (row, self.error.column)))
        return f"{places}: {self.error.problem}" if places else self.error.problem


@dataclass(frozen=True)
class Exam:
    """An exam: what all trials share, the trials by file name, and those that hold nothing."""

    common: ExamFile
    trials: tuple[ExamTrial, ...]
    left_out: tuple[LeftOut, ...] = ()


def is_exam(path: Path) -> bool:
    """Whether `path` is a zip or `.kinarm` file, a folder of an exam's files, or one of them."""
    if path.is_dir():
        names = _folder_files(path)
        return any(_is_common(n) or _TRIAL_NAME.fullmatch(PurePosixPath(n).name) for n in names)
    return path.suffix.lower() in (".zip", ".kinarm") or is_exam_file(path)


def is_exam_file(path: Path) -> bool:
    """Whether `path` is a C3D file as Dexterit-E writes it: a trial, or what all trials share."""
    if path.suffix.lower() != ".c3d" or not path.is_file():
        return False
    try:
        data = path.read_bytes()
        groups = read_groups(data, str(path), (data[0] - 1) * BLOCK) if is_c3d(data) else {}
    except (OSError, InputError):
        return False
    # Motion capture has a group TRIAL as well, but more points than two hands.
    points = {*texts_of(groups, "POINT", "LABELS")}
    hands = bool(points) and points <= {"Right_Hand", "Left_Hand"}
    return _is_shared(groups) or (hands and "TRIAL" in groups)


def _is_shared(groups: Groups) -> bool:
    """Whether these are the parameters of what trials share: the robots, and no trial."""
    return "TRIAL" not in groups and bool({"RIGHT_KINARM", "LEFT_KINARM"} & set(groups))


def refuse_new_format(path: Path) -> None:
    """Refuse `.kinarm` files, the format of newer exports, which nothing here reads.

    Raises
    ------
    InputError
        It says how to export the exam instead.
    """
    if path.suffix.lower() == ".kinarm":
        raise InputError("the .kinarm format is not read", file=path, expected=_NEW_FORMAT)


def read_exam(path: str | os.PathLike[str], wanted: Callable[[str], bool]) -> Exam:
    """Read all C3D files of an exam.

    Nothing is unpacked to the disk. A trial without samples, or whose file is broken, is left out.

    Parameters
    ----------
    path : path
        A folder, a zip, or the file of one trial with `common.c3d` beside it.
    wanted : callable
        Which analog channels are kept, by their labels: an exam has some sixty.

    Raises
    ------
    InputError
        There is no exam at `path`, a zip is broken, too large or has paths outside of its folder,
        or no trial can be read.
    """
    with _files(Path(path)) as files:
        root, common = _root(Path(path), files), _common(Path(path), files)
        trials: list[ExamTrial] = []
        left_out: list[LeftOut] = []
        for name in sorted(files):
            numbers = _numbers_of(name, root, alone=Path(path).suffix.lower() == ".c3d")
            if numbers is None:
                continue
            short = PurePosixPath(name).name
            try:
                file = from_c3d(parse_c3d(files[name](), f"{path}:{name}"), wanted)
            except InputError as error:
                left_out.append(LeftOut(short, error))
                continue
            if file.frames == 0:
                left_out.append(LeftOut(short))
            else:
                trials.append(ExamTrial(short, file, *numbers))
    if not trials and not left_out:
        raise InputError("holds no trials", file=path, expected="files such as 01_02_03.c3d")
    if not trials:
        raise none_left(left_out, path)
    return Exam(common, tuple(trials), tuple(left_out))


def read_common(path: str | os.PathLike[str]) -> ExamFile:
    """What the trials of an exam share, without reading them.

    Raises
    ------
    InputError
        As `read_exam`.
    """
    with _files(Path(path)) as files:
        return _common(Path(path), files)


def _common(path: Path, files: _Files) -> ExamFile:
    name = _root(path, files) + _COMMON_NAME
    return from_c3d(parse_c3d(files[name](), f"{path}:{name}"), lambda _: False)


def none_left(left_out: Sequence[LeftOut], path: object) -> InputError:
    """The error where every trial had to be left out: the first reason, and how many there are."""
    broken = [trial.error for trial in left_out if trial.error is not None]
    if not broken:
        problem = f"none of the {len(left_out)} trials holds a sample"
        return InputError(problem, file=path, expected="an exam in which something was recorded")
    first = broken[0]
    if len(left_out) == 1:
        return first
    problem = f"{first.problem}; none of the {len(left_out)} trials can be used"
    return InputError(
        problem, file=first.file, row=first.row, column=first.column, expected=first.expected
    )


def _numbers_of(name: str, root: str, *, alone: bool) -> tuple[int, int, int] | None:
    """Block, protocol and repetition from a file's name; None where it is no trial of the exam."""
    match = _TRIAL_NAME.fullmatch(name[len(root) :]) if name.startswith(root) else None
    if match is None:
        # A single trial may have been given another name.
        return (1, 1, 1) if alone and not _is_common(name) else None
    block, protocol, repetition = (int(part) for part in match.groups())
    return block, protocol, repetition


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
    if path.suffix.lower() == ".c3d":
        yield _single_trial(path)
        return
    try:
        archive = zipfile.ZipFile(path)
    except (zipfile.BadZipFile, OSError) as error:
        raise InputError(f"not a readable zip: {error}", file=path) from None
    with archive:
        yield _zip_files(path, archive)


def _single_trial(path: Path) -> _Files:
    """One trial, and what it shares with the others of its exam, beside it or one folder up."""
    if _is_common(path.name):
        problem = "is what the trials of an exam share, and no trial"
        raise InputError(problem, file=path, expected="a trial beside it, or their folder")
    places = [path.parent / _COMMON_NAME, path.absolute().parent.parent / _COMMON_NAME]
    shared = next((place for place in places if place.is_file()), None)
    if shared is None:
        raise InputError(
            "is one trial of a Kinarm exam, and the exam's common.c3d, which holds the robot's "
            "links and calibration and the trial protocols, is not beside it",
            file=path,
            expected="common.c3d of the same exam beside it; or give the exam's zip or folder",
        )
    return {path.name: _reading(path), _COMMON_NAME: _reading(shared)}


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
        except (zipfile.BadZipFile, zlib.error, EOFError, OSError, MemoryError):
            problem = "cannot be unpacked"
        except (RuntimeError, NotImplementedError):
            problem = "is encrypted or packed in an unknown way"
        place = f"{path}:{info.filename}"
        raise InputError(problem, file=place, expected="a zip that is whole and not encrypted")

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
