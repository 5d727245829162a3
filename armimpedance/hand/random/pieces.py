"""Comparison of the pieces of a session under random perturbations.

M, B and K of each piece follow from the equations of its lines, with the weights of the whole. A
reflex is left out of them, which changes all pieces alike.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray, IntArray
from armimpedance.core.conventions import AXES
from armimpedance.core.errors import InputError
from armimpedance.core.findings import Finding
from armimpedance.core.records import Recording
from armimpedance.core.trials import trial_slices
from armimpedance.hand.random.commands import Commands
from armimpedance.hand.random.equations import equations_at, noise_weight, residual
from armimpedance.hand.random.lines import (
    Complex,
    Explained,
    Lines,
    explained_by,
    itself,
    lines_in,
)
from armimpedance.numerics.criticism import HAND_WORDS, check_inertia_over, sizes_beside

#: Shortest piece of a trial (s), and largest number of pieces in total.
SHORTEST_S: Final = 10.0
MOST: Final = 12
#: Fewest pieces for a check of a session.
FEWEST: Final = 3
#: Lines of a piece for each unknown of a row.
LINES_EACH: Final = 8


def check_pieces(
    recording: Recording,
    rows: IntArray,
    commands: Commands,
    band_hz: tuple[float, float],
    lag_s: float,
) -> tuple[Finding, ...]:
    """The finding "session" of one group of trials; empty if there are too few pieces.

    `lag_s`: delay of the recorded force relative to the motion.
    """
    names, stretches = _pieces(recording, rows)
    try:
        lines = lines_in(recording, list(enumerate(stretches)), commands.values).within(band_hz)
    except InputError:
        return ()
    lines, d = replace(lines, force=lines.force * np.exp(lines.s * lag_s)), lines.axes
    explained = explained_by(lines) if commands.told else itself(lines)
    long_enough = [n for n in range(len(names)) if (lines.trial == n).sum() >= LINES_EACH * 3 * d]
    if len(long_enough) < FEWEST:
        return ()
    equal: Complex = np.broadcast_to(np.eye(d, dtype=complex), (len(lines.trial), d, d))
    first = _rows(lines, explained, equal)[0]
    weight = noise_weight(lines, residual(lines, np.append(first, 0.0), None))
    whole = _rows(lines, explained, weight)[0].reshape(d, 3, d)
    sizes = {}
    for n in long_enough:
        try:
            sizes[names[n]] = _sizes(*_part(lines, explained, weight, lines.trial == n), whole)
        except np.linalg.LinAlgError:
            # no motion in this piece
            continue
    if not sizes:
        return ()
    # (axes, pieces, 3, 2)
    stacked = np.stack(list(sizes.values()), axis=1)
    axes = ("", *AXES[:d])
    series = {
        axis: (axis_sizes[..., 0], axis_sizes[..., 1])
        for axis, axis_sizes in zip(axes, stacked, strict=True)
    }
    return check_inertia_over(list(sizes), series, HAND_WORDS)


def _pieces(recording: Recording, rows: IntArray) -> tuple[list[str], list[slice]]:
    """Names and samples of the pieces of the trials."""
    slices = [trial_slices(recording.offsets)[row] for row in rows]
    total = sum(piece.stop - piece.start for piece in slices)
    shortest = max(SHORTEST_S * recording.sample_rate_hz, total / MOST)
    names, stretches = [], []
    for row, trial in zip(rows, slices, strict=True):
        size = trial.stop - trial.start
        count = max(int(size / shortest), 1)
        ends = trial.start + np.linspace(0, size, count + 1).astype(np.int64)
        number = recording.trials["trial"].iloc[row]
        for first, last in zip(ends[:-1], ends[1:], strict=True):
            stretches.append(slice(int(first), int(last)))
            start = (first - trial.start) / recording.sample_rate_hz
            names.append(f"trial {number}" + (f" at {start:.0f} s" if count > 1 else ""))
    return names, stretches


def _part(
    lines: Lines, explained: Explained, weight: Complex, of: BoolArray
) -> tuple[FloatArray, FloatArray]:
    """Rows of [M B K] of one piece, and their covariance."""
    selected = replace(
        lines,
        frequency_hz=lines.frequency_hz[of],
        trial=lines.trial[of],
        motion=lines.motion[:, of],
        force=lines.force[of],
        command=lines.command[of],
    )
    explained_part = Explained(explained.motion[of], explained.force[of], explained.coefficients)
    return _rows(selected, explained_part, weight[of])


def _rows(lines: Lines, explained: Explained, weight: Complex) -> tuple[FloatArray, FloatArray]:
    equations = equations_at(lines, explained, weight, None)
    # A (3 d^2, 3 d^2) theta = b, C = A^-1 meat A^-T
    inverse = np.linalg.inv(equations.A[:-1, :-1])
    return inverse @ equations.b[:-1], inverse @ equations.meat[:-1, :-1] @ inverse.T


def _sizes(theta: FloatArray, C: FloatArray, whole: FloatArray) -> FloatArray:
    """M, B and K of a piece relative to the whole's (d, 3, d), with errors, (1 + d, 3, 2).

    For all axes together, then for each. Raises LinAlgError: the piece does not determine them.
    """
    d = len(whole)
    at = np.arange(3 * d * d).reshape(d, 3, d)
    return np.array(
        [
            [
                sizes_beside(theta[own], C[np.ix_(own, own)], whole.ravel()[own])
                for own in (places[:, k].ravel() for k in range(3))
            ]
            for places in (at, *at[:, None])
        ]
    )
