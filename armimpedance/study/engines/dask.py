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
from typing import TYPE_CHECKING, Any, Final

from armimpedance.errors import ArmImpedanceError, EstimationError, InputError
from armimpedance.extras import needed
from armimpedance.study.engines.engine import Asked, Given, Work
from armimpedance.study.fingerprints import of_program

if TYPE_CHECKING:
    from distributed import Client

#: How long a scheduler may be away, or workers may need to come, in seconds.
PATIENCE_S: Final = 300.0
_EXTRA: Final = "cluster"


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
        waiting = {task.name: task for task in tasks}
        lost = 0.0
        while waiting:
            try:
                for given in self._until_lost(work, list(waiting.values())):
                    del waiting[given.name]
                    lost = 0.0
                    yield given
            except OSError as error:
                # The scheduler went away. What was done is in the store; the rest is sent again.
                lost = lost or time.monotonic()
                if time.monotonic() - lost > self.patience_s:
                    problem = f"no scheduler at {self.scheduler}: {error}"
                    raise EstimationError(f"{problem}; what was done is kept") from None
                time.sleep(min(1.0, self.patience_s / 10))

    def _until_lost(self, work: Work[Asked, Given], tasks: list[Asked]) -> Iterator[Given]:
        """Work until all is done.

        Raises
        ------
        OSError
            The scheduler cannot be reached.
        InputError
            The workers cannot do it as this process would.
        """
        from concurrent.futures import CancelledError

        from distributed import Client, as_completed
        from distributed.comm import CommClosedError

        with Client(self.scheduler, timeout=min(10.0, self.patience_s)) as to:
            to.wait_for_workers(1, timeout=self.patience_s)
            check_workers(to)
            futures = to.map(work, tasks, pure=False, retries=0)
            asked = {future.key: task for future, task in zip(futures, tasks, strict=True)}
            try:
                for future in as_completed(futures):
                    yield _given(future, work, asked[future.key])
            except (CancelledError, CommClosedError) as error:
                raise OSError(f"connection lost ({error})") from None


def _given(future: Any, work: Work[Asked, Given], task: Asked) -> Given:
    """What a future came to; a worker that was killed again and again is its task's problem."""
    if future.status in ("cancelled", "lost"):
        raise OSError("connection lost")
    error = future.exception()
    if error is None:
        given: Given = future.result()
        return given
    if isinstance(error, ArmImpedanceError):
        return work.failed(task, str(error))
    return work.failed(task, f"its worker could not end it: {type(error).__name__}")


def check_workers(client: Client) -> None:
    """Refuse workers that would not give the same bits.

    Parameters
    ----------
    client : Client

    Raises
    ------
    InputError
    """
    for address, worker in client.scheduler_info(n_workers=-1)["workers"].items():
        if worker["nthreads"] != 1:
            problem = f"the worker {address} has {worker['nthreads']} threads"
            raise InputError(problem, expected="dask worker --nthreads 1 (--nworkers for more)")
    own = worker_state()
    for address, state in client.run(worker_state).items():
        if state[0] != own[0]:
            problem = f"the worker {address} has another version of the program or its packages"
            raise InputError(problem, expected="the same environment on all machines")
        if state[1] != "1":
            problem = f"on the worker {address} matrix products may have several threads"
            raise InputError(problem, expected="OMP_NUM_THREADS=1 in its environment")


def worker_state() -> tuple[str, str]:
    """What decides the last bits of a process: the program, and the threads of its products."""
    return of_program(), os.environ.get("OMP_NUM_THREADS", "")
