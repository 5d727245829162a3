"""The chain of every session, on several processes, each in a folder of its own."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import timedelta
from itertools import chain
from pathlib import Path
from typing import Any, Final

from armimpedance.app.study.chain import ChainTask, Command, Outcome, carry_out, known_outcome
from armimpedance.app.study.design import StudyDesign
from armimpedance.app.study.engines.engine import Engine
from armimpedance.app.study.sessions import StudySession
from armimpedance.app.study.store import Fingerprints, Store, are_files_below
from armimpedance.core.errors import ArmImpedanceError, InputError
from armimpedance.core.json_text import json_text, read_json
from armimpedance.core.outputs import is_full, kept_so_far, staged_file

#: Within the study's folder.
STORE: Final = ".store"
SEEN: Final = "seen.json"
#: Within a session's folder.
SESSION_FILE: Final = "session.json"
LOG_FILE: Final = "log.txt"


@dataclass(frozen=True)
class Progressed:
    """One session that has come to its end.

    `done`, `all`: sessions so far, and all.
    """

    session: StudySession
    outcome: Outcome
    done: int
    all: int


def task_of(session: StudySession, design: StudyDesign) -> ChainTask:
    """The chain of one session."""
    places = {
        "recording": str(session.recording),
        "study": str(design.folder),
        "participant": session.participant,
        "session": session.session,
    }
    return ChainTask(session.folder, design.steps, places)


@dataclass(frozen=True)
class SessionWork:
    """Work of a worker on a session; it can be sent to another process or machine.

    `out`: the study's folder, which every worker can reach.
    """

    out: Path
    command: Command

    def __call__(self, task: ChainTask) -> Outcome:
        """Do the steps, put the files into the session's folder."""
        prints = Fingerprints()
        store = Store(self.out / STORE, prints)
        try:
            outcome = carry_out(task, store, prints, self.command)
            lay_out(outcome, store, self.out)
        except (ArmImpedanceError, OSError) as error:
            if is_full(error):
                raise
            return self.failed(task, str(error))
        return outcome

    def failed(self, task: ChainTask, problem: str) -> Outcome:
        """The outcome of a chain that could not be ended."""
        return Outcome(task.name, (), problem=problem)


def run_participants(
    sessions: Sequence[StudySession],
    design: StudyDesign,
    out: Path,
    command: Command,
    engine: Engine,
) -> Iterator[Progressed]:
    """Do what is not done yet, and give every session as it ends.

    Parameters
    ----------
    sessions : sequence of StudySession
    design : StudyDesign
    out : Path
        The study's folder.
    command : function
        Runs one command.
    engine : function

    Yields
    ------
    Progressed

    Raises
    ------
    OSError
        The disk is full; what was done is kept.
    """
    (out / STORE).mkdir(parents=True, exist_ok=True)
    prints = Fingerprints(out / STORE / SEEN)
    store = Store(out / STORE, prints)
    by_name = {session.folder: session for session in sessions}
    ready: deque[Outcome] = deque()
    waiting = _asked(sessions, design, _Held(out, store, prints), ready)
    ended = _ended(waiting, ready, SessionWork(out, command), engine)
    try:
        with kept_so_far(out):
            for done, outcome in enumerate(ended, 1):
                yield Progressed(by_name[outcome.name], outcome, done, len(sessions))
    finally:
        # what is not remembered costs the next run time, and no result
        with suppress(OSError):
            prints.save()


@dataclass(frozen=True)
class _Held:
    """Results of earlier runs."""

    out: Path
    store: Store
    prints: Fingerprints


def _asked(
    sessions: Sequence[StudySession], design: StudyDesign, held: _Held, ready: deque[Outcome]
) -> Iterator[ChainTask | None]:
    """Task of a session; None if its outcome is stored already, which is then ready."""
    for session in sessions:
        task = task_of(session, design)
        outcome = _known(task, held.store, held.prints)
        if outcome is not None:
            lay_out(outcome, held.store, held.out)
            ready.append(outcome)
        yield task if outcome is None else None


def _ended(
    waiting: Iterator[ChainTask | None], ready: deque[Outcome], work: SessionWork, engine: Engine
) -> Iterator[Outcome]:
    """All outcomes; work begins with the first task, while the sessions behind it are looked at."""
    for first in waiting:
        if first is not None:
            for outcome in engine(work, chain([first], filter(None, waiting))):
                yield outcome
                while ready:
                    yield ready.popleft()
        while ready:
            yield ready.popleft()


def unknown_sessions(
    sessions: Sequence[StudySession], design: StudyDesign, out: Path
) -> list[StudySession]:
    """The sessions that have work to do; nothing is written.

    Parameters
    ----------
    sessions : sequence of StudySession
    design : StudyDesign
    out : Path
        The study's folder.

    Returns
    -------
    list of StudySession
    """
    prints = Fingerprints(out / STORE / SEEN)
    store = Store(out / STORE, prints)
    return [one for one in sessions if _known(task_of(one, design), store, prints) is None]


def _known(task: ChainTask, store: Store, prints: Fingerprints) -> Outcome | None:
    try:
        return known_outcome(task, store, prints)
    except OSError as error:
        return Outcome(task.name, (), problem=str(error))


def lay_out(outcome: Outcome, store: Store, out: Path) -> None:
    """Put a chain's files into its folder; what an earlier run left and this one did not goes.

    `out`: the study's folder.
    """
    folder = out / outcome.name
    record = _record(outcome)
    before = read_record(folder)
    log = log_of(outcome)
    same = before == record and _text(folder / LOG_FILE) == log
    if same and store.holds(folder, record["files"]):
        return
    folder.mkdir(parents=True, exist_ok=True)
    for one in outcome.done:
        if one.key:
            store.lay(one.key, one.result, folder)
    for name in set((before or {}).get("files", ())) - set(record["files"]):
        (folder / name).unlink(missing_ok=True)
    _write(folder / LOG_FILE, log)
    _write(folder / SESSION_FILE, json_text(record))


def read_record(folder: Path) -> dict[str, Any] | None:
    """The record in a session's folder of how it was made; None without one."""
    try:
        content = read_json(folder / SESSION_FILE)
    except InputError:
        return None
    steps = content.get("steps")
    sound = isinstance(steps, list) and all(isinstance(step, dict) for step in steps)
    return content if sound and are_files_below(content.get("files")) else None


def _record(outcome: Outcome) -> dict[str, Any]:
    """For `SESSION_FILE`; the same whoever did it, and whether it was done or found."""
    return {
        "state": outcome.state,
        "reason": outcome.reason,
        "steps": [
            {"command": str(one.step), "status": one.result.status, "key": one.key}
            for one in outcome.done
        ],
        "files": {name: of for one in outcome.done for name, of in one.result.files.items()},
    }


def log_of(outcome: Outcome) -> str:
    """Output of the commands, for a person to read."""
    parts = []
    for one in outcome.done:
        printed = [one.result.printed.rstrip(), one.result.complained.rstrip()]
        body = "\n".join(filter(None, printed))
        parts.append(f"$ armimpedance {one.step}\n{body}\n(status {one.result.status})\n")
    return "\n".join([*parts, *([outcome.problem] if outcome.problem else [])])


def _text(file: Path) -> str | None:
    try:
        return file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        return None


def _write(file: Path, text: str) -> None:
    with staged_file(file) as temporary:
        temporary.write_text(text, encoding="utf-8")


# What a study did and when, for a person to read: lines added to one file.

LOG_NAME: Final = "study.log"


class StudyLog:
    """A file to which each session's end is added; several processes may add to one.

    Parameters
    ----------
    out : Path
        The study's folder.
    """

    def __init__(self, out: Path) -> None:
        # a folder is a study's where the store is in it
        (out / STORE).mkdir(parents=True, exist_ok=True)
        self._file = out / LOG_NAME
        self._began = time.monotonic()
        self._worked = 0

    def begun(self, what: str) -> None:
        """Say that a run begins.

        Parameters
        ----------
        what : str
        """
        self._add(f"begin: {what}")

    def ended(self, one: Progressed) -> None:
        """Say what became of a session, and how much time is left; known ones need no line.

        Parameters
        ----------
        one : Progressed
        """
        outcome = one.outcome
        if outcome.recomputed == 0 and not outcome.problem:
            return
        self._worked += 1
        spent = time.monotonic() - self._began
        left = timedelta(seconds=round(spent / self._worked * (one.all - one.done)))
        what = outcome.reason or f"{outcome.recomputed} of {len(outcome.done)} steps run"
        self._add(f"{one.done} of {one.all}: {one.session}: {outcome.state}: {what}; {left} left")

    def _add(self, line: str) -> None:
        now = time.strftime("%Y-%m-%d %H:%M:%S")
        with kept_so_far(self._file), open(self._file, "a", encoding="utf-8") as stream:
            stream.write(f"{now}  {line}\n")
