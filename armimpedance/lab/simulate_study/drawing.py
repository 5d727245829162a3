"""Sessions of a fixed design that are drawn, not simulated.

Where the design is fixed, the sessions of a cell differ by chance alone: their estimates are draws
from one distribution. It is fitted to the simulated sessions, on scales on which it is close to
normal, by its mean and covariance; as many sessions as wanted are drawn from it, and go through
the same sums as the simulated ones. Conditions are drawn independently, as they are simulated.

A million draws tell no more than the sessions that the distribution was fitted to. So the standard
errors of what is drawn come from a jackknife over groups of those: each group left out in turn, the
distribution fitted again, the same random numbers turned into sessions again.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import EstimationError
from armimpedance.lab.simulate_study.blocks import Blocks, Cell
from armimpedance.lab.simulate_study.config import Config
from armimpedance.lab.simulate_study.rig import BOUND, TRUTH
from armimpedance.lab.simulate_study.summary import ChangeSums, Sums, change_sums, sums_of
from armimpedance.lab.simulate_study.work import Drawn, Pair, Result, pairs_of, sessions_of

#: Sessions that are drawn at once.
CHUNK: Final = 4096
#: Groups of the jackknife, and the sessions that are drawn without each.
GROUPS: Final = 20
DRAWN_WITHOUT: Final = 12_288
#: More sessions without an estimate than this share: the others do not stand for all.
MOST_FAILED: Final = 0.01
#: First number of the keys of what is drawn; what is simulated has keys of its own.
_KEY: Final = 1_000_000


@dataclass(frozen=True)
class _Normal:
    """A normal distribution: mean (E,) and a root (E, E) of its covariance."""

    mean: FloatArray
    root: FloatArray

    @classmethod
    def of(cls, rows: FloatArray) -> _Normal:
        mean = rows.mean(axis=0)
        apart = rows - mean
        # scaled, so that what varies little is not lost beside what varies much
        scale = np.sqrt((apart**2).sum(axis=0) / (len(rows) - 1))
        scaled = apart / np.where(scale > 0, scale, 1)
        values, vectors = np.linalg.eigh(scaled.T @ scaled / (len(rows) - 1))
        root = vectors * np.sqrt(np.maximum(values, 0))
        return cls(mean, scale[:, None] * (root @ vectors.T))

    def drawn(self, standard: FloatArray) -> FloatArray:
        return self.mean + standard @ self.root.T


@dataclass(frozen=True)
class _Condition:
    """Simulated sessions of a condition: extras (n, E), truth and the bound's sd (Q,)."""

    extras: FloatArray
    truth: FloatArray
    bound: FloatArray


def with_drawn(result: Result, config: Config, blocks: Blocks) -> Result:
    """The same result with drawn sessions, where they are asked for and can be drawn."""
    if not config.drawn:
        return result
    try:
        return replace(result, drawn=drawn_sessions(result.cell, config, blocks))
    except EstimationError as error:
        return replace(result, undrawn=str(error))


def drawn_sessions(cell: Cell, config: Config, blocks: Blocks) -> Drawn:
    """Draw sessions of a cell.

    `cell`: whose rig has a shortcut.
    Raises EstimationError: the simulated sessions do not tell the distribution.
    """
    known = _known(cell, config, blocks)
    pairs = pairs_of(cell, config)
    sums, changes = _summed(cell, config, known, _fits(known), pairs, config.drawn)
    count = min(config.drawn, DRAWN_WITHOUT)
    left_out = [
        _summed(cell, config, known, _fits(known, without=group), pairs, count)
        for group in range(GROUPS)
    ]
    errors = {name: _errors([part[0][name] for part in left_out], sums[name]) for name in known}
    change_errors = {
        pair: _change_errors([part[1][pair] for part in left_out], changes[pair]) for pair in pairs
    }
    return Drawn(sums, errors, changes, change_errors)


def _fits(known: Mapping[str, _Condition], without: int | None = None) -> dict[str, _Normal]:
    """The distribution of each condition, of all sessions or without a group of them."""
    rows = {name: one.extras for name, one in known.items()}
    if without is not None:
        rows = {name: np.delete(of, np.s_[without::GROUPS], axis=0) for name, of in rows.items()}
    return {name: _Normal.of(of) for name, of in rows.items()}


def _errors(left_out: list[Sums], drawn: Sums) -> dict[str, FloatArray]:
    return {
        "bias": _jackknifed([one.bias for one in left_out]),
        "rmse": _jackknifed([one.rmse for one in left_out]),
        "coverage": _with_chance([one.coverage for one in left_out], drawn.n),
    }


def _change_errors(left_out: list[ChangeSums], drawn: ChangeSums) -> dict[str, FloatArray]:
    return {
        "power": _with_chance([one.power for one in left_out], drawn.n),
        "coverage": _with_chance([one.coverage for one in left_out], drawn.n),
    }


def _known(cell: Cell, config: Config, blocks: Blocks) -> dict[str, _Condition]:
    numbers_of_blocks = [numbers for _, numbers in sessions_of(cell, config, blocks)]
    known = {}
    for c, name in enumerate(cell.conditions):
        values = (
            np.concatenate([one.values[c] for one in numbers_of_blocks])
            if numbers_of_blocks
            else np.empty((0, 1, 7))
        )
        extras = (
            np.concatenate([one.extras[c] for one in numbers_of_blocks])
            if numbers_of_blocks
            else np.empty((0, 1))
        )
        there = np.isfinite(extras).all(axis=1)
        if there.sum() < (1 - MOST_FAILED) * config.sessions:
            failed = config.sessions - int(there.sum())
            raise EstimationError(
                f"{failed} of {config.sessions} sessions of {name} have no estimate, no ellipse or "
                "no covariance of full rank"
            )
        with np.errstate(all="ignore"):
            truth = values[there][..., TRUTH].mean(axis=0)
            bound = np.sqrt((values[there][..., BOUND] ** 2).mean(axis=0))
        known[name] = _Condition(extras[there], truth, bound)
    return known


def _summed(
    cell: Cell,
    config: Config,
    known: Mapping[str, _Condition],
    fits: Mapping[str, _Normal],
    pairs: list[Pair],
    count: int,
) -> tuple[dict[str, Sums], dict[Pair, ChangeSums]]:
    """Draw `count` sessions of each condition, a chunk at a time, and add them up."""
    rig = cell.rig
    if rig.shortcut is None:
        raise EstimationError(f"the rig {cell.rig_name} has no shortcut")
    shortcut = rig.shortcut()
    sums: dict[str, Sums] = {}
    changes: dict[Pair, ChangeSums] = {}
    for number, size in _chunks(count):
        values = {}
        for c, (name, one) in enumerate(known.items()):
            sequence = cell.seeds(config.seed).sequence(_KEY, c, number)
            standard = np.random.default_rng(sequence).standard_normal((size, rig.extras))
            values[name] = shortcut.values(fits[name].drawn(standard), one.truth, one.bound)
            part = sums_of(values[name], rig.quantities)
            sums[name] = sums[name] + part if name in sums else part
        for pair in pairs:
            change = change_sums(values[pair[0]], values[pair[1]], rig.quantities)
            changes[pair] = changes[pair] + change if pair in changes else change
    return sums, changes


def _chunks(count: int) -> Iterator[tuple[int, int]]:
    for number in range(-(-count // CHUNK)):
        yield number, min(CHUNK, count - number * CHUNK)


def _jackknifed(values: list[FloatArray]) -> FloatArray:
    """Standard error from the values with each group left out."""
    apart = np.array(values) - np.mean(values, axis=0)
    return np.sqrt((len(values) - 1) / len(values) * (apart**2).sum(axis=0))


def _with_chance(shares: list[FloatArray], n: FloatArray) -> FloatArray:
    """Standard error of a share: that of the fit, and that of the draws."""
    mean = np.mean(shares, axis=0)
    return np.sqrt(_jackknifed(shares) ** 2 + mean * (1 - mean) / n)
