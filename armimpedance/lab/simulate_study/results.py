"""What a study came to: sums of every cell and condition, and of the changes asked for."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from armimpedance.core.arrays import FloatArray
from armimpedance.lab.simulate_study.blocks import Blocks
from armimpedance.lab.simulate_study.cells import Cell
from armimpedance.lab.simulate_study.change import ChangeSums, change_sums
from armimpedance.lab.simulate_study.config import Config
from armimpedance.lab.simulate_study.rig import Numbers
from armimpedance.lab.simulate_study.summary import Sums, sums_of
from armimpedance.lab.simulate_study.work import blocks_of

Pair = tuple[str, str]


@dataclass(frozen=True)
class Drawn:
    """What the drawn sessions of a cell came to, and how sure that is.

    Attributes
    ----------
    sums : mapping
        Condition -> sums.
    errors : mapping
        Condition -> name of a column of cells.csv -> its standard error (Q,).
    changes : mapping
        Pair of conditions -> sums.
    change_errors : mapping
        Pair of conditions -> name of a column of changes.csv -> its standard error (Q,).
    """

    sums: Mapping[str, Sums]
    errors: Mapping[str, Mapping[str, FloatArray]]
    changes: Mapping[Pair, ChangeSums]
    change_errors: Mapping[Pair, Mapping[str, FloatArray]]


@dataclass(frozen=True)
class Result:
    """What a cell came to.

    Attributes
    ----------
    cell : Cell
    sums : mapping
        Condition -> sums of the simulated sessions; without those that could not be done.
    changes : mapping
        Pair of conditions -> sums.
    problems : mapping
        Why there was no estimate -> how often.
    drawn : Drawn or None
    undrawn : str
        Why nothing was drawn, where it was asked for.
    """

    cell: Cell
    sums: Mapping[str, Sums]
    changes: Mapping[Pair, ChangeSums]
    problems: Mapping[str, int] = field(default_factory=dict)
    drawn: Drawn | None = None
    undrawn: str = ""


def results_of(config: Config, blocks: Blocks) -> list[Result]:
    """Read the store and add up.

    Parameters
    ----------
    config : Config
    blocks : Blocks

    Returns
    -------
    list of Result
        One for each cell.
    """
    return [_result(cell, config, blocks) for cell in config.cells]


def sessions_of(cell: Cell, config: Config, blocks: Blocks) -> Iterator[tuple[int, Numbers]]:
    """Number of the first session, and the numbers, of every block that was done."""
    start = 0
    for block, count in blocks_of(config.sessions):
        found = blocks.get(cell, block, count)
        if found is not None:
            yield start, found
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
