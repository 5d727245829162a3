"""Processes of this machine; one that is killed costs one session's time, not the study."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass
from itertools import islice
from typing import Final, Generic

from armimpedance.app.study.engines.engine import Asked, Given, Work
from armimpedance.core.errors import WorkerError, check_number
from armimpedance.core.workers import Crew, usable_cores

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
        if self.workers is not None:
            check_number(self.workers, f"{self.workers} workers", low=1)

    def __call__(self, work: Work[Asked, Given], tasks: Iterable[Asked]) -> Iterator[Given]:
        """Outcomes as they come, in any order."""
        waiting, alone = _Waiting(tasks), deque[Asked]()
        with Crew(self.workers or usable_cores()) as processes:
            yield from self._side_by_side(work, waiting, alone, processes)
        # with all memory to itself
        for task in alone:
            with Crew(1) as process:
                asked = process.share(work, task)
                try:
                    yield asked.result()
                except WorkerError as error:
                    yield work.failed(task, str(error))

    def _side_by_side(
        self,
        work: Work[Asked, Given],
        waiting: _Waiting[Asked],
        alone: deque[Asked],
        processes: Crew,
    ) -> Iterator[Given]:
        """Work until all is done but what costs its process again and again.

        The first process starts with the first task, before the next one is asked for.
        """
        most = 2 * (self.workers or usable_cores())
        running: dict[Future[Given], tuple[Asked, int]] = {}
        while running or waiting:
            while len(running) < most and waiting:
                task, tries = waiting.next()
                running[processes.share(work, task)] = (task, tries)
            ready, _ = wait(running, return_when=FIRST_COMPLETED)
            for future in ready:
                task, tries = running.pop(future)
                try:
                    yield future.result()
                except WorkerError:
                    if tries < _TRIES:
                        waiting.again(task, tries + 1)
                    else:
                        alone.append(task)


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
