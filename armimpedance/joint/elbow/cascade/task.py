"""What a method for two pathways is given: rows, the cell of each, the reflex's signal."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Final, Literal

import numpy as np

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.joint.elbow.cascade.rows import (
    CascadeRows,
    Cells,
    FoundCourses,
    autoregression,
    cells_of,
    columns_of,
)
from armimpedance.joint.elbow.samples import JointSamples
from armimpedance.joint.elbow.varying.data import VaryingData

# The reflex's signal: the velocity of a while ago, linear or rectified, behind a low-pass.

Side = Literal["both", "positive", "negative"]
SIDES: Final[tuple[Side, ...]] = ("both", "positive", "negative")
ORDERS: Final = (1, 2)
#: A velocity of so long ago at most is looked at, s.
PAD_S: Final = 1.0
#: Time constants of the low-pass after which less than a two-hundredth is left.
FORGOTTEN: Final = 8.0


@dataclass(frozen=True)
class Pathway:
    """A reflex but for its gain.

    `cutoff_hz`: of the low-pass, whose poles are all alike.
    `side`: which velocities it answers.
    """

    delay_s: float
    cutoff_hz: float
    order: int = 2
    side: Side = "both"

    @property
    def lead_s(self) -> float:
        """Time after which what was before the record is forgotten, s."""
        return min(self.delay_s + FORGOTTEN / (2 * np.pi * self.cutoff_hz), PAD_S)

    def signal(self, rows: CascadeRows) -> FloatArray:
        """Its answer to the motion at gain one, (N,) rad/s."""
        out = np.empty(len(rows.torque))
        for row in range(len(rows.offsets) - 1):
            inside = rows.trial(row)
            out[inside] = self.of_rate(rows.motion[inside, 1], rows.rate_hz)
        return out

    def of_rate(self, rate: FloatArray, rate_hz: float) -> FloatArray:
        """Its answer to an angular velocity (S,) that was nothing before, (S,) rad/s."""
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
class CascadeTask:
    """Rows of T trials, and the cells in which they are summed up.

    `cell` (N,) int: cell of each row; -1: it is not used.
    `strips` (S + 1,) int: cells of a strip follow one another: of a trial, or of all where they are
    aligned.
    `width`: of a cell.
    `start`: where the first cell of a strip begins.
    `over`: "time_s", or the variable of which the courses are functions.
    `cyclic`: whether the last cell has the first as its neighbour.
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

    def settled(self, lead_s: float) -> CascadeTask:
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

    def learnt(self, found: FoundCourses) -> CascadeTask:
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
) -> CascadeTask:
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
    return CascadeTask(
        samples, data, rows, cell, strips, width, over=name, start=low, cyclic=cyclic
    )


# What the table of methods for two pathways holds of each.


@dataclass(frozen=True)
class CascadeCourses:
    """What a method hands over: courses at the cells, the last noise, and what it says of them."""

    found: FoundCourses
    task: CascadeTask
    notes: tuple[str, ...] = ()
