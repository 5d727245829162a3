"""The work of a study: one block of sessions, simulated once and estimated in every way asked."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from warnings import catch_warnings, simplefilter

from armimpedance.app.study import Engine
from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import ArmImpedanceError
from armimpedance.core.outputs import is_full, kept_so_far
from armimpedance.lab.simulate_study.blocks import Blocks, Cell
from armimpedance.lab.simulate_study.config import Config
from armimpedance.lab.simulate_study.rig import BLOCK, Numbers
from armimpedance.lab.simulate_study.summary import ChangeSums, Sums, change_sums, sums_of


@dataclass(frozen=True)
class BlockTask:
    """A block of sessions.

    `cells`: all with the same simulated part.
    `block`, `sessions`: number of the block, and how many of its sessions are wanted.
    """

    name: str
    cells: tuple[Cell, ...]
    block: int
    sessions: int


@dataclass(frozen=True)
class EndedBlock:
    """Outcome of a task: its name, and the reason if it failed."""

    name: str
    problem: str = ""


@dataclass(frozen=True)
class BlockWork:
    """Work of a worker on a block; it can be sent to another process or machine.

    `blocks`: in a folder that every worker can reach.
    """

    blocks: Blocks

    def __call__(self, task: BlockTask) -> EndedBlock:
        """Simulate once, estimate for each cell, keep the numbers."""
        try:
            # a million sessions would say a million times what the study is about
            with catch_warnings():
                simplefilter("ignore")
                self._done(task)
        except (ArmImpedanceError, OSError) as error:
            if is_full(error):
                raise
            return self.failed(task, str(error))
        return EndedBlock(task.name)

    def _done(self, task: BlockTask) -> None:
        first = task.cells[0]
        start = task.block * BLOCK
        sessions = range(start, start + task.sessions)
        made = first.rig.simulate(first.settings, first.seeds(self.blocks.seed), sessions)
        for cell in task.cells:
            self.blocks.put(cell, task.block, cell.rig.estimate(cell.settings, made))

    def failed(self, task: BlockTask, problem: str) -> EndedBlock:
        """The outcome of a block that could not be completed."""
        return EndedBlock(task.name, problem)


def tasks_of(config: Config, blocks: Blocks) -> list[BlockTask]:
    """The blocks that are not done yet.

    Returns: those of one simulated part hold only the cells that miss it.
    """
    parts: dict[object, list[Cell]] = {}
    for cell in config.cells:
        parts.setdefault(cell.simulated, []).append(cell)
    tasks = []
    for number, cells in enumerate(parts.values()):
        for block, count in blocks_of(config.sessions):
            missing = tuple(c for c in cells if blocks.get(c, block, count) is None)
            if missing:
                tasks.append(BlockTask(f"{number}-{block}", missing, block, count))
    return tasks


def blocks_of(sessions: int) -> Iterator[tuple[int, int]]:
    """Number and sessions of each block; the last may be smaller."""
    for block in range(-(-sessions // BLOCK)):
        yield block, min(BLOCK, sessions - block * BLOCK)


def work_off(
    tasks: list[BlockTask], blocks: Blocks, engine: Engine
) -> Iterator[tuple[BlockTask, str]]:
    """Do the tasks.

    Yields: as it ends, in any order. why it failed; empty where it did not.
    Raises OSError: the disk is full; what was done is kept.
    """
    by_name = {task.name: task for task in tasks}
    with kept_so_far(blocks.out):
        for ended in engine(BlockWork(blocks), tasks):
            yield by_name[ended.name], ended.problem


# What a study came to: sums of every cell and condition, and of the changes asked for.

Pair = tuple[str, str]


@dataclass(frozen=True)
class Drawn:
    """Sums over the drawn sessions of a cell, with their standard errors.

    `sums`: condition -> sums.
    `errors`: condition -> name of a column of cells.csv -> its standard error (Q,).
    `changes`: pair of conditions -> sums.
    `change_errors`: pair of conditions -> name of a column of changes.csv -> its standard error
    (Q,).
    """

    sums: Mapping[str, Sums]
    errors: Mapping[str, Mapping[str, FloatArray]]
    changes: Mapping[Pair, ChangeSums]
    change_errors: Mapping[Pair, Mapping[str, FloatArray]]


@dataclass(frozen=True)
class Result:
    """Results of a cell.

    `sums`: condition -> sums of the simulated sessions; without those that could not be done.
    `changes`: pair of conditions -> sums.
    `problems`: why there was no estimate -> how often.
    `undrawn`: why nothing was drawn, where it was asked for.
    """

    cell: Cell
    sums: Mapping[str, Sums]
    changes: Mapping[Pair, ChangeSums]
    problems: Mapping[str, int] = field(default_factory=dict)
    drawn: Drawn | None = None
    undrawn: str = ""


def results_of(config: Config, blocks: Blocks) -> list[Result]:
    """Read the store and add up.

    Returns: one for each cell.
    """
    return [_result(cell, config, blocks) for cell in config.cells]


def sessions_of(cell: Cell, config: Config, blocks: Blocks) -> Iterator[tuple[int, Numbers]]:
    """Number of the first session, and the numbers, of every block that was done."""
    start = 0
    for block, count in blocks_of(config.sessions):
        stored = blocks.get(cell, block, count)
        if stored is not None:
            yield start, stored
        start += count


def _result(cell: Cell, config: Config, blocks: Blocks) -> Result:
    quantities = cell.rig.quantities
    sums: dict[str, Sums] = {}
    changes: dict[Pair, ChangeSums] = {}
    problems: Counter[str] = Counter()
    for _, found in sessions_of(cell, config, blocks):
        problems.update(found.problems)
        values = dict(zip(cell.conditions, found.values, strict=True))
        for condition, some in values.items():
            part = sums_of(some, quantities)
            sums[condition] = sums[condition] + part if condition in sums else part
        for pair in pairs_of(cell, config):
            change = change_sums(values[pair[0]], values[pair[1]], quantities)
            changes[pair] = changes[pair] + change if pair in changes else change
    return Result(cell, sums, changes, dict(problems))


def pairs_of(cell: Cell, config: Config) -> list[Pair]:
    """The changes asked for whose conditions a cell has."""
    return [pair for pair in config.power if set(pair) <= set(cell.conditions)]
