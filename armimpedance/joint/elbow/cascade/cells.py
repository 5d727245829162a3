"""Rows summed up in cells: short pieces of time, or of another variable.

Inside a cell every course is constant, so that all that the record says of it is the matrix
of products of its whitened columns. The sums make what follows as long as the number of cells, not
of samples, and trials that are aligned are added up cell by cell.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord, IntArray
from armimpedance.joint.elbow.cascade.noise import whitened
from armimpedance.joint.elbow.cascade.rows import CascadeRows

#: Rows that are multiplied out at once.
_AT_ONCE: Final = 20_000


@dataclass(frozen=True, eq=False)
class Cells(FrozenRecord):
    """Sums of products of n cells.

    Columns: the courses (B, K, reflex gain if there is one, offset), then I, then the torque.

    Attributes
    ----------
    width : float
        Of a cell: s, or the unit of the variable.
    products : (n, q, q)
    rows : (n,)
        Number of rows in each.
    """

    width: float
    products: Annotated[FloatArray, "n q q"]
    rows: Annotated[IntArray, "n"]

    @property
    def courses(self) -> int:
        """Number m of courses."""
        return self.products.shape[1] - 2

    def merged(self, count: int) -> Cells:
        """Cells of `count` of these each."""
        if count == 1:
            return self
        starts = np.arange(0, len(self.rows), count)
        sums = np.add.reduceat(self.products, starts), np.add.reduceat(self.rows, starts)
        return Cells(self.width * count, *sums)

    def part(self, first: int, last: int) -> Cells:
        """Cells from `first` on, up to `last`."""
        return Cells(self.width, self.products[first:last], self.rows[first:last])


def columns_of(rows: CascadeRows, answer: FloatArray | None) -> FloatArray:
    """Columns (N, m + 2) of the equation: x', x, the reflex's, 1, x'', torque."""
    parts = [rows.motion[:, 1], rows.motion[:, 2]]
    parts += [] if answer is None else [answer]
    parts += [np.ones(len(rows.torque)), rows.motion[:, 0], rows.torque]
    return np.stack(parts, axis=1)


def cells_of(columns: FloatArray, cell: IntArray, count: int, width: float, a: FloatArray) -> Cells:
    """Sums over rows whose noise is white.

    Parameters
    ----------
    columns : (N, q)
    cell : (N,) int
        Cell of each row; -1: it is not used.
    count : int
    width : float
    a : (p + 1,)
        The noise's autoregression.
    """
    q = columns.shape[1]
    sums, rows = np.zeros((count, q * q)), np.zeros(count, dtype=np.int64)
    lag = len(a) - 1
    for first in range(0, len(columns), _AT_ONCE):
        last = min(first + _AT_ONCE, len(columns))
        before = max(first - lag, 0)
        white = whitened(columns[before:last], a)[first - before :]
        at = cell[first:last]
        used = np.flatnonzero(at >= 0)
        if not len(used):
            continue
        order = used[np.argsort(at[used], kind="stable")]
        numbers, starts = np.unique(at[order], return_index=True)
        outer = (white[order][:, :, None] * white[order][:, None, :]).reshape(-1, q * q)
        sums[numbers] += np.add.reduceat(outer, starts)
        rows += np.bincount(at[used], minlength=count)
    return Cells(width, sums.reshape(count, q, q), rows)
