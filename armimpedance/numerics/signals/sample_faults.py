"""Lost samples, stray trials, and angles in degrees where radians are expected."""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray, IntArray, lengths
from armimpedance.core.conventions import LARGEST_ANGLE_RAD
from armimpedance.core.errors import InputError
from armimpedance.core.findings import Finding
from armimpedance.core.records import Recording

#: Shortest run of exactly equal values on all axes of a channel (s), and in samples.
HELD_S: Final = 0.005
FEWEST_SAMPLES: Final = 4
#: After lost samples the channel jumps: least size of the jump in steps before and after it, and
#: in steps of the encoder.
JUMP: Final = 3.0
QUANTA: Final = 5.0
#: Samples that are processed together.
TOGETHER: Final = 1 << 18
#: Fewest runs for a warning: a single run may be chance.
FEWEST_RUNS: Final = 2


def check_held(recording: Recording) -> Finding:
    """Check for runs of 5 ms and more in which position or force repeats while the limb moves.

    A coarse encoder also repeats its value when the limb is slow, but then changes by one step and
    is still before and after. After lost samples the value jumps by all of the missed motion.

    Returns: "held".
    """
    length = max(FEWEST_SAMPLES, round(HELD_S * recording.sample_rate_hz))
    shortest = f"{1e3 * length / recording.sample_rate_hz:.3g} ms in {FEWEST_RUNS} places"
    messages = []
    for name in ("position", "force"):
        first, count = _held(getattr(recording, name), recording.offsets, length)
        if len(count) >= FEWEST_RUNS:
            trials = np.searchsorted(recording.offsets, first, side="right")
            messages.append(
                f"{name} stands still {len(count)} times and jumps, for "
                f"{1e3 * np.median(count) / recording.sample_rate_hz:.3g} ms, in "
                f"{len(np.unique(trials))} trials"
            )
    if not messages:
        return Finding("held", "ok", "no channel stands still and jumps", smallest=shortest)
    text = (
        f"{'; '.join(messages)}: lost samples were filled with the last one; leave such trials out"
    )
    return Finding("held", "warning", text, smallest=shortest)


def _held(values: FloatArray, offsets: IntArray, length: int) -> tuple[IntArray, IntArray]:
    """First sample and number of samples of every run of equal values that ends in a jump."""
    steps = _path_lengths(values)
    if not steps.any():
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    # no step leads from one trial to the next
    steps[np.asarray(offsets[1:-1]) - 1] = np.nan
    quantum = steps.min(where=steps > 0, initial=np.inf)
    still = np.concatenate([[False], steps == 0, [False]])
    first = np.flatnonzero(still[1:] & ~still[:-1])
    after = np.flatnonzero(still[:-1] & ~still[1:])
    long = (after - first >= length - 1) & (first > 0) & (after < len(steps) - 1)
    first, after = first[long], after[long]
    # `after` is the jump that ends a run; the steps next to the run are normal
    usual = np.fmax(steps[first - 1], steps[after + 1])
    lost = (steps[after] > JUMP * usual) & (steps[after] > QUANTA * quantum)
    lost &= _moves_around(steps, first, after)
    return first[lost], (after - first)[lost]


def _moves_around(steps: FloatArray, first: IntArray, after: IntArray) -> BoolArray:
    """True if the channel moves in most samples around a still run, over its length on each side.

    A channel that stays within the sensor's last digit is still before and after the run too, and
    the step between is that digit: nothing was lost.
    """
    moves = np.concatenate([[0], np.cumsum(steps > 0)])
    long = after - first
    earlier = moves[first] - moves[np.maximum(first - long, 0)]
    later = moves[np.minimum(after + 1 + long, len(steps))] - moves[after + 1]
    return np.asarray(earlier + later > long)


def _path_lengths(values: FloatArray) -> FloatArray:
    """Distance from sample to sample, (N - 1,).

    Distances over all axes are used: when the encoder of one axis steps, kinematics in single
    precision change the other axes by rounding only.
    """
    ways = np.empty(max(len(values) - 1, 0))
    for first in range(0, len(ways), TOGETHER):
        part = values[first : first + TOGETHER + 1]
        ways[first : first + TOGETHER] = lengths(np.diff(part, axis=0))
    return ways


# Single trials that differ from the others: the hand does not return, or moves for far longer.

#: Fewest trials for a comparison with the others.
FEWEST: int = 5
#: A trial is an outlier above this many times the 90 % quantile of the others.
TIMES: float = 2.0
#: A hand has not returned if its distance at the end is above this share of the peak.
AWAY: float = 0.5


def beyond_the_others(values: FloatArray, reference: FloatArray | None = None) -> BoolArray:
    """True for values above twice the 90 % quantile of the reference.

    Parameters
    ----------
    values : (T,)
    reference : (n,), optional
        Default: the values themselves.

    Returns
    -------
    (T,) array of bool
        All False if the reference has fewer than five values.
    """
    usual = values if reference is None else reference
    if len(usual) < FEWEST:
        return np.zeros(len(values), dtype=bool)
    return np.asarray(values > TIMES * lower_quantile(usual, 0.9))


def lower_quantile(values: FloatArray | IntArray, part: float) -> float:
    """Quantile of the values that is one of them; NaN if one is NaN.

    The same as `numpy.quantile` with the method "lower", but faster.

    `values` (n,).
    `part`: from 0 to 1.
    """
    ordered = np.sort(values)
    # NaN is sorted behind all numbers
    return float(ordered[-1 if np.isnan(ordered[-1]) else int((len(ordered) - 1) * part)])


def gone_astray(cut: FloatArray, onset: int, end: IntArray, usable: BoolArray) -> BoolArray:
    """True for trials (T,) in which the hand moves further than in the others and does not return.

    `cut` (T, S, d): positions around the onset.
    `onset`: sample of the onset.
    `end` (T,) int: sample at which each disturbance is over.
    `usable` (T,) bool: trials that are judged.
    """
    far = np.zeros(cut.shape[:2])
    for axis in range(cut.shape[2]):
        far += np.square(cut[:, :, axis] - cut[:, onset, axis, None])
    peak = np.sqrt(far.max(axis=1))
    remaining = np.sqrt(far[np.arange(len(cut)), np.clip(end, 0, cut.shape[1] - 1)])
    away = (remaining > AWAY * peak) & beyond_the_others(remaining, peak[usable])
    return np.asarray(away & usable)


# Angles in degrees by mistake.


def refuse_degrees(q: FloatArray, joints: tuple[str, ...]) -> None:
    """Refuse angles (N, j) that no joint in radians can have.

    Parameters
    ----------
    q : (N, j)
        Angles.
    joints : tuple of j str
        Names for the message.

    Raises
    ------
    InputError
        An angle is too large; the message names the joint."""
    largest = np.abs(q).max(axis=0)
    for name, angle in zip(joints, largest, strict=True):
        if angle > LARGEST_ANGLE_RAD:
            raise InputError(
                f"angles of {name} up to {angle:.4g} rad",
                expected="radians within a turn of zero; are these degrees?",
            )
