"""What the numbers of a column say: whether it is time, in which unit, and what a force tells."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from armimpedance.core.arrays import FloatArray

#: Sample rates that recordings of arms have.
SLOWEST_HZ, FASTEST_HZ = 15.0, 12_000.0
#: A hand's record in m spans less than the first; in mm more than the second; between: unclear.
SPAN_M, SPAN_MM = 0.4, 100.0
#: Angles beyond a full turn are degrees.
_TURN: Final = 2.0 * np.pi
#: A motion that explains a smaller share of the force says nothing of its sign.
_SAYS_LITTLE: Final = 0.2
#: So much of a record is looked at.
_MOST_PIECES, _LONGEST, _SHORTEST = 60, 20_000, 30


@dataclass(frozen=True)
class Found:
    """A word for the mapping and why; None where the data cannot tell."""

    word: str | None
    why: str


def finite_part(values: NDArray[Any]) -> FloatArray:
    """The numbers among the values."""
    numbers = np.asarray(values, dtype=np.float64)
    return numbers[np.isfinite(numbers)]


def time_steps(values: NDArray[Any]) -> tuple[float, float] | None:
    """The usual step and the share of steps that are it within 10 %; None: not like time."""
    numbers = np.asarray(values, dtype=np.float64)
    if len(numbers) < 3 or not np.isfinite(numbers).all():
        return None
    with np.errstate(over="ignore", invalid="ignore"):
        step = np.diff(numbers)
    forward = step[step > 0]
    if len(forward) < 0.9 * len(step) or not np.isfinite(forward).all():
        return None
    usual = float(np.median(forward))
    return usual, float(np.mean(np.abs(step - usual) < 0.1 * usual))


def time_unit(step: float) -> Found:
    """The unit in which a step makes a plausible rate."""
    units = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}
    fits = [u for u, per in units.items() if SLOWEST_HZ <= per / step <= FASTEST_HZ]
    told = f"a step of {step:.6g}"
    if len(fits) != 1:
        return Found(None, f"{told} fits {' and '.join(fits) or 'no unit of time'}")
    return Found(fits[0], f"{told} makes {units[fits[0]] / step:.6g} Hz")


def length_unit(columns: Sequence[NDArray[Any]]) -> Found:
    """Metres or millimetres, by the span of a hand's record."""
    spans = [float(np.ptp(v)) for c in columns if len(v := finite_part(c))]
    span = max(spans, default=0.0)
    told = f"the hand's record spans {span:.3g}"
    if span > SPAN_MM:
        return Found("mm", told)
    largest = max(
        (float(np.abs(finite_part(c)).max()) for c in columns if len(finite_part(c))), default=0
    )
    if 0 < span < SPAN_M and largest < 2.0:
        return Found("m", told)
    return Found(None, f"{told}: m, cm and mm are possible")


def angle_unit(columns: Sequence[NDArray[Any]]) -> Found:
    """Degrees where the values go beyond a turn in radians."""
    values = [v for c in columns if len(v := finite_part(c))]
    largest = max((float(np.abs(v).max()) for v in values), default=0.0)
    span = max((float(np.ptp(v)) for v in values), default=0.0)
    told = f"values to {largest:.3g}, spanning {span:.3g}"
    if largest > _TURN:
        return Found("deg", f"{told}: more than a turn in rad")
    return Found(None, f"{told}: rad and deg are possible")


def moves(values: NDArray[Any]) -> bool:
    """Whether a column changes at all."""
    numbers = finite_part(values)
    return len(numbers) > 1 and bool(np.ptp(numbers) > 0)


def trial_numbers(values: NDArray[Any]) -> bool:
    """Whether a column holds whole numbers that change now and then, or texts that do."""
    if values.dtype.kind == "U":
        changes = int((values[1:] != values[:-1]).sum())
        return 0 < changes < len(values) / 5
    numbers = finite_part(values)
    if len(numbers) < 10 or (numbers != np.round(numbers)).any():
        return False
    changes = int((np.diff(numbers) != 0).sum())
    return 0 < changes < len(numbers) / 5


def is_switch(values: NDArray[Any]) -> tuple[float, int] | None:
    """The middle of a column of two levels, and how often it rises; None: it is none."""
    if values.dtype.kind == "U":
        return None
    numbers = finite_part(values)
    levels = np.unique(numbers[:: max(1, len(numbers) // 20_000)]) if len(numbers) else numbers
    if len(levels) != 2:
        return None
    middle = float(levels.mean())
    over = numbers > middle
    return middle, int((over[1:] & ~over[:-1]).sum())


def roughness(values: NDArray[Any]) -> float:
    """How much of a column changes from sample to sample: small for positions, near 1 for noise."""
    numbers = finite_part(values)
    if len(numbers) < 3 or not np.ptp(numbers) > 0:
        return float("nan")
    with np.errstate(over="ignore", invalid="ignore"):
        return float(np.std(np.diff(numbers)) / np.std(numbers))


@dataclass(frozen=True)
class ForceLaw:
    """The force as inertia, viscosity and stiffness of the motion: diagonal elements, per axis.

    Attributes
    ----------
    inertia, stiffness : (d,)
        In the units of the file.
    explained : (d,)
        Share of the force's variance.
    """

    inertia: FloatArray
    stiffness: FloatArray
    explained: FloatArray


def force_law(records: Sequence[tuple[FloatArray, FloatArray]], step_s: float) -> ForceLaw | None:
    """Fit the force's change in each trial as M x'' + B x' + K x; None: too little moves.

    Parameters
    ----------
    records : sequence of (N, d) and (N, d)
        Position and force of each trial.
    step_s : float
    """
    with np.errstate(all="ignore"):
        return _fitted(records[:_MOST_PIECES], step_s)


def _fitted(records: Sequence[tuple[FloatArray, FloatArray]], step_s: float) -> ForceLaw | None:
    moved, pushed = [], []
    for position, force in records:
        x, f = _smooth(position[:_LONGEST]), _smooth(force[:_LONGEST])
        if len(x) > _SHORTEST and np.isfinite(x).all() and np.isfinite(f).all():
            v = np.gradient(x, step_s, axis=0)
            motion = np.hstack([x, v, np.gradient(v, step_s, axis=0)])[5:-5]
            moved.append(motion - motion.mean(axis=0))
            pushed.append(f[5:-5] - f[5:-5].mean(axis=0))
    if not moved:
        return None
    W, y = np.concatenate(moved), np.concatenate(pushed)
    scale = np.abs(W).max(axis=0)
    if not (scale > 0).all() or not (np.ptp(y, axis=0) > 0).all() or not np.isfinite(scale).all():
        return None
    if not np.isfinite(y).all():
        return None
    solution = np.linalg.lstsq(W / scale, y, rcond=None)[0] / scale[:, None]
    d, axes = y.shape[1], np.arange(y.shape[1])
    explained = 1.0 - np.var(y - W @ solution, axis=0) / np.var(y, axis=0)
    return ForceLaw(solution[2 * d + axes, axes], solution[axes, axes], explained)


def _smooth(values: FloatArray) -> FloatArray:
    """A mean over five samples, the same for position and force."""
    if len(values) < _SHORTEST:
        return values[:0]
    sums = np.cumsum(np.vstack([np.zeros((1, values.shape[1])), values]), axis=0)
    return (sums[5:] - sums[:-5]) / 5.0


def force_told(axes: Sequence[str], law: ForceLaw | None) -> tuple[str, ...]:
    """What the fit speaks for, as sentences."""
    if law is None:
        return ("The data say nothing of it: force or position hardly changes.",)
    shown = "; ".join(
        f"{axis}: M {m:+.3g}, K {k:+.3g}, {100 * max(e, 0.0):.0f} % explained"
        for axis, m, k, e in zip(axes, law.inertia, law.stiffness, law.explained, strict=True)
    )
    told = [f"The force as M x'' + B x' + K x has, in units of the file: {shown}."]
    if law.explained.min() < _SAYS_LITTLE or len(set(np.sign(law.inertia))) > 1:
        return (*told, "That does not speak for either.")
    word, other = ("limb", "device") if law.inertia[0] < 0 else ("device", "limb")
    told.append(f'If the device moved the limb, the sign of M speaks for "{word}";')
    return (*told, f'if the person moved the device, for "{other}".')
