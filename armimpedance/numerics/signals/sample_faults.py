"""Lost samples, stray trials, and angles in degrees where radians are expected."""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray, IntArray, lengths
from armimpedance.core.conventions import LARGEST_ANGLE_RAD
from armimpedance.core.errors import InputError
from armimpedance.core.findings import Finding
from armimpedance.core.records import Recording

#: All axes of a channel exactly as they were for this long (s), and this many samples.
HELD_S: Final = 0.005
FEWEST_SAMPLES: Final = 4
#: What went on meanwhile shows as a jump: of so many steps before and after, and of the encoder.
JUMP: Final = 3.0
QUANTA: Final = 5.0
#: Samples that are looked at together.
TOGETHER: Final = 1 << 18
#: One run may be chance.
FEWEST_RUNS: Final = 2


def check_held(recording: Recording) -> Finding:
    """Runs of 5 ms and more in which position or force is held while the limb moves on.

    A coarse encoder repeats its value too where the limb is slow, but goes on by one of its steps,
    and stands still around it; samples that were held go on with all of the way that was missed.

    Returns: "held".
    """
    length = max(FEWEST_SAMPLES, round(HELD_S * recording.sample_rate_hz))
    shortest = f"{1e3 * length / recording.sample_rate_hz:.3g} ms in {FEWEST_RUNS} places"
    told = []
    for name in ("position", "force"):
        first, count = _held(getattr(recording, name), recording.offsets, length)
        if len(count) >= FEWEST_RUNS:
            trials = np.searchsorted(recording.offsets, first, side="right")
            told.append(
                f"{name} stands still {len(count)} times and jumps, for "
                f"{1e3 * np.median(count) / recording.sample_rate_hz:.3g} ms, in "
                f"{len(np.unique(trials))} trials"
            )
    if not told:
        return Finding("held", "ok", "no channel stands still and jumps", smallest=shortest)
    text = f"{'; '.join(told)}: lost samples were filled with the last one; leave such trials out"
    return Finding("held", "warning", text, smallest=shortest)


def _held(values: FloatArray, offsets: IntArray, length: int) -> tuple[IntArray, IntArray]:
    """First sample and number of samples of every run that is held and ends in a jump."""
    steps = _ways(values)
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
    # `after` is the jump that ends a run, its neighbours are usual ones
    usual = np.fmax(steps[first - 1], steps[after + 1])
    told = (steps[after] > JUMP * usual) & (steps[after] > QUANTA * quantum)
    told &= _moves_around(steps, first, after)
    return first[told], (after - first)[told]


def _moves_around(steps: FloatArray, first: IntArray, after: IntArray) -> BoolArray:
    """Whether the channel moves in most samples around each still run, for as long as it is.

    Where it stays within the sensor's last digit for many samples it stands still before and after
    as well, and the step between is that digit: nothing was lost.
    """
    moved = np.concatenate([[0], np.cumsum(steps > 0)])
    long = after - first
    before = moved[first] - moved[np.maximum(first - long, 0)]
    behind = moved[np.minimum(after + 1 + long, len(steps))] - moved[after + 1]
    return np.asarray(before + behind > long)


def _ways(values: FloatArray) -> FloatArray:
    """The way from sample to sample, (N - 1,).

    Where an encoder of one axis steps, kinematics in single precision move the others by their
    rounding, which is no step of theirs.
    """
    ways = np.empty(max(len(values) - 1, 0))
    for first in range(0, len(ways), TOGETHER):
        piece = values[first : first + TOGETHER + 1]
        ways[first : first + TOGETHER] = lengths(np.diff(piece, axis=0))
    return ways


# Single trials that are not like the others: the hand goes away, or moves for far longer.

#: With fewer trials nobody can say which one is unlike the others.
FEWEST: int = 5
#: A trial is unlike the others beyond this many times what nine in ten of them reach.
TIMES: float = 2.0
#: A hand that is still this part of its way off at the end has not returned.
AWAY: float = 0.5


def beyond_the_others(values: FloatArray, reference: FloatArray | None = None) -> BoolArray:
    """Values beyond twice what nine in ten of the reference reach.

    Parameters
    ----------
    values : (T,)
    reference : (n,), optional
        Default: the values themselves.

    Returns
    -------
    (T,) array of bool
        All False where the reference has fewer than five values.
    """
    known = values if reference is None else reference
    if len(known) < FEWEST:
        return np.zeros(len(values), dtype=bool)
    return np.asarray(values > TIMES * lower_quantile(known, 0.9))


def lower_quantile(values: FloatArray | IntArray, part: float) -> float:
    """The value that this part of the values lies at or below, always one of them; NaN beside NaN.

    `numpy.quantile` with the method "lower", which takes longer for its many other ones.

    `values` (n,).
    `part`: from 0 to 1.
    """
    ordered = np.sort(values)
    # NaN is sorted behind all numbers
    return float(ordered[-1 if np.isnan(ordered[-1]) else int((len(ordered) - 1) * part)])


def gone_astray(cut: FloatArray, onset: int, end: IntArray, usable: BoolArray) -> BoolArray:
    """Trials (T,) in which the hand goes further than in the others and does not come back.

    `cut` (T, S, d): positions around the onset.
    `onset`: sample of the onset.
    `end` (T,) int: sample at which each disturbance is over.
    `usable` (T,) bool: trials that are judged.
    """
    far = np.zeros(cut.shape[:2])
    for axis in range(cut.shape[2]):
        far += np.square(cut[:, :, axis] - cut[:, onset, axis, None])
    peak = np.sqrt(far.max(axis=1))
    left = np.sqrt(far[np.arange(len(cut)), np.clip(end, 0, cut.shape[1] - 1)])
    away = (left > AWAY * peak) & beyond_the_others(left, peak[usable])
    return np.asarray(away & usable)


# Angles in radians, or perhaps in degrees by mistake.


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
        Names the joint.
    """
    largest = np.abs(q).max(axis=0)
    for name, angle in zip(joints, largest, strict=True):
        if angle > LARGEST_ANGLE_RAD:
            raise InputError(
                f"angles of {name} up to {angle:.4g} rad",
                expected="radians within a turn of zero; are these degrees?",
            )
