"""The steps of one session, each done or found again."""

from __future__ import annotations

import errno
import io
import os
import shutil
import tempfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import chdir, redirect_stderr, redirect_stdout
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from armimpedance.app.study.design import StudyStep
from armimpedance.app.study.store import Fingerprints, StepResult, Store, states
from armimpedance.core.outputs import written_within
from armimpedance.core.program import of_program, of_words

#: A command: its words to an exit status; it prints to standard output and error.
Command = Callable[[list[str]], int]

#: Statuses of a session.
DONE: Final = "done"
FAILED: Final = "failed"
#: Places whose words are paths; the recording may lie below the other.
_PATHS: Final = ("recording", "study")


@dataclass(frozen=True)
class ChainTask:
    """A chain of steps to be done in one folder.

    `name`: of the folder below that of the study.
    `places`: what stands for each word in braces.
    `given`: files that lie in the folder when the first step begins.
    """

    name: str
    steps: tuple[StudyStep, ...]
    places: Mapping[str, str]
    given: tuple[Path, ...] = ()


@dataclass(frozen=True)
class Done:
    """A step with its result.

    `key`: in the store.
    `reused`: it was found, not done.
    """

    step: StudyStep
    key: str
    result: StepResult
    reused: bool


@dataclass(frozen=True)
class Outcome:
    """Outcome of a chain of steps.

    `name`: that of the task.
    `done`: one for each step that was tried.
    `problem`: why it could not be ended, where that is not a step's own failure.
    """

    name: str
    done: tuple[Done, ...]
    problem: str = ""

    @property
    def state(self) -> str:
        """`DONE`, or `FAILED` where a step did not end well."""
        return FAILED if self.problem or self.failure is not None else DONE

    @property
    def failure(self) -> Done | None:
        """The first step that did not end well."""
        return next((one for one in self.done if one.result.status not in (0, 3)), None)

    @property
    def reason(self) -> str:
        """Why it failed, in one line; empty where it did not."""
        if self.failure is None:
            return self.problem
        lines = self.failure.result.complained.strip().splitlines()
        status = f"{self.failure.step.command} ended with status {self.failure.result.status}"
        return lines[-1] if lines else status

    @property
    def recomputed(self) -> int:
        """Steps that were done, not found."""
        return sum(not one.reused for one in self.done)


def known_outcome(task: ChainTask, store: Store, prints: Fingerprints) -> Outcome | None:
    """The outcome of a chain all of whose steps are in the store; None where one is missing."""
    done: list[Done] = []
    hashes = {path.name: prints.of(path) for path in task.given}
    for step in task.steps:
        key = _key(task, step, hashes, prints)
        result = store.get(key)
        if result is None:
            return None
        hashes |= result.files
        done.append(Done(step, key, _with_paths(result, task), reused=True))
    return Outcome(task.name, tuple(done))


def carry_out(task: ChainTask, store: Store, prints: Fingerprints, command: Command) -> Outcome:
    """Do the steps of a chain that are not in the store.

    Every step is tried, also after one that failed: a page that says why may be among them.

    `command`: runs one command in the working folder.
    Raises OSError: a disk is full, or cannot be written to.
    """
    done: list[Done] = []
    hashes = {path.name: prints.of(path) for path in task.given}
    work = Path(tempfile.mkdtemp(prefix="armimpedance-study-"))
    try:
        for path in task.given:
            shutil.copyfile(path, work / path.name)
        for step in task.steps:
            key = _key(task, step, hashes, prints)
            result = store.get(key)
            stored = result is not None
            if result is None:
                result = _without_paths(_do(step.filled(task.places), work, command), task)
                _check_disk(result, work)
                if not result.lasts:
                    done.append(Done(step, "", _with_paths(result, task), reused=False))
                    continue
                store.put(key, result, work)
            store.lay(key, result, work)
            hashes |= result.files
            done.append(Done(step, key, _with_paths(result, task), stored))
    finally:
        shutil.rmtree(work, ignore_errors=True)
    return Outcome(task.name, tuple(done))


def _check_disk(result: StepResult, work: Path) -> None:
    """Refuse to go on where a command found no space: no other one would.

    Raises OSError: it told so.
    """
    problem = os.strerror(errno.ENOSPC)
    if result.status == 1 and problem in result.complained:
        raise OSError(errno.ENOSPC, problem, os.fspath(work.parent))


def _key(task: ChainTask, step: StudyStep, hashes: Mapping[str, str], prints: Fingerprints) -> str:
    """Key of a step's inputs: program, words, values of their places, bytes of files it reads.

    A path's folders are no part of it: data that were moved are the same data.
    """
    places = {
        name: os.path.basename(value) if os.path.isabs(value) else value
        for name, value in task.places.items()
        if step.names(name) and name != "study"
    }
    outside = [prints.of(path) for path in _outside(step.filled(task.places))]
    inside = {name: hashes[name] for name in sorted(hashes) if _is_named(name, step.words)}
    return of_words(of_program(), step.words, places, outside, inside)


def _outside(words: Sequence[str]) -> list[Path]:
    """Files and folders that words name by a whole path."""
    paths = [Path(word.partition("=")[2] if word.startswith("--") else word) for word in words]
    return [path for path in paths if path.is_absolute() and path.exists()]


def _is_named(name: str, words: Sequence[str]) -> bool:
    """Return True if a file, or a folder that it lies in, is a word of a command."""
    ways = [name, *(parent.as_posix() for parent in Path(name).parents if parent.name)]
    return any(way == word.rstrip("/") for way in ways for word in words)


def _without_paths(result: StepResult, task: ChainTask) -> StepResult:
    """The printed text with places for paths: equal recordings may lie at two paths."""
    texts = [result.printed, result.complained]
    for name in _PATHS:
        texts = [text.replace(task.places[name], f"{{{name}}}") for text in texts]
    return replace(result, printed=texts[0], complained=texts[1])


def _with_paths(result: StepResult, task: ChainTask) -> StepResult:
    """The printed text with the paths of this task."""
    texts = [result.printed, result.complained]
    for name in _PATHS:
        texts = [text.replace(f"{{{name}}}", task.places[name]) for text in texts]
    return replace(result, printed=texts[0], complained=texts[1])


def _do(words: list[str], work: Path, command: Command) -> StepResult:
    """Run a command that may write in a folder only, and see what it printed and wrote."""
    before = states(work)
    printed, complained = io.StringIO(), io.StringIO()
    with written_within(work), chdir(work), redirect_stdout(printed), redirect_stderr(complained):
        try:
            status = command(words)
        except SystemExit as end:
            status = end.code if isinstance(end.code, int) else 1
    files = {n: state for n, state in states(work).items() if before.get(n) != state}
    fresh = Fingerprints()
    sums = {name: fresh.of(work / name) for name in sorted(files)}
    return StepResult(status, printed.getvalue(), complained.getvalue(), sums)
