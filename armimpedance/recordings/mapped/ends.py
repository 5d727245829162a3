"""Padding at the ends of trials: empty rows, zeros, or a repeated last value."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray
from armimpedance.recordings.mapped.clocks import OneClock
from armimpedance.recordings.mapped.cutting import Piece
from armimpedance.recordings.mapped.mapping import ColumnMapping

#: Least ratio of a step into padding to the largest other step of the trial.
_JUMP: Final = 20.0
#: Largest share of a trial that counts as padding.
_MOST: Final = 0.5
#: Rows at the end that repeat the last measured row are padding if they are this many times as many
#: as in any other run, and less probable than this by chance. A longer run elsewhere is a rest.
_FROZEN: Final = 3
_CHANCE: Final = 1e-6
_CHANCE_RUN: Final = 8


def without_padding(
    run: OneClock, pieces: Sequence[Piece], mapping: ColumnMapping
) -> tuple[list[Piece], list[str]]:
    """Remove rows without a measurement from the ends of trials; return sentences on them.

    Two kinds of rows are removed at either end of a trial: rows in which position and force are
    empty on all axes; and rows that all hold exactly the same values, if the position jumps to them
    (as to zeros) or they repeat the last measured row. A trial with only such rows is removed.
    """
    columns = [*mapping.position.columns, *mapping.force.columns]
    if any(run.columns[name].dtype.kind == "U" for name in columns if name in run.columns):
        return list(pieces), []
    signals = [run.numbers(name) for name in columns]
    axes = len(mapping.position.columns)
    kept, removed = list(pieces), []
    for i in np.flatnonzero(_doubtful(signals, axes, pieces)).tolist():
        piece = pieces[i]
        values = np.column_stack([signal[piece.start : piece.stop] for signal in signals])
        first, last = _measured(values, axes)
        kept[i] = replace(piece, start=piece.start + first, stop=piece.start + last)
        if last - first < len(values):
            removed.append((_name(piece, i), len(values) - (last - first)))
    return [piece for piece in kept if piece.stop > piece.start], _padding_remark(run, removed)


def _name(piece: Piece, position: int) -> str:
    name = position + 1 if piece.name is None else piece.name
    return f"{name:g}" if isinstance(name, float) else str(name)


def _doubtful(signals: Sequence[FloatArray], axes: int, pieces: Sequence[Piece]) -> BoolArray:
    """True for trials (T,) whose first or last rows may be padding."""
    doubtful = np.zeros(len(pieces), dtype=bool)
    starts = np.array([p.start for p in pieces])
    stops = np.array([p.stop for p in pieces])
    long = stops - starts > 3
    doubtful |= ~long
    for edge, inward in ((starts[long], 1), (stops[long] - 1, -1)):
        rows = [[s[edge], s[edge + inward], s[edge + 2 * inward]] for s in signals]
        empty = np.logical_and.reduce([np.isnan(at) for at, _, _ in rows])
        equal = np.logical_and.reduce([at == near for at, near, _ in rows])
        leaps = [np.abs(at - near) > _JUMP * np.abs(near - far) for at, near, far in rows[:axes]]
        doubtful[long] |= empty | equal | np.logical_or.reduce(leaps)
    return doubtful


def _padding_remark(run: OneClock, lost: Sequence[tuple[str, int]]) -> list[str]:
    if not lost:
        return []
    rows = sum(count for _, count in lost)
    trials = ", ".join(name for name, _ in lost[:8]) + (", …" if len(lost) > 8 else "")
    in_run = f" of {run.name}" if run.name not in ("", str(run.file)) else ""
    return [
        f"Padding: {rows} row{'s' * (rows > 1)} without a measurement at the ends of "
        f"trial{'s' * (len(lost) > 1)} {trials}{in_run} left out."
    ]


def _measured(values: FloatArray, axes: int) -> tuple[int, int]:
    """First measured row, and the row after the last."""
    full = np.flatnonzero(~np.isnan(values).all(axis=1))
    if not len(full):
        return 0, 0
    first, last = int(full[0]), int(full[-1]) + 1
    inner = values[first:last]
    after = _leaped_to(inner, axes) or _frozen(inner)
    return first + _leaped_to(inner[::-1], axes), last - after


def _frozen(values: FloatArray) -> int:
    """Number of rows at the end that repeat the row before, if not due to chance or rest.

    Rows with coarse digits may be equal by chance, and a sensor at rest repeats its values before
    the disturbance too.
    """
    equal = (values[1:] == values[:-1]).all(axis=1)
    runs = np.diff(np.flatnonzero(np.concatenate([[True], ~equal, [True]]))) - 1
    count, longest = int(runs[-1]), int(runs[:-1].max(initial=0))
    if longest > _CHANCE_RUN or not _FROZEN * max(longest, 1) <= count <= _MOST * len(values):
        return 0
    share = (runs[:-1].sum() + 1) / len(values)
    return count if share**count < _CHANCE else 0


def _leaped_to(values: FloatArray, axes: int) -> int:
    """Number of rows at the end that are all the same and far from the values before."""
    same: BoolArray = (values == values[-1]).all(axis=1)
    different = np.flatnonzero(~same)
    if not len(different):
        return 0
    begins = int(different[-1]) + 1
    count = len(values) - begins
    if count > _MOST * len(values):
        return 0
    # impossible numbers are refused later
    with np.errstate(over="ignore", invalid="ignore"):
        steps = np.abs(np.diff(values[: begins + 1, :axes], axis=0))
        before = steps[:-1].max(axis=0, initial=0.0)
        return count if (steps[-1] > _JUMP * before).any() and before.any() else 0
