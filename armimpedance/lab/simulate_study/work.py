"""The work of a study: one block of sessions, simulated once and estimated in every way asked."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from warnings import catch_warnings, simplefilter

from armimpedance.app.study import Engine
from armimpedance.core.errors import ArmImpedanceError
from armimpedance.lab.simulate_study.blocks import Blocks
from armimpedance.lab.simulate_study.cells import Cell
from armimpedance.lab.simulate_study.config import Config
from armimpedance.lab.simulate_study.rig import BLOCK


@dataclass(frozen=True)
class Task:
    """A block of sessions.

    Attributes
    ----------
    name : str
    cells : tuple of Cell
        All with the same simulated part.
    block, sessions : int
        Number of the block, and how many of its sessions are wanted.
    """

    name: str
    cells: tuple[Cell, ...]
    block: int
    sessions: int


@dataclass(frozen=True)
class Ended:
    """What a task came to: nothing but where it stands and why it failed, if it did."""

    name: str
    problem: str = ""


@dataclass(frozen=True)
class BlockWork:
    """What a worker does; it can be sent to another process or machine.

    Attributes
    ----------
    blocks : Blocks
        In a folder that every worker can reach.
    """

    blocks: Blocks

    def __call__(self, task: Task) -> Ended:
        """Simulate once, estimate for each cell, keep the numbers."""
        try:
            # a million sessions would say a million times what the study is about
            with catch_warnings():
                simplefilter("ignore")
                self._done(task)
        except (ArmImpedanceError, OSError) as error:
            return self.failed(task, str(error))
        return Ended(task.name)

    def _done(self, task: Task) -> None:
        first = task.cells[0]
        start = task.block * BLOCK
        sessions = range(start, start + task.sessions)
        made = first.rig.simulate(first.settings, first.seeds(self.blocks.seed), sessions)
        for cell in task.cells:
            self.blocks.put(cell, task.block, cell.rig.estimate(cell.settings, made))

    def failed(self, task: Task, problem: str) -> Ended:
        """What stands for a block that could not be done."""
        return Ended(task.name, problem)


def tasks_of(config: Config, blocks: Blocks) -> list[Task]:
    """The blocks that are not done yet.

    Parameters
    ----------
    config : Config
    blocks : Blocks

    Returns
    -------
    list of Task
        Those of one simulated part hold only the cells that miss it.
    """
    parts: dict[object, list[Cell]] = {}
    for cell in config.cells:
        parts.setdefault(cell.simulated, []).append(cell)
    tasks = []
    for number, cells in enumerate(parts.values()):
        for block, count in blocks_of(config.sessions):
            missing = tuple(c for c in cells if blocks.get(c, block, count) is None)
            if missing:
                tasks.append(Task(f"{number}-{block}", missing, block, count))
    return tasks


def blocks_of(sessions: int) -> Iterator[tuple[int, int]]:
    """Number and sessions of each block; the last may be smaller."""
    for block in range(-(-sessions // BLOCK)):
        yield block, min(BLOCK, sessions - block * BLOCK)


def work_off(tasks: list[Task], blocks: Blocks, engine: Engine) -> Iterator[tuple[Task, str]]:
    """Do the tasks.

    Parameters
    ----------
    tasks : list of Task
    blocks : Blocks
    engine : Engine

    Yields
    ------
    Task
        As it ends, in any order.
    str
        Why it failed; empty where it did not.
    """
    by_name = {task.name: task for task in tasks}
    for ended in engine(BlockWork(blocks), tasks):
        yield by_name[ended.name], ended.problem
