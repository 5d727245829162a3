"""Independent pieces of work on several processes: results in order, the same bits as on one."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import BrokenExecutor, Future
from typing import Any, TypeVar

from armimpedance.core.errors import InputError, WorkerError
from armimpedance.core.workers import interrupts_for_us_alone, worker_pool

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
    with worker_pool(workers) as pool:
        waiting: deque[Future[Result]] = deque()
        try:
            for piece in pieces:
                with interrupts_for_us_alone():
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
