"""Input of the methods for two pathways: rows, the cell of each, and the reflex's signal."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Final, Literal

import numpy as np

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.joint.elbow.cascade.rows import (
    CascadeRows,
    Cells,
    CourseEstimates,
    autoregression,
    cells_of,
    columns_of,
)
from armimpedance.joint.elbow.samples import JointSamples
from armimpedance.joint.elbow.varying.data import VaryingData

# The reflex's signal: the delayed velocity, linear or rectified, after a low-pass.

Side = Literal["both", "positive", "negative"]
SIDES: Final[tuple[Side, ...]] = ("both", "positive", "negative")
ORDERS: Final = (1, 2)
#: Length of past velocity that is used at most, s.
PAD_S: Final = 1.0
#: Number of time constants after which the low-pass has forgotten all but a two-hundredth.
FORGOTTEN: Final = 8.0


@dataclass(frozen=True)
class Pathway:
    """A reflex pathway without its gain.

    `cutoff_hz`: of the low-pass, whose poles are all alike.
    `side`: velocities that it responds to.
    """

    delay_s: float
    cutoff_hz: float
    order: int = 2
    side: Side = "both"

    @property
    def lead_s(self) -> float:
        """Time after which the motion before the record has no more effect, s."""
        return min(self.delay_s + FORGOTTEN / (2 * np.pi * self.cutoff_hz), PAD_S)

    def signal(self, rows: CascadeRows) -> FloatArray:
        """Response to the motion at gain one, (N,) rad/s."""
        out = np.empty(len(rows.torque))
        for row in range(len(rows.offsets) - 1):
            inside = rows.trial(row)
            out[inside] = self.of_rate(rows.motion[inside, 1], rows.rate_hz)
        return out

    def of_rate(self, rate: FloatArray, rate_hz: float) -> FloatArray:
        """Response (S,) to an angular velocity (S,) that was zero before, rad/s."""
        if self.side == "positive":
            rate = np.maximum(rate, 0)
        elif self.side == "negative":
            rate = np.minimum(rate, 0)
        count = _fast(len(rate) + round(PAD_S * rate_hz))
        s = 2j * np.pi * np.fft.rfftfreq(count, 1 / rate_hz)
        lag = (1 + s / (2 * np.pi * self.cutoff_hz)) ** -float(self.order)
        late = np.fft.rfft(rate, count) * lag * np.exp(-s * self.delay_s)
        return np.asarray(np.fft.irfft(late, count)[: len(rate)])


def _fast(count: int) -> int:
    from scipy.fft import next_fast_len

    return int(next_fast_len(count, real=True))


#: Rows per cell of time; in trials of at most `SHORT_ROWS` rows a cell is one row.
CELL_ROWS: Final = 2
SHORT_ROWS: Final = 2500
#: Largest number of rows that are used to search for the reflex.
MOST_ROWS: Final = 20_000
#: Coefficients of the noise below this mix too little to matter.
MIXED: Final = 0.15
#: Largest share of a trial that is left out at its beginning because of the reflex.
MOST_LEAD: Final = 0.2
#: A residual beyond this many standard deviations comes from a jump, not from the noise.
OUTLYING: Final = 4.5


@dataclass(frozen=True, eq=False)
class CascadeTask:
    """Rows of T trials, and the cells in which they are summed up.

    `cell` (N,) int: cell of each row; -1: not used.
    `strips` (S + 1,) int: first cell of each strip of consecutive cells; a strip is a trial, or all
    trials together if these are aligned.
    `width`: of a cell.
    `start`: beginning of the first cell of a strip.
    `over`: "time_s", or the variable of which the courses are functions.
    `cyclic`: True if the last cell is a neighbour of the first.
    `noise` (p + 1,): the torque's noise as an autoregression.
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
        """True if the cells are pieces of time."""
        return self.over == "time_s"

    @property
    def torn(self) -> int:
        """Number of cells after a jump that the noise's memory makes a mixture of before and
        after."""
        reach = int(np.flatnonzero(np.abs(self.noise) > MIXED)[-1]) + 1
        return -(-reach // max(round(self.width * self.rows.rate_hz), 1))

    @property
    def aligned(self) -> bool:
        """True if trials share their cells."""
        return self.in_time and len(self.strips) - 1 < len(self.data.trials)

    def settled(self, lead_s: float) -> CascadeTask:
        """Leave out the first rows of each trial, where the reflex depends on earlier motion."""
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

    def learnt(self, estimates: CourseEstimates) -> CascadeTask:
        """Return the task with the noise estimated from a fit's residual."""
        theta = np.column_stack([estimates.mean, np.full(len(estimates.mean), estimates.inertia)])
        columns, used = self.columns(), self.cell >= 0
        at = np.maximum(self.cell, 0)
        residual = columns[:, -1].copy()
        for j in range(theta.shape[1]):
            residual -= theta[at, j] * columns[:, j]
        sd = 1.4826 * float(np.median(np.abs(residual[used])))
        jumped = np.convolve(np.abs(residual) > OUTLYING * sd, np.ones(5), "same") > 0
        residual[~used | jumped] = np.nan
        return replace(self, noise=autoregression(residual))


def task_in_time(
    samples: JointSamples, data: VaryingData, rows: CascadeRows, aligned: bool
) -> CascadeTask:
    """Task with cells of time, separate for each trial, or shared if trials are aligned."""
    counts = np.diff(data.offsets)
    within = np.concatenate([np.arange(c) for c in counts])
    per_cell = 1 if counts.max() <= SHORT_ROWS else CELL_ROWS
    strips = np.concatenate([[0], np.cumsum(-(-counts // per_cell))])
    cell = within // per_cell
    if aligned:
        strips = np.array([0, -(-int(counts.max()) // per_cell)])
    else:
        cell = cell + np.repeat(strips[:-1], counts)
    width = per_cell / data.rate_hz
    return CascadeTask(samples, data, rows, _without_ends(cell, rows), strips, width)


def beginning(task: CascadeTask) -> CascadeTask:
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
) -> CascadeTask:
    """Task with cells of another variable (N,), known at the rows: `bins` of equal width."""
    cyclic = name == "phase"
    low, high = (0.0, 1.0) if cyclic else np.quantile(variable, (0.005, 0.995)).tolist()
    width = (high - low) / bins
    cell = np.floor((variable - low) / width).astype(np.int64)
    if cyclic:
        cell %= bins
    cell[(cell < 0) | (cell >= bins)] = -1
    strips = np.array([0, bins])
    cell = _without_ends(cell, rows)
    return CascadeTask(
        samples, data, rows, cell, strips, width, over=name, start=low, cyclic=cyclic
    )


# Result of a method for two pathways.


@dataclass(frozen=True)
class CascadeCourses:
    """Result of a method: courses at the cells, the task with the last noise, and notes."""

    estimates: CourseEstimates
    task: CascadeTask
    notes: tuple[str, ...] = ()
