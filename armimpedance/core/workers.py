"""Processes that work for this one: started alike, stopped by it alone, ended with it."""

from __future__ import annotations

import os
import signal
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from multiprocessing import get_context, parent_process
from multiprocessing.connection import wait
from typing import Any

from armimpedance.core.errors import WorkerError

#: What is said of a process that went without a word.
_ENDED = "a worker process ended before its work was done (killed, or out of memory)"


def worker_pool(workers: int) -> ProcessPoolExecutor:
    """Processes that wait for work, and end when this one does, also where it is killed.

    "spawn" everywhere: a fork of a process whose libraries have threads may hang. The others have
    as many threads as this one: on their number the last bits of a matrix product depend.

    Returns: work is submitted to it within `interrupts_for_us_alone`.
    """
    return ProcessPoolExecutor(workers, get_context("spawn"), _end_with_parent)


def usable_cores() -> int:
    """Cores that this process may use; a scheduler may have given it fewer than there are."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@contextmanager
def interrupts_for_us_alone() -> Iterator[None]:
    """Processes that start in here ignore Ctrl-C and a closed terminal: this one stops them.

    A process inherits that a signal is ignored, even before it runs a line of ours.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    numbers = [getattr(signal, name) for name in ("SIGINT", "SIGHUP") if hasattr(signal, name)]
    before = {number: signal.signal(number, signal.SIG_IGN) for number in numbers}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@dataclass(frozen=True)
class _Piece:
    work: Callable[..., Any]
    given: tuple[Any, ...]
    done: Future[Any] = field(default_factory=Future)


class Crew:
    """This process and others beside it, which take pieces of work from one row; see `crew`."""

    def __init__(self, others: int) -> None:
        self._pool = worker_pool(others) if others else None
        self._free = others
        self._row: deque[_Piece] = deque()
        # pieces are handed out here and, when one is done, by the pool's own thread
        self._lock = threading.RLock()

    def share(self, work: Callable[..., Any], *given: Any) -> Future[Any]:
        """Put a piece of work at the end of the row; the longest should come first.

        `*given`: what it is called with; as its result, it goes from process to process.
        Returns: for `finish`.
        """
        piece = _Piece(work, given)
        self._row.append(piece)
        self._hand_out()
        return piece.done

    def finish(self, pieces: Sequence[Future[Any]]) -> list[Any]:
        """Work along until the row is empty, then wait for these pieces.

        Returns: their results, in this order.
        Raises WorkerError: another process was killed, or ran out of memory.
        """
        while (piece := self._next()) is not None:
            piece.done.set_result(piece.work(*piece.given))
        try:
            return [piece.result() for piece in pieces]
        except BrokenExecutor:
            raise WorkerError(f"{_ENDED}; try again with more memory free") from None

    def end(self) -> None:
        """Begin nothing more, and wait for what was begun."""
        with self._lock:
            self._row.clear()
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)

    def _next(self) -> _Piece | None:
        with self._lock:
            return self._row.popleft() if self._row else None

    def _hand_out(self) -> None:
        with self._lock:
            while self._pool is not None and self._free and (piece := self._next()) is not None:
                self._free -= 1
                with interrupts_for_us_alone():
                    done = self._pool.submit(piece.work, *piece.given)
                done.add_done_callback(partial(self._take_back, piece))

    def _take_back(self, piece: _Piece, done: Future[Any]) -> None:
        if done.cancelled():
            piece.done.cancel()
            return
        error = done.exception()
        if error is None:
            piece.done.set_result(done.result())
        else:
            piece.done.set_exception(error)
        # a pool that lost a process takes no more work: this process does it
        if not isinstance(error, BrokenExecutor):
            with self._lock:
                self._free += 1
                self._hand_out()


@contextmanager
def crew(workers: int) -> Iterator[Crew]:
    """So many processes, this one among them; the others end with the block.

    `workers`: 1 does all work in this process. With more, the matrix libraries should have one
    thread each (OMP_NUM_THREADS=1), as the command line sets it.
    """
    working = Crew(workers - 1)
    try:
        yield working
    finally:
        working.end()


def _end_with_parent() -> None:
    """Let this worker end when the process that wants its work is gone.

    It would wait for ever for the next piece, and keep its memory.
    """
    parent = parent_process()
    if parent is not None:
        watch = threading.Thread(target=_end_after, args=(parent.sentinel,), daemon=True)
        watch.start()


def _end_after(sentinel: int) -> None:
    wait([sentinel])
    os._exit(1)
