"""Processes of this machine; one that is killed costs one session's time, not the study."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, wait
from dataclasses import dataclass
from itertools import islice
from typing import Final, Generic

from armimpedance.app.study.engines.engine import Asked, Given, Work
from armimpedance.core.errors import InputError
from armimpedance.core.workers import interrupts_for_us_alone, usable_cores, worker_pool

#: How often a task is tried whose process ends before it does.
_TRIES: Final = 2


@dataclass(frozen=True)
class Processes:
    """An engine.

    Attributes
    ----------
    workers : int, optional
        Processes; None: as many as this process may use cores.

    Raises
    ------
    InputError
        Fewer than one worker.
    """

    workers: int | None = None

    def __post_init__(self) -> None:
        if self.workers is not None and self.workers < 1:
            raise InputError(f"{self.workers} workers", expected="1 or more")

    def __call__(self, work: Work[Asked, Given], tasks: Iterable[Asked]) -> Iterator[Given]:
        """Outcomes as they come, in any order."""
        waiting, alone = _Waiting(tasks), deque[Asked]()
        while waiting:
            yield from self._until_broken(work, waiting, alone)
        for task in alone:
            yield _by_itself(work, task)

    def _until_broken(
        self, work: Work[Asked, Given], waiting: _Waiting[Asked], alone: deque[Asked]
    ) -> Iterator[Given]:
        """Work until all is done or a process was killed; what was under way then waits again.

        The first process starts with the first task, before the next one is asked for.
        """
        count = self.workers or usable_cores()
        running: dict[Future[Given], tuple[Asked, int]] = {}
        with worker_pool(count) as pool:
            try:
                while running or waiting:
                    while len(running) < 2 * count and waiting:
                        task, tries = waiting.next()
                        with interrupts_for_us_alone():
                            running[pool.submit(work, task)] = (task, tries)
                    ready, _ = wait(running, return_when=FIRST_COMPLETED)
                    for future in ready:
                        outcome = future.result()
                        del running[future]
                        yield outcome
            except BrokenExecutor:
                for task, tries in running.values():
                    if tries < _TRIES:
                        waiting.again(task, tries + 1)
                    else:
                        alone.append(task)
            finally:
                pool.shutdown(cancel_futures=True)


class _Waiting(Generic[Asked]):
    """Tasks that are not under way yet, taken from where they come one by one."""

    def __init__(self, tasks: Iterable[Asked]) -> None:
        self._source = iter(tasks)
        self._held: deque[tuple[Asked, int]] = deque()

    def __bool__(self) -> bool:
        if not self._held:
            self._held.extend((task, 1) for task in islice(self._source, 1))
        return bool(self._held)

    def next(self) -> tuple[Asked, int]:
        """A task, and how often it will have been tried."""
        return self._held.popleft()

    def again(self, task: Asked, tries: int) -> None:
        """Put back what has to be tried again."""
        self._held.append((task, tries))


def _by_itself(work: Work[Asked, Given], task: Asked) -> Given:
    """One task in one process, so that its end is nobody else's."""
    with worker_pool(1) as pool:
        try:
            with interrupts_for_us_alone():
                asked = pool.submit(work, task)
            return asked.result()
        except BrokenExecutor:
            problem = "its process ended before its work was done (killed, or out of memory)"
            return work.failed(task, problem)
