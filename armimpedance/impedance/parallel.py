"""Independent pieces of work on several processes: results in order, the same bits as on one."""

from __future__ import annotations

import os
import signal
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import BrokenExecutor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context, parent_process
from multiprocessing.connection import wait
from typing import Any, TypeVar

from armimpedance.errors import InputError, WorkerError

Result = TypeVar("Result")

#: Pieces that wait per worker: enough to keep it busy, few enough to keep memory small.
AHEAD = 3


def in_order(
    work: Callable[..., Result], pieces: Iterable[tuple[Any, ...]], workers: int = 1
) -> Iterator[Result]:
    """``work(*piece)`` for each piece, in the order of the pieces.

    Parameters
    ----------
    work : function of a module's top level
    pieces : iterable of tuples of arguments
        Taken as needed, a few ahead.
    workers : int
        1 works in this process. With more, the matrix libraries should have one thread each
        (OMP_NUM_THREADS=1), as the command line sets it.

    Raises
    ------
    InputError
        Fewer than one worker.
    WorkerError
        A worker was killed, or ran out of memory.
    """
    if workers < 1:
        raise InputError(f"{workers} workers", expected="1 or more")
    if workers == 1:
        yield from (work(*piece) for piece in pieces)
        return
    # "spawn" everywhere: a fork of a process whose libraries have threads may hang. The others
    # have as many threads as this one: on their number the last bits of a matrix product depend.
    with ProcessPoolExecutor(workers, get_context("spawn"), _end_with_parent) as pool:
        waiting: deque[Future[Result]] = deque()
        try:
            for piece in pieces:
                with _interrupts_for_us_alone():
                    waiting.append(pool.submit(work, *piece))
                if len(waiting) > AHEAD * workers:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        except BrokenExecutor:
            problem = "a worker process ended before its work was done (killed, or out of memory)"
            raise WorkerError(f"{problem}; try fewer workers") from None
        finally:
            pool.shutdown(cancel_futures=True)


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


@contextmanager
def _interrupts_for_us_alone() -> Iterator[None]:
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
