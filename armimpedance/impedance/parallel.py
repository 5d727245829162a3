"""Independent pieces of work on several processes: results in order, the same bits as on one."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context
from typing import Any, TypeVar

from threadpoolctl import ThreadpoolController

from armimpedance.errors import InputError

Result = TypeVar("Result")

#: Pieces that wait per worker: enough to keep it busy, few enough to keep memory small.
AHEAD = 3
#: Matrices are small: threads inside a process would only get into each other's way.
_ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")


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
        1 works in this process.

    Raises
    ------
    InputError
        Fewer than one worker.
    """
    if workers < 1:
        raise InputError(f"{workers} workers", expected="1 or more")
    if workers == 1:
        # The last bits of a matrix product depend on its threads: one thread here as well.
        libraries = ThreadpoolController()
        for piece in pieces:
            with libraries.limit(limits=1):
                result = work(*piece)
            yield result
        return
    # "spawn" everywhere: a fork of a process whose libraries have threads may hang.
    fresh = get_context("spawn")
    with _single_threaded_children(), ProcessPoolExecutor(workers, mp_context=fresh) as pool:
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


@contextmanager
def _single_threaded_children() -> Iterator[None]:
    before = {name: os.environ.get(name) for name in _ONE_THREAD}
    os.environ.update(_ONE_THREAD)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
