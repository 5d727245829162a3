"""Worker processes of this process: started and stopped by it, and ended with it.

Each worker has a pipe to a thread of this process and shares no lock: if it is killed at any
moment, only its present piece of work is lost. On Ctrl-C, or if a terminal or a scheduler ends the
command, this process alone decides; it asks the workers to end, and they clean up.
"""

from __future__ import annotations

import os
import pickle
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_EXCEPTION, Future, wait as wait_for
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass, field
from functools import wraps
from multiprocessing import get_context, parent_process, resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from multiprocessing.util import Finalize
from queue import Empty, SimpleQueue
from types import FrameType
from typing import Any, Final, ParamSpec, TypeVar

from armimpedance.core.errors import WorkerError

P = ParamSpec("P")
R = TypeVar("R")

#: Time for a worker to clean up after it is asked to end, s.
_PATIENCE_S: Final = 2.0
#: The same after the parent process has ended, s.
_ALONE_S: Final = 0.3
#: Exit status of a program that a signal ended, as in shells, less the signal's number.
_BY_SIGNAL: Final = 128
#: Signals that end a command; "SIGHUP" does not exist everywhere.
_SIGNALS: Final = {
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
}


def usable_cores() -> int:
    """Number of cores that this process may use; a scheduler may allow fewer than there are."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@dataclass(frozen=True)
class _Piece:
    work: Callable[..., Any]
    arguments: tuple[Any, ...]
    done: Future[Any] = field(default_factory=Future)


class Crew:
    """Worker processes, which take pieces of work from one queue and end with the `with` block.

    Each starts with its first piece of work, as a new interpreter ("spawn") on every system: a fork
    of a process whose libraries have threads may hang. Linear algebra has one thread in each.

    `others`: number of workers besides this process.
    """

    def __init__(self, others: int) -> None:
        self._others = others
        self._row: SimpleQueue[_Piece | None] = SimpleQueue()
        self._places: list[_Place] = []
        # needed if an error keeps this object until the interpreter ends, which waits for workers
        self._end = Finalize(None, _end, (self._row, self._places), exitpriority=0)

    def __enter__(self) -> Crew:
        return self

    def __exit__(self, *_: object) -> None:
        """Start no more work, and stop the workers."""
        self._end()

    def share(self, work: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Put a piece of work at the end of the queue; the longest should come first.

        `*arguments`: arguments of `work`; they and its result are sent between processes.
        Returns: for `finish`; its error is a WorkerError if its process was killed, or ran out of
        memory.
        """
        piece = _Piece(work, arguments)
        if len(self._places) < self._others:
            self._places.append(_Place(self._row, piece))
        else:
            self._row.put(piece)
        return piece.done

    def finish(self, pieces: Sequence[Future[Any]]) -> list[Any]:
        """Do pieces of work here too until the queue is empty, then wait for these pieces.

        Returns: their results, in this order.
        Raises WorkerError: at once if the process of a piece was killed, or ran out of memory.
        """
        with suppress(Empty):
            while not any(map(_is_lost, pieces)):
                if (piece := self._row.get_nowait()) is not None:
                    piece.done.set_result(piece.work(*piece.arguments))
        wait_for(pieces, return_when=FIRST_EXCEPTION)
        for lost in filter(_is_lost, pieces):
            lost.result()
        return [piece.result() for piece in pieces]


def _is_lost(piece: Future[Any]) -> bool:
    return piece.done() and isinstance(piece.exception(), WorkerError)


def crew(workers: int) -> Crew:
    """Return a crew of this many processes, this one included.

    `workers`: 1 does all work in this process.
    """
    return Crew(workers - 1)


def _end(row: SimpleQueue[_Piece | None], places: Sequence[_Place]) -> None:
    with suppress(Empty):
        while (piece := row.get_nowait()) is not None:
            piece.done.cancel()
    for place in places:
        row.put(None)
        place.stop()
    until = time.monotonic() + _PATIENCE_S
    try:
        for place in places:
            place.wait(until)
    finally:
        for place in places:
            place.kill()


class _Place:
    """A thread of this process and its worker process, which is replaced if it is killed."""

    def __init__(self, row: SimpleQueue[_Piece | None], first: _Piece) -> None:
        self._row = row
        self._process: SpawnProcess | None = None
        self._pipe: Connection | None = None
        self._lock = threading.Lock()
        self._works = self._stopped = False
        self._thread = threading.Thread(target=self._serve, args=(first,), daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Ask the process to end if it is working; without work it ends by itself."""
        with self._lock:
            self._stopped = True
            if self._works and self._process is not None:
                self._process.terminate()

    def wait(self, until: float) -> None:
        """Wait for the end of thread and process, but not longer than `until`."""
        self._thread.join(max(0.0, until - time.monotonic()))
        if self._process is not None:
            self._process.join(max(0.0, until - time.monotonic()))

    def kill(self) -> None:
        """Kill the process if it still runs."""
        if self._process is not None:
            self._process.kill()
            self._process.join()

    def _serve(self, first: _Piece) -> None:
        piece: _Piece | None = first
        while piece is not None:
            self._settle(piece)
            piece = self._row.get()
        if self._pipe is not None:
            self._pipe.close()

    def _settle(self, piece: _Piece) -> None:
        try:
            sent = pickle.dumps((piece.work, piece.arguments))
            done, result = pickle.loads(self._answer(sent))  # noqa: S301 - of our own process
        except Exception as error:
            done, result = False, error
        if done:
            piece.done.set_result(result)
        else:
            piece.done.set_exception(result)

    def _answer(self, sent: bytes) -> bytes:
        with self._lock:
            if self._stopped:
                raise WorkerError("the work was stopped")
            if self._pipe is None:
                self._process, self._pipe = _started()
            self._works = True
        try:
            self._pipe.send_bytes(sent)
            return self._pipe.recv_bytes()
        except (EOFError, OSError):
            self._pipe.close()
            self._pipe = None
            raise WorkerError(_cause_of_end(self._process)) from None
        finally:
            self._works = False


def _started() -> tuple[SpawnProcess, Connection]:
    """Start a new process and return it with this side of its pipe."""
    context = get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=_work_off, args=(theirs,))
    try:
        with _unheard():
            process.start()
    finally:
        theirs.close()
    return process, ours


@contextmanager
def _unheard() -> Iterator[None]:
    """Block signals until the processes started in this block are ready: they inherit the mask."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, _SIGNALS)
    try:
        # Python's own helper, which starts with the first process, unblocks the signals
        resource_tracker.ensure_running()
        signal.pthread_sigmask(signal.SIG_BLOCK, _SIGNALS)
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _cause_of_end(process: SpawnProcess | None) -> str:
    code = None
    if process is not None:
        process.join(_PATIENCE_S)
        code = process.exitcode
    if code == -getattr(signal, "SIGKILL", 0):
        cause = "killed, or out of memory"
    elif code is not None and code < 0:
        cause = f"by {signal.Signals(-code).name}"
    else:
        cause = f"with status {code}"
    problem = f"a worker process ended before its work was done ({cause})"
    return f"{problem}; try fewer workers, or more memory"


# In the worker process.


class _AskedToEnd(BaseException):
    """Raised during the work, so that what is half done is cleaned up on the way out."""


def _work_off(pipe: Connection) -> None:
    """Do the work that comes through the pipe, until its other end is closed."""
    try:
        _hear_one_signal()
        threading.Thread(target=_end_with_parent, daemon=True).start()
        with suppress(EOFError, OSError):
            while True:
                pipe.send_bytes(_packed(_worked(pipe.recv_bytes())))
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
    except _AskedToEnd:
        sys.exit(_BY_SIGNAL + signal.SIGTERM)


def _hear_one_signal() -> None:
    """Let SIGTERM alone end this process; the parent handles signals sent to the whole group."""
    for number in _SIGNALS:
        signal.signal(number, _stop_working if number == signal.SIGTERM else signal.SIG_IGN)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, _SIGNALS)


def _stop_working(number: int, _: FrameType | None) -> None:
    signal.signal(number, signal.SIG_IGN)  # once is enough: a second one would disturb the clean-up
    raise _AskedToEnd


def _worked(sent: bytes) -> tuple[bool, Any]:
    """Return whether a piece of work succeeded, and its result or error."""
    try:
        work, arguments = pickle.loads(sent)  # noqa: S301 - of our own process
        with one_thread():
            return True, work(*arguments)
    except _AskedToEnd:
        raise
    except BaseException as error:
        error.add_note(traceback.format_exc())
        return False, error


def _packed(answer: tuple[bool, Any]) -> bytes:
    try:
        return pickle.dumps(answer)
    except Exception as error:
        reported = answer[1] if isinstance(answer[1], Exception) else error
        return pickle.dumps((False, WorkerError(f"{type(reported).__name__}: {reported}")))


def _end_with_parent() -> None:
    """End this process when its parent has ended: after a clean-up if that is quick."""
    parent = parent_process()
    if parent is None:
        return
    wait([parent.sentinel])
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(_ALONE_S)
    os._exit(1)


# One thread for linear algebra. The matrices are small: threads of the libraries mostly wait for
# each other, which takes two to five times the processor time, and the last bits of results depend
# on their number. The command line sets one thread before the libraries are loaded; in Python they
# are loaded already.


def one_thread() -> AbstractContextManager[Any]:
    """Return a context in which linear algebra has one thread; takes 2 ms."""
    import scipy.linalg  # noqa: F401 - a library is limited only where it is loaded
    from threadpoolctl import threadpool_limits

    limits: AbstractContextManager[Any] = threadpool_limits(1, user_api="blas")
    return limits


def single_threaded(function: Callable[P, R]) -> Callable[P, R]:
    """Decorate a function so that its linear algebra has one thread."""

    @wraps(function)
    def limited(*args: P.args, **keywords: P.kwargs) -> R:
        with one_thread():
            return function(*args, **keywords)

    return limited
