"""Pathway of a reflex, from the joint's motion to its torque: a delay, then a muscle's low-pass.

Muscle follows its nerve like a critically damped system of second order, ``h = e^(-s d) / (1 + m
s)^2`` with a time constant m of some 10 to 50 ms (R. E. Kearney, R. B. Stein, L. Parameswaran, IEEE
Transactions on Biomedical Engineering 44, 1997, model the ankle's reflex so). If a reflex is
modelled as a delay only, the delay becomes too long, and K too large.

Delay and time constant are not optimised but integrated over. Many pathways explain a record
equally well, from late and quick to early and slow, with different K. Cells of the plane of delay
and time constant that the record does not exclude are divided until they are small enough.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from typing import Final, NamedTuple

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.joint.elbow.stationary.band import Complex

#: Range of delays, from a short-latency reflex to a voluntary response, s.
EARLIEST_S: Final = 0.035
LATEST_S: Final = 0.12
#: Longest time constant of a muscle, s.
SLOWEST_S: Final = 0.05
#: Prior probability that torque follows the delay at once, without a muscle's low-pass.
AT_ONCE: Final = 0.5
#: The memory of a low-pass is negligible after this many of its time constants.
_FORGOTTEN: Final = 5.0
#: Length of past motion that affects the torque, s.
PAST_S: Final = LATEST_S + _FORGOTTEN * SLOWEST_S
#: Number of cells along the delay and along the time constant before any is divided.
_DELAYS: Final = 17
_MUSCLES: Final = 5
#: Width of a cell about a single pathway, s.
_DETAIL_S: Final = 1e-3
#: Cells whose deviance lies within this of the least are divided ...
_NOT_EXCLUDED: Final = 25.0
#: ... until this number of cells lies within `_LIKELY`, or `_MOST_DIVISIONS` times.
_ENOUGH_CELLS: Final = 30
_LIKELY: Final = 6.0
_MOST_DIVISIONS: Final = 8


class ReflexArc(NamedTuple):
    """One pathway: a delay and a muscle's time constant, s."""

    delay_s: float
    muscle_s: float


def response(s: Complex, delay_s: FloatArray, muscle_s: FloatArray) -> Complex:
    """``e^(-s d) / (1 + m s)^2`` of D pathways at s (n,), (n, D)."""
    s = s[:, None]
    return np.asarray(np.exp(-s * delay_s) / (1 + s * muscle_s) ** 2)


def answered_to(angle: FloatArray, pathway: ReflexArc, start: int, rate_hz: float) -> FloatArray:
    """Response of a pathway to an angle (S,), from sample `start` on, (S - start,).

    `start`: at least `PAST_S` times the sample rate.
    """
    late = pathway.delay_s * rate_hz
    whole = int(np.floor(late))
    through = _through_muscle(angle, pathway.muscle_s, rate_hz)
    through = np.append(through, through[-1])
    count = len(angle) - start
    # fractions of a sample: cubic through the four samples about the point, the latest first
    weights = cubic_weights(np.array([late - whole]))[0]
    first = [start - whole + 1 - j for j in range(4)]
    return np.asarray(
        sum(w * through[at : at + count] for w, at in zip(weights, first, strict=True))
    )


def cubic_weights(t: FloatArray) -> FloatArray:
    """Weights (n, 4) of the points -1, 0, 1, 2 in the cubic through them, at t (n,) from 0 to 1."""
    before, at = -t * (t - 1) * (t - 2) / 6, (t + 1) * (t - 1) * (t - 2) / 2
    return np.stack([before, at, -(t + 1) * t * (t - 2) / 2, (t + 1) * t * (t - 1) / 6], axis=1)


def behind(signal: FloatArray, pathway: ReflexArc, rate_hz: float) -> FloatArray:
    """Response of a pathway to a signal (S,) that is constant before its first sample."""
    start = int(np.ceil(PAST_S * rate_hz)) + 2
    return answered_to(np.r_[np.full(start, signal[0]), signal], pathway, start, rate_hz)


def _through_muscle(angle: FloatArray, muscle_s: float, rate_hz: float) -> FloatArray:
    """Angle after the muscle's low-pass, exact for straight lines between samples; from rest."""
    from scipy.signal import lfilter, lfilter_zi

    if muscle_s == 0:
        return angle
    # One pole, twice: y' = (x - y) / m between samples h apart, a = e^(-h/m)
    step = 1 / (rate_hz * muscle_s)
    a = np.exp(-step)
    share = (1 - a) / step
    b = [1 - share, share - a]
    y = angle
    for _ in range(2):
        y = lfilter(b, [1, -a], y, zi=lfilter_zi(b, [1, -a]) * y[0])[0]
    return np.asarray(y)


@dataclass(frozen=True, eq=False)
class PathwayCells:
    """D cells of the plane of pathways, each with its middle, its size and its prior probability.

    `delay_s`, `muscle_s` (D,): middle. `wide_s`, `high_s` (D,): size; a height of zero means no
    low-pass. `belief` (D,): prior probability.
    """

    delay_s: FloatArray
    muscle_s: FloatArray
    wide_s: FloatArray
    high_s: FloatArray
    belief: FloatArray

    def __len__(self) -> int:
        return len(self.delay_s)

    @classmethod
    def about(cls, pathway: ReflexArc) -> PathwayCells:
        """A small cell about one pathway, with a small prior probability."""
        sizes = (_DETAIL_S, 0.0 if pathway.muscle_s == 0 else 2 * _DETAIL_S, 1e-3)
        return cls(*(np.array([x]) for x in (*pathway, *sizes)))

    def chosen(self, which: FloatArray) -> PathwayCells:
        """Return selected cells."""
        return PathwayCells(*(getattr(self, f.name)[which] for f in fields(self)))

    def divided(self) -> PathwayCells:
        """Divide each cell in four, or in two if it has no height."""
        parts = []
        for right in (-0.25, 0.25):
            for up in (-0.25, 0.25):
                flat = self.high_s == 0
                whole = self if up > 0 else self.chosen(~flat)
                share = np.where(whole.high_s == 0, 0.5, 0.25)
                parts.append(
                    PathwayCells(
                        whole.delay_s + right * whole.wide_s,
                        whole.muscle_s + up * whole.high_s,
                        whole.wide_s / 2,
                        whole.high_s / 2,
                        whole.belief * share,
                    )
                )
        return together(parts)


def together(parts: Sequence[PathwayCells]) -> PathwayCells:
    """Join the cells of several parts."""
    return PathwayCells(
        *(np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(PathwayCells))
    )


def all_cells() -> PathwayCells:
    """Cells of the whole plane: torque without or behind a muscle's low-pass, with delays whose
    logarithms are uniform.
    """
    ends, high = np.geomspace(EARLIEST_S, LATEST_S, _DELAYS + 1), SLOWEST_S / _MUSCLES
    delays, wide = (ends[:-1] + ends[1:]) / 2, np.diff(ends)
    rows = [(0.0, 0.0, AT_ONCE)]
    rows += [(high * (k + 0.5), high, (1 - AT_ONCE) / _MUSCLES) for k in range(_MUSCLES)]
    ones = np.ones(_DELAYS)
    return together(
        [PathwayCells(delays, m * ones, wide, h * ones, b / _DELAYS * ones) for m, h, b in rows]
    )


def not_excluded(
    cells: PathwayCells, evaluate: Callable[[PathwayCells], list[FloatArray]]
) -> tuple[PathwayCells, list[FloatArray]]:
    """Divide the cells that the record does not exclude; return all cells and their `evaluate`.

    `evaluate`: returns arrays with one row per cell; the last (D,) is the deviance.
    """
    evaluated = evaluate(cells)
    for _ in range(_MOST_DIVISIONS):
        above = evaluated[-1] - evaluated[-1].min()
        if (above < _LIKELY).sum() >= _ENOUGH_CELLS:
            break
        near = above < _NOT_EXCLUDED
        finer = cells.chosen(near).divided()
        kept = [values[~near] for values in evaluated]
        pairs = zip(kept, evaluate(finer), strict=True)
        cells = together([cells.chosen(~near), finer])
        evaluated = [np.concatenate(pair) for pair in pairs]
    return cells, evaluated
