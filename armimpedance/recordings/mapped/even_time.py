"""Time stamps that scatter about an even clock: are the samples even, or the stamps right?

A network's or computer's stamp is the time at which a sample arrived; the device sampled on its own
clock, and the samples are even. If the device was polled, the stamps are right and the samples are
uneven. The motion decides: on a smooth course x(t) a sample taken late by r is off by v r. Let h be
the part of v r, and d the part of x, that a cubic over five samples does not explain. Then
``d = beta h``, with beta 0 if the samples are even and 1 if the stamps are right.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.recordings.mapped.clocks import OneClock
from armimpedance.recordings.mapped.cutting import Piece
from armimpedance.recordings.mapped.mapping import ColumnMapping
from armimpedance.recordings.tables.sample_table import STEP_TOLERANCE

#: Limits of jitter, in steps: of a single stamp, and of the median over a section of this many
#: samples. Beyond them a sample was lost.
_FARTHEST: Final = 1.5
_LASTING: Final = 0.25
_STRETCH: Final = 21
#: Weights for the residual of the middle of five samples from a cubic through its neighbours.
_ROUGH: Final = np.array([1.0, -4.0, 6.0, -4.0, 1.0]) / 6.0


@dataclass(frozen=True)
class EvenTime:
    """A run whose trials have even times.

    `notes`: what was done, and the possible error; empty if nothing was done.
    """

    run: OneClock
    notes: tuple[str, ...] = ()


def with_even_time(
    run: OneClock, pieces: Sequence[Piece], mapping: ColumnMapping, rate_hz: float
) -> EvenTime:
    """Replace stamps that scatter about an even clock by the times of that clock.

    Samples that were taken unevenly are interpolated by a cubic spline; even samples are not
    changed. Stamps that are even, run backwards or have gaps are not changed; the check of the
    clock reports them.
    """
    if run.time_s is None or _is_even(run.time_s, pieces, rate_hz):
        return EvenTime(run)
    lines = [_even(run.time_s[p.start : p.stop], rate_hz) for p in pieces]
    if not any(line is not None for line in lines) or not _all_jitter(run, pieces, lines, rate_hz):
        return EvenTime(run)
    time = run.time_s.copy()
    for piece, line in zip(pieces, lines, strict=True):
        if line is not None:
            time[piece.start : piece.stop] = line
    deviation = run.time_s - time
    position = np.column_stack([run.numbers(name) for name in mapping.position.columns])
    beta, sd = _stamps_are_right(position, deviation, pieces, rate_hz)
    right = beta - 2.0 * sd > 0.5
    signals = {name for quantity in mapping.quantities.values() for name in quantity.columns}
    columns = _interpolated(run, signals, pieces, time) if right else run.columns
    speed = max(_fastest(position[p.start : p.stop], rate_hz) for p in pieces)
    scatter = float(np.concatenate([deviation[p.start : p.stop] for p in pieces]).std())
    note = (
        f"Time stamps scatter by {1e3 * scatter:.2g} ms about an even clock of {rate_hz:.6g} Hz. "
        + _reason(right, beta, sd, mapping.position.unit.symbol, speed * scatter)
    )
    return EvenTime(replace(run, time_s=time, columns=columns), (note,))


def _is_even(time: FloatArray, pieces: Sequence[Piece], rate_hz: float) -> bool:
    with np.errstate(invalid="ignore", over="ignore"):  # stamps that are not finite
        off = ~(np.abs(np.diff(time) * rate_hz - 1.0) <= STEP_TOLERANCE)
    off[np.array([p.start for p in pieces if p.start], dtype=np.int64) - 1] = False
    return not off.any()


def _reason(right: bool, beta: float, sd: float, unit: str, error: float) -> str:
    share = f"{beta:.2f} ± {2 * sd:.2f} of the scatter is in the motion"
    if right:
        return f"The samples are uneven ({share}): they were interpolated onto it."
    doubt = f"if they were not, positions would be off by up to {error:.2g} {unit}"
    if beta + 2.0 * sd < 0.5:
        return f"The samples are even ({share}) and stay; {doubt}."
    return (
        f"Whether the samples are even the motion does not say ({share}); they stay, and {doubt}."
    )


def _even(time: FloatArray, rate_hz: float) -> FloatArray | None:
    """Even clock through a trial's stamps; None if they are even already, or not increasing."""
    steps = np.diff(time)
    if not len(steps) or not np.isfinite(time).all() or not (steps > 0.0).all():
        return None
    if (np.abs(steps * rate_hz - 1.0) <= STEP_TOLERANCE).all():
        return None
    even_time = np.arange(len(time)) / rate_hz
    return even_time + float(np.median(time - even_time))


def _all_jitter(
    run: OneClock, pieces: Sequence[Piece], lines: Sequence[FloatArray | None], rate_hz: float
) -> bool:
    """True if the stamps scatter about their even clocks, without a gap anywhere."""
    assert run.time_s is not None  # noqa: S101 - asked by the caller
    for piece, line in zip(pieces, lines, strict=True):
        if line is None:
            continue
        late = (run.time_s[piece.start : piece.stop] - line) * rate_hz
        width = min(_STRETCH, len(late))
        lasting = np.median(np.lib.stride_tricks.sliding_window_view(late, width), axis=1)
        if np.abs(late).max() > _FARTHEST or np.abs(lasting).max() > _LASTING:
            return False
    return True


def _stamps_are_right(
    position: FloatArray, late: FloatArray, pieces: Sequence[Piece], rate_hz: float
) -> tuple[float, float]:
    """Estimate beta (see the module) and its standard error."""
    rough, expected = [], []
    for piece in pieces:
        positions = position[piece.start : piece.stop]
        if len(positions) < 2 * len(_ROUGH):
            continue
        smooth = np.apply_along_axis(np.convolve, 0, positions, np.ones(5) / 5.0, "same")
        shift = np.gradient(smooth, axis=0) * rate_hz * late[piece.start : piece.stop, None]
        for axis in range(positions.shape[1]):
            rough.append(np.convolve(positions[:, axis], _ROUGH, "valid")[5:-5])
            expected.append(np.convolve(shift[:, axis], _ROUGH, "valid")[5:-5])
    d, h = np.concatenate(rough or [np.zeros(1)]), np.concatenate(expected or [np.zeros(1)])
    power = float(h @ h)
    if not power > 0.0:
        return 0.0, np.inf
    # d = h beta, (N,) = (N,) (1,)
    beta = float(h @ d) / power
    return beta, float(np.sqrt(np.mean((d - beta * h) ** 2) / power))


def _fastest(position: FloatArray, rate_hz: float) -> float:
    if len(position) < 2:
        return 0.0
    return float(np.linalg.norm(np.gradient(position, axis=0), axis=1).max()) * rate_hz


def _interpolated(
    run: OneClock, signals: set[str], pieces: Sequence[Piece], time: FloatArray
) -> dict[str, np.ndarray]:
    """Interpolate signals to the even times; marks and other columns are not changed."""
    from scipy.interpolate import CubicSpline

    assert run.time_s is not None  # noqa: S101 - asked by the caller
    columns = dict(run.columns)
    for name in signals & set(columns):
        values = run.numbers(name).copy()
        for piece in pieces:
            rows = slice(piece.start, piece.stop)
            if piece.stop - piece.start > 3 and np.isfinite(values[rows]).all():
                values[rows] = CubicSpline(run.time_s[rows], values[rows])(time[rows])
        columns[name] = values
    return columns
