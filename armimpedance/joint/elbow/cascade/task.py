"""What a method for two pathways is given: rows, and the cell of each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.joint.elbow.cascade.answer import Pathway
from armimpedance.joint.elbow.cascade.cells import Cells, cells_of, columns_of
from armimpedance.joint.elbow.cascade.found import Found
from armimpedance.joint.elbow.cascade.noise import autoregression
from armimpedance.joint.elbow.cascade.rows import CascadeRows
from armimpedance.joint.elbow.samples import JointSamples
from armimpedance.joint.elbow.varying.data import VaryingData

#: Rows of a cell of time, and trials of so many rows in which a cell is one row.
CELL_ROWS: Final = 2
SHORT_ROWS: Final = 2500
#: Rows from which it is judged whether there is a reflex, and which.
MOST_ROWS: Final = 20_000
#: Coefficients of the noise below this mix too little to tell.
MIXED: Final = 0.15
#: The part of a trial that a reflex may lose at its beginning.
MOST_LEAD: Final = 0.2
#: What is left beyond so many deviations is a jump's and not the noise's.
OUTLYING: Final = 4.5


@dataclass(frozen=True, eq=False)
class Task:
    """Rows of T trials, and the cells in which they are summed up.

    Attributes
    ----------
    samples : JointSamples
    data : VaryingData
    rows : CascadeRows
    cell : (N,) int
        Cell of each row; -1: it is not used.
    strips : (S + 1,) int
        Cells of a strip follow one another: of a trial, or of all where they are aligned.
    width : float
        Of a cell.
    start : float
        Where the first cell of a strip begins.
    over : str
        "time_s", or the variable of which the courses are functions.
    cyclic : bool
        Whether the last cell has the first as its neighbour.
    pathway : Pathway or None
    noise : (p + 1,)
        The torque's noise as an autoregression.
    """

    samples: JointSamples
    data: VaryingData
    rows: CascadeRows
    cell: IntArray
    strips: IntArray
    width: float
    over: str = "time_s"
    start: float = 0.0
    cyclic: bool = False
    pathway: Pathway | None = None
    noise: FloatArray = field(default_factory=lambda: np.ones(1))
    tick: Callable[[], None] = lambda: None

    @property
    def in_time(self) -> bool:
        """Whether the cells are pieces of time."""
        return self.over == "time_s"

    @property
    def torn(self) -> int:
        """Cells after a jump that mix, by the noise's memory, what was before and after it."""
        reach = int(np.flatnonzero(np.abs(self.noise) > MIXED)[-1]) + 1
        return -(-reach // max(round(self.width * self.rows.rate_hz), 1))

    @property
    def aligned(self) -> bool:
        """Whether trials share their cells."""
        return self.in_time and len(self.strips) - 1 < len(self.data.trials)

    def settled(self, lead_s: float) -> Task:
        """Without the first rows of each trial, whose reflex answers what was before the trial."""
        cell = np.array(self.cell)
        for row in range(len(self.rows.offsets) - 1):
            inside = self.rows.trial(row)
            most = MOST_LEAD * (inside.stop - inside.start)
            cell[inside][: round(min(lead_s * self.rows.rate_hz, most))] = -1
        return replace(self, cell=cell)

    def columns(self) -> FloatArray:
        """Columns (N, m + 2) of the equation."""
        return columns_of(self.rows, self.pathway.signal(self.rows) if self.pathway else None)

    def cells(self) -> Cells:
        """Sums of products of all cells."""
        count = int(self.strips[-1])
        # the range of a variable counts as one, whatever its unit
        width = self.width if self.in_time else 1 / count
        return cells_of(self.columns(), self.cell, count, width, self.noise)

    def learnt(self, found: Found) -> Task:
        """The same with the noise that a fit leaves."""
        theta = np.column_stack([found.mean, np.full(len(found.mean), found.inertia)])
        columns, used = self.columns(), self.cell >= 0
        at = np.maximum(self.cell, 0)
        left = columns[:, -1].copy()
        for j in range(theta.shape[1]):
            left -= theta[at, j] * columns[:, j]
        sd = 1.4826 * float(np.median(np.abs(left[used])))
        jumped = np.convolve(np.abs(left) > OUTLYING * sd, np.ones(5), "same") > 0
        left[~used | jumped] = np.nan
        return replace(self, noise=autoregression(left))


def task_in_time(
    samples: JointSamples, data: VaryingData, rows: CascadeRows, aligned: bool
) -> Task:
    """Cells of time, of each trial by itself or of all at once."""
    counts = np.diff(data.offsets)
    within = np.concatenate([np.arange(c) for c in counts])
    each = 1 if counts.max() <= SHORT_ROWS else CELL_ROWS
    strips = np.concatenate([[0], np.cumsum(-(-counts // each))])
    cell = within // each
    if aligned:
        strips = np.array([0, -(-int(counts.max()) // each)])
    else:
        cell = cell + np.repeat(strips[:-1], counts)
    width = each / data.rate_hz
    return Task(samples, data, rows, _without_ends(cell, rows), strips, width)


def beginning(task: Task) -> Task:
    """The first rows of a long record, with the cells that they fill."""
    if len(task.cell) <= MOST_ROWS:
        return task
    cell = np.array(task.cell)
    cell[MOST_ROWS:] = -1
    if not task.in_time or task.aligned:
        return replace(task, cell=cell)
    last = int(cell.max()) + 1
    strips = np.append(task.strips[task.strips < last], last)
    return replace(task, cell=cell, strips=strips)


def _without_ends(cell: IntArray, rows: CascadeRows) -> IntArray:
    out = np.array(cell)
    for row in range(len(rows.offsets) - 1):
        inside = rows.trial(row)
        out[inside][: rows.edge] = -1
        out[inside][-rows.edge :] = -1
    return out


def task_over(
    samples: JointSamples,
    data: VaryingData,
    rows: CascadeRows,
    variable: FloatArray,
    name: str,
    bins: int = 100,
) -> Task:
    """Cells of another variable (N,), known at the rows: `bins` of equal width."""
    cyclic = name == "phase"
    low, high = (0.0, 1.0) if cyclic else np.quantile(variable, (0.005, 0.995)).tolist()
    width = (high - low) / bins
    cell = np.floor((variable - low) / width).astype(np.int64)
    if cyclic:
        cell %= bins
    cell[(cell < 0) | (cell >= bins)] = -1
    strips = np.array([0, bins])
    cell = _without_ends(cell, rows)
    return Task(samples, data, rows, cell, strips, width, over=name, start=low, cyclic=cyclic)
