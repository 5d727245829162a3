"""Rows of the parallel cascade's equation, the noise of its torque, and their sums in cells.

``y = I x'' + B(t) x' + K(t) x + G(t) r(t) + offset(t)``. The angle is replaced by its expectation
given the measurement (Wiener's filter over frequency), and the derivatives are taken from that, so
that the angle's noise does not bias I, B and K towards zero. Both channels are averaged over the
same blocks of samples. The torque is not filtered further, since a filter does not commute with
K(t); with averages a jump stays within its block.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord, IntArray
from armimpedance.joint.elbow.samples import JointSamples
from armimpedance.joint.elbow.varying.data import VaryingData

#: Length at each end of a trial that is not used, because filters have transients there, s.
EDGE_S: Final = 0.1
#: Length of raw samples on either side of an instant, s.
AROUND_S: Final = 1.0
#: Length of the segments of the angle's spectrum, s.
SEGMENT_S: Final = 2.0


@dataclass(frozen=True, eq=False)
class CascadeRows(FrozenRecord):
    """Decimated rows of T trials, one after another.

    `offsets` (T + 1,) int.
    `torque` (N,): N m on the limb, without its mean.
    `motion` (N, 3): angular acceleration, velocity and angle: rad/s^2, rad/s, rad.
    """

    rate_hz: float
    offsets: Annotated[IntArray, "t+1"]
    torque: Annotated[FloatArray, "n"]
    motion: Annotated[FloatArray, "n 3"]

    @property
    def edge(self) -> int:
        """Number of rows at each end of a trial that are not used."""
        return round(EDGE_S * self.rate_hz)

    def trial(self, row: int) -> slice:
        """Slice of the rows of a trial."""
        return slice(int(self.offsets[row]), int(self.offsets[row + 1]))


def cascade_rows(
    samples: JointSamples, data: VaryingData, slow_hz: float = 0.0, aligned: bool = False
) -> CascadeRows:
    """Rows of torque and angle, averaged over blocks.

    `data`: the decimated samples, with their rate, band and noise.
    `slow_hz`: frequency below which the angle is posture, not deflection, and is left out of the
    motion.
    `aligned`: True if trials share one operating point, the mean of all; else each has its own.
    """
    motion, torque = np.empty((len(data.angle), 3)), np.empty(len(data.angle))
    for row in range(len(data.trials)):
        inside = slice(int(data.offsets[row]), int(data.offsets[row + 1]))
        angle = block_means(samples.angle[samples.samples_of(row)], data.every)
        block_torque = block_means(samples.torque[samples.samples_of(row)], data.every)
        angle -= float(samples.angle.mean()) if aligned else angle.mean()
        gain = _wiener(angle - angle.mean(), float(data.sd_angle[row]), data.rate_hz)
        motion[inside] = _derivatives(angle, gain, data.rate_hz, slow_hz)
        torque[inside] = block_torque - (
            float(samples.torque.mean()) if aligned else block_torque.mean()
        )
    return CascadeRows(data.rate_hz, data.offsets, torque, motion)


@dataclass(frozen=True, eq=False)
class RawRows(FrozenRecord):
    """Raw samples of one trial about an instant.

    `torque` (S,), `motion` (S, 3).
    `within` (S,) int: number of each sample in its trial.
    """

    rate_hz: float
    within: Annotated[IntArray, "s"]
    torque: Annotated[FloatArray, "s"]
    motion: Annotated[FloatArray, "s 3"]


def raw_rows(
    samples: JointSamples,
    data: VaryingData,
    row: int,
    between: tuple[int, int],
    aligned: bool,
) -> RawRows | None:
    """Raw samples of a trial between two sample numbers, with some before.

    `between` (int, int).
    `row`: number of the trial.
    `aligned`: as for `cascade_rows`.
    Returns: None if the trial does not contain them.
    """
    inside, rate = samples.samples_of(row), samples.sample_rate_hz
    around, count = round(AROUND_S * rate), inside.stop - inside.start
    low, high = max(between[0] - around, 0), min(between[1] + around, count)
    if between[0] < 0 or between[1] > count:
        return None
    part = slice(inside.start + low, inside.start + high)
    mean_angle, mean_torque = (
        float((channel if aligned else channel[inside]).mean())
        for channel in (samples.angle, samples.torque)
    )
    angle = samples.angle[part] - mean_angle
    sd = float(data.sd_angle[row]) * np.sqrt(data.every)
    motion = _derivatives(angle, _wiener(angle - angle.mean(), sd, rate), rate, 0.0)
    kept = slice(0, between[1] - low)
    return RawRows(
        rate, np.arange(low, high)[kept], samples.torque[part][kept] - mean_torque, motion[kept]
    )


def block_means(signal: FloatArray, every: int) -> FloatArray:
    """Means of blocks of `every` samples; the last block may be shorter."""
    starts = np.arange(0, len(signal), every)
    counts = np.diff(np.append(starts, len(signal)))
    return np.asarray(np.add.reduceat(signal, starts) / counts)


def _wiener(angle: FloatArray, sd: float, rate_hz: float) -> tuple[FloatArray, FloatArray]:
    """Frequencies, and the share of the angle's power that is motion, falling beyond its peak."""
    count = min(round(SEGMENT_S * rate_hz), len(angle))
    taper = np.hanning(count)
    starts = range(0, len(angle) - count + 1, max(count // 2, 1))
    power = np.mean(
        [np.abs(np.fft.rfft(angle[a : a + count] * taper)) ** 2 for a in starts], axis=0
    )
    part = np.maximum(1 - sd**2 * (taper**2).sum() / np.maximum(power, 1e-300), 0.0)
    peak = int((power * np.arange(len(power)) ** 2).argmax())
    part[: peak + 1] = np.maximum(part[: peak + 1], part[peak])
    falling: FloatArray = np.minimum.accumulate(part)
    return np.asarray(np.fft.rfftfreq(count, 1 / rate_hz), dtype=np.float64), falling


def _derivatives(
    angle: FloatArray, gain_table: tuple[FloatArray, FloatArray], rate_hz: float, slow_hz: float
) -> FloatArray:
    """Second, first and zeroth derivative of a trial's angle (S, 3), extended by point
    reflection."""
    S = len(angle)
    pad = min(S - 1, round(rate_hz))
    longer = np.concatenate(
        [2 * angle[0] - angle[pad:0:-1], angle, 2 * angle[-1] - angle[-2 : -2 - pad : -1]]
    )
    count = len(longer)
    frequency = np.fft.rfftfreq(count, 1 / rate_hz)
    gain = np.interp(frequency, *gain_table)
    # the straight line between the ends is not periodic and is treated separately
    line = np.linspace(longer[0], longer[-1], count)
    spectrum = np.fft.rfft(longer - line) * gain
    slope = (longer[-1] - longer[0]) * rate_hz / (count - 1)
    if slow_hz:
        spectrum *= 1 / (1 + (slow_hz / np.maximum(frequency, 1e-12)) ** 4)
        line, slope = np.zeros(count), 0.0
    s = 2j * np.pi * frequency
    out = np.stack([np.fft.irfft(spectrum * s**k, count)[pad : pad + S] for k in (2, 1, 0)], axis=1)
    out[:, 1] += slope
    out[:, 2] += line[pad : pad + S]
    return out


# The torque's noise as an autoregression, and whitened rows.

#: Highest order of the autoregression.
ORDER: Final = 16


def autoregression(residual: FloatArray) -> FloatArray:
    """Coefficients ``1, a_1, ...`` (p + 1,) of the torque's residual, after Burg (1968).

    `residual` (N,): NaN if missing.
    """
    values = np.where(np.isfinite(residual), residual, 0.0)
    forward, backward = values[1:].copy(), values[:-1].copy()
    # products across the gap between two trials are left out
    gap = ~(np.isfinite(residual[1:]) & np.isfinite(residual[:-1]))
    a = best = np.ones(1)
    count = max(int((~gap).sum()), 2)
    least = score = np.log(max((values**2).sum(), 1e-300))
    for order in range(1, ORDER + 1):
        forward[gap], backward[gap] = 0.0, 0.0
        power = (forward**2).sum() + (backward**2).sum()
        k = -2 * (forward @ backward) / power if power else 0.0
        longer = np.append(a, 0.0)
        a = longer + k * longer[::-1]
        forward, backward = (forward + k * backward)[1:], (backward + k * forward)[:-1]
        gap = gap[1:] | gap[:-1]
        score += np.log(1 - k**2)
        # Schwarz's criterion
        if score + order * np.log(count) / count < least:
            least, best = score + order * np.log(count) / count, a
    return best


def whitened(values: FloatArray, a: FloatArray) -> FloatArray:
    """Filter ``sum_k a_k values[t - k]`` along the first axis; the first p rows lack their past."""
    out = np.array(values)
    for k in range(1, len(a)):
        out[k:] += a[k] * values[:-k]
    return out


# Rows summed up in cells: short pieces of time, or of another variable.
#
# Inside a cell every course is constant, so the matrix of products of its whitened columns has all
# the record's information. The cost of later steps grows with the number of cells, not of samples,
# and aligned trials are added up cell by cell.

#: Number of rows whose products are formed at once.
_AT_ONCE: Final = 20_000


@dataclass(frozen=True, eq=False)
class Cells(FrozenRecord):
    """Sums of products over n cells.

    Columns: the courses (B, K, reflex gain if there is one, offset), then I, then the torque.

    Attributes
    ----------
    width : float
        Width of a cell: s, or the unit of the variable.
    products : (n, q, q)
    rows : (n,)
        Number of rows in each cell.
    """

    width: float
    products: Annotated[FloatArray, "n q q"]
    rows: Annotated[IntArray, "n"]

    @property
    def courses(self) -> int:
        """Number m of courses."""
        return self.products.shape[1] - 2

    def merged(self, count: int) -> Cells:
        """Merge each `count` cells into one."""
        if count == 1:
            return self
        starts = np.arange(0, len(self.rows), count)
        sums = np.add.reduceat(self.products, starts), np.add.reduceat(self.rows, starts)
        return Cells(self.width * count, *sums)

    def part(self, first: int, last: int) -> Cells:
        """Cells from `first` to before `last`."""
        return Cells(self.width, self.products[first:last], self.rows[first:last])


def columns_of(rows: CascadeRows, answer: FloatArray | None) -> FloatArray:
    """Columns (N, m + 2) of the equation: x', x, the reflex's signal, 1, x'', torque."""
    parts = [rows.motion[:, 1], rows.motion[:, 2]]
    parts += [] if answer is None else [answer]
    parts += [np.ones(len(rows.torque)), rows.motion[:, 0], rows.torque]
    return np.stack(parts, axis=1)


def cells_of(columns: FloatArray, cell: IntArray, count: int, width: float, a: FloatArray) -> Cells:
    """Sum the products of whitened rows in cells.

    `columns` (N, q).
    `cell` (N,) int: cell of each row; -1: not used.
    `a` (p + 1,): the noise's autoregression.
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


# Result of a smoother or a search for jumps over cells.


@dataclass(frozen=True, eq=False)
class CourseEstimates(FrozenRecord):
    """Estimated courses at n cells.

    `mean`, `variance` (n, m): B, K, reflex gain if there is one, offset.
    `evidence`: logarithm of the marginal likelihood.
    `noise`: variance of the white noise.
    `begins` (n,) or (0,): probability that courses jump at the beginning of each cell; empty if
    they are smooth.
    """

    mean: Annotated[FloatArray, "n m"]
    variance: Annotated[FloatArray, "n m"]
    inertia: float
    var_inertia: float
    evidence: float
    noise: float
    begins: Annotated[FloatArray, "k"] = field(default_factory=lambda: np.zeros(0))


def joined(parts: list[tuple[CourseEstimates, int, int]]) -> CourseEstimates:
    """Join pieces of a record; of each, the cells between the two numbers."""
    weight = np.array([1 / p.var_inertia for p, _, _ in parts])
    values = np.array([p.inertia for p, _, _ in parts])
    return CourseEstimates(
        mean=np.concatenate([p.mean[a:b] for p, a, b in parts]),
        variance=np.concatenate([p.variance[a:b] for p, a, b in parts]),
        inertia=float(weight @ values / weight.sum()),
        var_inertia=float(1 / weight.sum()),
        evidence=float(sum(p.evidence for p, _, _ in parts)),
        noise=float(np.mean([p.noise for p, _, _ in parts])),
        begins=np.concatenate([p.begins[a:b] for p, a, b in parts]),
    )
