"""A Kinarm exam as its files: data common to all trials, the trials, and those left out.

Two layouts: C3D files `BB_TT_RR.c3d` beside `common.c3d`, and archives (`archive`).
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import Final

from armimpedance.core.errors import InputError
from armimpedance.core.findings import Finding
from armimpedance.recordings.c3d.c3d_file import parameters_of, parse_c3d
from armimpedance.recordings.c3d.parameters import Groups
from armimpedance.recordings.kinarm.archive import Archive, archive_roots
from armimpedance.recordings.kinarm.exam_file import (
    COMMON_NAME,
    ExamFile,
    ExamStore,
    Files,
    files_of,
    folder_files,
    from_c3d,
    is_common,
)

_TRIAL_NAME: Final = re.compile(r"(?:raw/)?(\d+)_(\d+)_(\d+)\.c3d", re.IGNORECASE)

#: Block, protocol and repetition of a trial.
_Numbers = tuple[int, int, int]


@dataclass(frozen=True)
class ExamTrial:
    """One trial: name and content of its file, block (set), protocol, repetition.

    `name` has no folders, since folders and exams are often named after people.
    """

    name: str
    file: ExamFile
    block: int
    protocol: int
    repetition: int


@dataclass(frozen=True)
class LeftOut:
    """A trial that is left out; `error` is the reason, None: it holds no samples."""

    name: str
    error: InputError | None = None

    @property
    def reason(self) -> str:
        """Short text of the error and its place, without the path."""
        if self.error is None:
            return "no samples"
        row = None if self.error.row is None else f"sample {self.error.row}"
        places = ", ".join(filter(None, (row, self.error.column)))
        return f"{places}: {self.error.problem}" if places else self.error.problem


@dataclass(frozen=True)
class Exam:
    """An exam: data common to all trials, the trials by file name, and those left out.

    `beside` lists other contents, which are not read, in words.
    """

    common: ExamFile
    trials: tuple[ExamTrial, ...]
    left_out: tuple[LeftOut, ...] = ()
    beside: tuple[str, ...] = ()


def is_exam(path: Path) -> bool:
    """Return True for a zip or `.kinarm` file, a folder of an exam's files, or one of them."""
    if path.is_dir():
        names = folder_files(path)
        c3d = (n for n in names if is_common(n) or _TRIAL_NAME.fullmatch(PurePosixPath(n).name))
        return any(c3d) or any(n.endswith("common/parameters.bin") for n in names)
    return path.suffix.lower() in (".zip", ".kinarm") or is_exam_file(path)


def is_exam_file(path: Path) -> bool:
    """Return True for a C3D file by Dexterit-E: a trial, or the data common to all trials."""
    if path.suffix.lower() != ".c3d" or not path.is_file():
        return False
    try:
        parameters = parameters_of(path.read_bytes(), str(path))
    except (OSError, InputError):
        return False
    # motion capture also has a group TRIAL, but other points than two hands
    groups, points = parameters.groups, {*parameters.texts("POINT", "LABELS")}
    hands = bool(points) and points <= {"Right_Hand", "Left_Hand"}
    return _is_shared(groups) or (hands and "TRIAL" in groups)


def _is_shared(groups: Groups) -> bool:
    """True if these are the parameters of `common.c3d`: robots, and no trial."""
    return "TRIAL" not in groups and bool({"RIGHT_KINARM", "LEFT_KINARM"} & set(groups))


def read_exam(
    path: str | os.PathLike[str],
    wanted: Callable[[str], bool],
    kept: Callable[[ExamFile], ExamFile] | None = None,
) -> Exam:
    """Read all trials of an exam.

    Nothing is unpacked to the disk. A trial without samples, or with a broken part that is needed,
    is left out.

    `path`: a folder, a zip, a `.kinarm`, or the file of one trial with `common.c3d` beside it.
    `wanted`: function of a channel's label: True if the channel is read; an exam has about sixty.
    `kept`: function that reduces a trial before the next one is read; None keeps all of it.
    Raises InputError: there is no exam at `path`, a zip is broken, too large or has paths outside
    of its folder, the common data are damaged, or no trial can be read.
    """
    with files_of(Path(path)) as files:
        layout = _layout(Path(path), files, wanted)
        common = layout.common()
        trials: list[ExamTrial] = []
        left_out: list[LeftOut] = []
        for name, numbers in layout.trials():
            short = PurePosixPath(name).name
            try:
                file = layout.trial(name)
            except InputError as error:
                left_out.append(LeftOut(short, error))
                continue
            if file.frames == 0:
                left_out.append(LeftOut(short))
            else:
                file = file if kept is None else kept(file)
                trials.append(ExamTrial(short, file, *numbers))
        beside = _beside(files, trials)
    if not trials and not left_out:
        raise InputError("holds no trials", file=path, expected="files such as 01_02_03.c3d")
    if not trials:
        raise none_left(left_out, path)
    return Exam(common, tuple(trials), tuple(left_out), beside)


def read_common(path: str | os.PathLike[str]) -> ExamFile:
    """Read the data common to the trials of an exam, without the trials.

    Raises InputError: as `read_exam`.
    """
    with files_of(Path(path)) as files:
        return _layout(Path(path), files, lambda _: False).common()


def none_left(left_out: Sequence[LeftOut], path: object) -> InputError:
    """Return the error if every trial is left out: the first reason, and their number."""
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


def left_out_findings(left_out: Sequence[LeftOut], exam: Exam) -> list[Finding]:
    """Return findings on the trials that are left out, with names and reasons."""
    total = len(exam.trials) + len(exam.left_out)
    empty = sorted(trial.name for trial in left_out if trial.error is None)
    broken = [f"{trial.name} ({trial.reason})" for trial in left_out if trial.error is not None]
    findings = []
    if empty:
        text = f"{len(empty)} of {total} hold no samples and are left out: {', '.join(empty)}"
        findings.append(Finding("empty trials", "warning", text))
    if broken:
        text = f"{len(broken)} of {total} are left out: {', '.join(sorted(broken))}"
        findings.append(Finding("broken trials", "warning", text))
    return findings


def _beside(files: Files, trials: Sequence[ExamTrial]) -> tuple[str, ...]:
    """Contents of an exam other than its trials' samples, in words."""
    folders = {part.lower() for name in files for part in name.split("/")[:-1]}
    present = {
        "the results of an analysis": "analysis" in folders,
        "the exam's own label": any(PurePosixPath(n).name == "description.txt" for n in files),
        "times at which frames were shown": any(t.file.acknowledgements for t in trials),
    }
    return tuple(content for content, is_present in present.items() if is_present)


@dataclass(frozen=True)
class _C3DExam:
    """An exam of C3D files, with the same methods as `Archive`."""

    path: Path
    files: Files
    root: str
    wanted: Callable[[str], bool]
    store: ExamStore = field(default_factory=ExamStore)

    def trials(self) -> Iterator[tuple[str, _Numbers]]:
        for name in sorted(self.files):
            numbers = self._numbers_of(name)
            if numbers is not None:
                yield name, numbers

    def common(self) -> ExamFile:
        return self.trial(self.root + COMMON_NAME)

    def trial(self, name: str) -> ExamFile:
        data = self.files[name](None)
        return from_c3d(parse_c3d(data, f"{self.path}:{name}"), self.wanted, self.store)

    def _numbers_of(self, name: str) -> _Numbers | None:
        """Block, protocol and repetition from a file's name; None if it is not a trial."""
        inside = name[len(self.root) :] if name.startswith(self.root) else ""
        match = _TRIAL_NAME.fullmatch(inside)
        if match is None:
            # a single trial may have been renamed
            alone = self.path.suffix.lower() == ".c3d" and not is_common(name)
            return (1, 1, 1) if alone else None
        block, protocol, repetition = (int(part) for part in match.groups())
        return block, protocol, repetition


def _layout(path: Path, files: Files, wanted: Callable[[str], bool]) -> Archive | _C3DExam:
    """Find the exam among the files.

    Raises InputError: there is no exam, or more than one.
    """
    shared = {name[: -len(COMMON_NAME)] for name in files if is_common(name)}
    archives = archive_roots(files)
    if len(shared) + len(archives) > 1:
        problem = f"holds {len(shared) + len(archives)} exams"
        raise InputError(problem, file=path, expected="one common.c3d, or one folder common")
    if archives:
        return Archive(path, files, archives.pop(), wanted)
    if shared:
        return _C3DExam(path, files, shared.pop(), wanted)
    expected = "a Kinarm exam of C3D files, or a .kinarm archive"
    raise InputError("holds no common.c3d and no folder common", file=path, expected=expected)
