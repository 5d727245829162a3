"""Independent pieces of work on several processes: results in order, the same bits as on one."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from multiprocessing import get_context
from typing import Any, TypeVar

from armimpedance.errors import InputError

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
    """
    if workers < 1:
        raise InputError(f"{workers} workers", expected="1 or more")
    if workers == 1:
        yield from (work(*piece) for piece in pieces)
        return
    # "spawn" everywhere: a fork of a process whose libraries have threads may hang. The others
    # have as many threads as this one: on their number the last bits of a matrix product depend.
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        waiting: deque[Future[Result]] = deque()
        try:
            for piece in pieces:
                waiting.append(pool.submit(work, *piece))
                if len(waiting) > AHEAD * workers:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        finally:
            pool.shutdown(cancel_futures=True)
