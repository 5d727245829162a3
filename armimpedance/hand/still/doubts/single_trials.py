"""Single trials that answer otherwise than the others of their condition.

Trial t answers by ``1 + g_t`` of what M, B and K of the others make of its motion, along all axes
of the force or along one:

    g_t = D^T r_t / D^T A_t D,    r_t = b_t - A_t theta

with theta the condition's, and D the rows of theta that a gain scales. What the trials of a session
scatter by, robustly, is the measure of one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.conventions import AXES
from armimpedance.core.findings import Finding
from armimpedance.core.records import Recording
from armimpedance.hand.still.doubts.courses import Part, rows_of_gain
from armimpedance.hand.still.doubts.model import Model

#: A trial is named from this many of the session's robust standard deviations on, and where it is
#: off by this part at least.
SIGNIFICANT: Final = 7.0
LEAST: Final = 0.25
#: Fewer trials say nothing of how trials scatter.
FEWEST: Final = 16
#: Trials that a message lists.
MOST_LISTED: Final = 6
#: The median of the absolute value of a standard normal number.
_NORMAL_MEDIAN: Final = 0.6745


@dataclass(frozen=True, eq=False)
class TrialGains:
    """g of n trials along all axes and along each, and how many deviations they are off.

    `rows` (n,): of the recording.
    `sizes`, `z` (n, 1 + d).
    """

    rows: IntArray
    sizes: FloatArray
    z: FloatArray

    @property
    def off(self) -> IntArray:
        """Which trials are named, the worst first."""
        worst = np.where(np.abs(self.sizes) > LEAST, np.abs(self.z), 0.0).max(axis=1)
        order = np.argsort(-worst, kind="stable")
        return order[worst[order] > SIGNIFICANT]


def trial_gains(models: Sequence[tuple[IntArray, Model]]) -> TrialGains:
    """How each trial answers beside the others of its condition."""
    rows, sizes, z = [], [], []
    for trials, model in models:
        part, d = Part.of(model, trials), model.equation.axes
        found, scaled = [], []
        for axis in (None, *range(d)):
            D = (part.scaled @ rows_of_gain(d, axis))[:, 0]
            # D^T A_t D, D^T r_t (T,)
            known, left = np.abs(part.A @ D @ D), part.residual @ D
            spread = left / np.sqrt(np.maximum(known, 1e-300))
            robust = float(np.median(np.abs(spread))) / _NORMAL_MEDIAN
            found.append(left / np.maximum(known, 1e-300))
            scaled.append(spread / max(robust, 1e-300))
        rows.append(trials)
        sizes.append(np.stack(found, axis=1))
        z.append(np.stack(scaled, axis=1))
    return TrialGains(np.concatenate(rows), np.concatenate(sizes), np.concatenate(z))


def check_single_trials(
    recording: Recording, models: Sequence[tuple[IntArray, Model]]
) -> tuple[Finding, ...]:
    """The finding "single trials"; empty where there are few trials.

    `models`: each condition's trials, as rows of the recording, and its fit.
    """
    if sum(len(rows) for rows, _ in models) < FEWEST:
        return ()
    gains = trial_gains(models)
    smallest = f"{100 * LEAST:g} % of the answer of one trial, {SIGNIFICANT:g} deviations"
    off = gains.off
    if not len(off):
        text = "each answers as the others of its condition do"
        return (Finding("single trials", "ok", text, smallest),)
    shown = ", ".join(_words(recording, gains, i) for i in off[:MOST_LISTED])
    more = f" and {len(off) - MOST_LISTED} more" if len(off) > MOST_LISTED else ""
    text = (
        f"{shown}{more}, of what M, B and K of the others make: look at them (`trials`), and leave "
        "out what is no answer (`--leave-out`)"
    )
    return (Finding("single trials", "warning", text, smallest),)


def _words(recording: Recording, gains: TrialGains, i: int) -> str:
    """A trial, and how it answers along the axis where it is furthest off."""
    column = int(np.argmax(np.abs(gains.z[i])))
    along = "" if column == 0 else f" along {AXES[column - 1]}"
    row = int(gains.rows[i])
    number = recording.trials["trial"].iloc[row] if "trial" in recording.trials else row + 1
    percent = round(100 * float(1 + gains.sizes[i, column]))
    return f"trial {number} answers by {percent} %{along}"
