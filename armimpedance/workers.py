"""Processes that work for this one: started alike, stopped by it alone, ended with it."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context, parent_process
from multiprocessing.connection import wait


def worker_pool(workers: int) -> ProcessPoolExecutor:
    """Processes that wait for work, and end when this one does, also where it is killed.

    "spawn" everywhere: a fork of a process whose libraries have threads may hang. The others have
    as many threads as this one: on their number the last bits of a matrix product depend.

    Parameters
    ----------
    workers : int

    Returns
    -------
    ProcessPoolExecutor
        Work is submitted to it within `interrupts_for_us_alone`.
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
