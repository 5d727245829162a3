"""Workers of Dask distributed, on this machine or on many.

A worker does one session at a time: a command changes the working folder and the standard output
of its whole process. All workers need the same program as this one, or their results would be kept
under a name that is not theirs.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from queue import Empty, Queue
from typing import TYPE_CHECKING, Any, Final, Generic

from armimpedance.app.study.engines.engine import Asked, Given, Work
from armimpedance.core.errors import ArmImpedanceError, EstimationError, InputError, needed
from armimpedance.core.program import of_program

if TYPE_CHECKING:
    from distributed import Client

#: How long a scheduler may be away, or workers may need to come, in seconds.
PATIENCE_S: Final = 300.0
_EXTRA: Final = "cluster"
#: How long what a future came to may take to arrive, in seconds.
_ANSWER_S: Final = 60.0


@dataclass(frozen=True)
class Dask:
    """An engine.

    Attributes
    ----------
    scheduler : str
        Address, such as ``tcp://host:8786``.
    patience_s : float
        How long to wait for workers, and for a scheduler that went away.
    """

    scheduler: str
    patience_s: float = PATIENCE_S

    def __call__(self, work: Work[Asked, Given], tasks: Iterable[Asked]) -> Iterator[Given]:
        """Outcomes as they come, in any order."""
        needed("distributed", _EXTRA, "a scheduler")
        from concurrent.futures import CancelledError

        waiting = {task.name: task for task in tasks}
        lost = 0.0
        while waiting:
            try:
                for given in self._until_lost(work, list(waiting.values())):
                    del waiting[given.name]
                    lost = 0.0
                    yield given
            except (OSError, CancelledError) as error:
                # The scheduler went away. What was done is in the store; the rest is sent again.
                lost = lost or time.monotonic()
                if time.monotonic() - lost > self.patience_s:
                    problem = f"no scheduler at {self.scheduler}: {error}"
                    raise EstimationError(f"{problem}; what was done is kept") from None
                time.sleep(min(1.0, self.patience_s / 10))

    def _until_lost(self, work: Work[Asked, Given], tasks: list[Asked]) -> Iterator[Given]:
        """Work until all is done.

        Raises OSError: the scheduler cannot be reached.
        Raises InputError: a worker would not give the same bits.
        Raises EstimationError: there are no workers any more.
        """
        with self._client() as to:
            to.wait_for_workers(1, timeout=self.patience_s)
            futures = to.map(_AsHere(work, of_program()), tasks, pure=False)
            asked = {future.key: task for future, task in zip(futures, tasks, strict=True)}
            done: Queue[Any] = Queue()
            for future in futures:
                future.add_done_callback(done.put)
            for _ in futures:
                future = self._next(done, to)
                yield _given(future, work, asked[future.key])

    def _client(self) -> Client:
        from distributed import Client

        try:
            return Client(self.scheduler, timeout=min(10.0, self.patience_s))
        except ValueError as error:
            problem = f"{self.scheduler!r} is no address: {error}"
            raise InputError(problem, expected="such as tcp://host:8786") from None

    def _next(self, done: Queue[Any], client: Client) -> Any:
        """The next future that has ended; while there are workers, it may take its time."""
        while True:
            try:
                return done.get(timeout=self.patience_s)
            except Empty:
                if not client.scheduler_info(n_workers=-1)["workers"]:
                    problem = f"no workers at {self.scheduler}; what was done is kept"
                    raise EstimationError(problem) from None


@dataclass(frozen=True)
class _AsHere(Generic[Asked, Given]):
    """Work that a worker refuses which would not do it as the process that sends it."""

    work: Work[Asked, Given]
    program: str

    def __call__(self, task: Asked) -> Given:
        from distributed import get_worker

        if get_worker().state.nthreads != 1:
            raise WrongWorkerError(
                f"a worker with {get_worker().state.nthreads} threads",
                expected="dask worker --nthreads 1 (--nworkers for more)",
            )
        if of_program() != self.program:
            raise WrongWorkerError(
                "a worker has another version of the program or its packages",
                expected="the same environment on all machines",
            )
        if os.environ.get("OMP_NUM_THREADS") != "1":
            raise WrongWorkerError(
                "on a worker matrix products may have several threads",
                expected="OMP_NUM_THREADS=1 in its environment",
            )
        return self.work(task)


class WrongWorkerError(InputError):
    """A worker would not give the same bits."""


def _given(future: Any, work: Work[Asked, Given], task: Asked) -> Given:
    """Result of a future; a task whose workers are killed repeatedly has failed."""
    if future.status in ("cancelled", "lost"):
        raise OSError("connection lost")
    error = future.exception(timeout=_ANSWER_S)
    if error is None:
        given: Given = future.result()
        return given
    if isinstance(error, WrongWorkerError):
        raise error
    if isinstance(error, ArmImpedanceError | OSError):
        return work.failed(task, str(error))
    return work.failed(task, f"its worker could not end it: {type(error).__name__}")
