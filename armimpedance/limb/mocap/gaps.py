"""Frames in which the markers that are seen do not say where the body is."""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.motion import MarkerRecording
from armimpedance.limb.mocap.kinematics import MarkerTree
from armimpedance.limb.mocap.posture import iterated_pull, normal_equations

#: What the seen markers move by less than this is bridged, m/rad: at 0.5 mm of noise an angle
#: that rests on less would be worse than a spline across a fifth of a second.
BRIDGE_M: Final = 20e-3

#: How much freedom (in coordinates) the loss of markers may add before a frame counts as short.
_MORE_FREEDOM: Final = 0.1

#: At a trial's ends there is nothing to bridge to: the posture is held for this part of the gap
#: that is allowed inside.
END_SHARE: Final = 0.5


def short_frames(tree: MarkerTree, q: FloatArray, targets: FloatArray) -> BoolArray:
    """Frames (N,) in which lost markers leave more freedom than all markers would."""
    lost = np.flatnonzero(np.isnan(targets[..., 0]).any(axis=1))
    short = np.zeros(len(targets), bool)
    for rows in np.array_split(lost, max(1, len(lost) // 256)):
        if len(rows):
            all_seen = np.zeros_like(targets[rows])
            seen = _freedom(tree, q[rows], targets[rows])
            short[rows] = seen > _freedom(tree, q[rows], all_seen) + _MORE_FREEDOM
    return short


def _freedom(tree: MarkerTree, q: FloatArray, targets: FloatArray) -> FloatArray:
    """How many coordinates (N,) these markers leave free."""
    at = normal_equations(tree, q, targets)
    _, free = iterated_pull(at.JtJ, at.g, np.zeros_like(q), BRIDGE_M)
    return np.asarray(free.sum(axis=1))


def bridge(
    q: FloatArray,
    short: BoolArray,
    markers: MarkerRecording,
    names: tuple[str, ...],
    targets: FloatArray,
    longest_gap_s: float,
) -> FloatArray:
    """Coordinates (N, n) with those of short frames on a spline through their trial's others.

    Inside of a trial a cubic spline; at its ends the nearest posture is held.

    Raises
    ------
    InputError
        A run of short frames is longer than `longest_gap_s`, or than half of it at a trial's ends.
    """
    bridged = q.copy()
    for t in range(markers.n_trials):
        rows = markers.samples_of(t)
        if not short[rows].any():
            continue
        _refuse_long(short[rows], t, markers, names, targets[rows], longest_gap_s)
        bridged[rows] = _across(q[rows], short[rows])
    return bridged


def _across(q: FloatArray, short: BoolArray) -> FloatArray:
    from scipy.interpolate import CubicSpline

    index = np.arange(len(q))
    good = np.flatnonzero(~short)
    inside = np.clip(index[short], good[0], good[-1])
    filled = q.copy()
    if len(good) < 4:
        for k in range(q.shape[1]):
            filled[short, k] = np.interp(inside, good, q[good, k])
    else:
        filled[short] = CubicSpline(good, q[good])(inside)
    return filled


def _refuse_long(
    short: BoolArray,
    trial: int,
    markers: MarkerRecording,
    names: tuple[str, ...],
    targets: FloatArray,
    longest_gap_s: float,
) -> None:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], short, [False]]).astype(np.int8)))
    for start, end in edges.reshape(-1, 2):
        at_end = start == 0 or end == len(short)
        allowed = longest_gap_s * (END_SHARE if at_end else 1.0)
        length = (end - start) / markers.sample_rate_hz
        if length <= allowed * (1.0 + 1e-9) and end - start < len(short):
            continue
        lost = np.isnan(targets[start:end, :, 0]).mean(axis=0)
        missing = [names[m] for m in np.argsort(-lost, kind="stable") if lost[m] > 0.5][:3]
        time = markers.time_s[markers.samples_of(trial)]
        where = " at the trial's end" if at_end else ""
        raise InputError(
            f"trial {markers.trials['trial'].iloc[trial]}: {', '.join(missing) or 'markers'} lost "
            f"from {time[start]:.3f} to {time[end - 1]:.3f} s ({length:.3f} s{where}), and the "
            "others do not determine the posture",
            expected=f"at most {allowed:g} s",
        )
