"""Single trials whose response differs from the others of their condition.

Trial t responds by ``1 + g_t`` times the force that M, B and K of the others predict from its
motion, with one number for all axes of the force (k = 1) or one for each (k = d):

    D^T A_t D g_t = D^T r_t,    r_t = b_t - A_t theta

with theta (p,) the condition's, and D (p, k) the rows of theta that gains scale. Each trial is
judged by the robust standard deviation of g over the session's trials.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.conventions import axis_name
from armimpedance.core.findings import Finding
from armimpedance.core.records import Recording
from armimpedance.hand.still.doubts.courses import Part, rows_of_gain
from armimpedance.hand.still.doubts.model import Model

#: A trial is reported if it deviates by this many of the session's robust standard deviations, and
#: by at least this share.
SIGNIFICANT: Final = 7.0
LEAST: Final = 0.25
#: Fewer trials give no measure of their scatter.
FEWEST: Final = 16
#: One axis is reported if its number deviates so many times more than that of all axes.
CLEARLY: Final = 1.3
#: Trials that a message lists.
MOST_LISTED: Final = 6
#: The median of the absolute value of a standard normal number.
_NORMAL_MEDIAN: Final = 0.6745


@dataclass(frozen=True, eq=False)
class TrialGains:
    """g of n trials along all axes and along each, and the same in robust standard deviations.

    `rows` (n,): rows of the trials in the recording.
    `sizes`, `z` (n, 1 + d).
    """

    rows: IntArray
    sizes: FloatArray
    z: FloatArray

    @property
    def off(self) -> IntArray:
        """Indices of the trials that are reported, the worst first."""
        worst = np.where(np.abs(self.sizes) > LEAST, np.abs(self.z), 0.0).max(axis=1)
        order = np.argsort(-worst, kind="stable")
        return order[worst[order] > SIGNIFICANT]


def trial_gains(models: Sequence[tuple[IntArray, Model]]) -> TrialGains:
    """Gain of each trial relative to the others of its condition."""
    sizes, z = [], []
    for trials, model in models:
        part, d = Part.of(model, trials), model.equation.axes
        patterns = [rows_of_gain(d, None)]
        if d > 1:
            patterns.append(np.hstack([rows_of_gain(d, axis) for axis in range(d)]))
        gains = [_gains(part, part.scaled @ pattern) for pattern in patterns]
        sizes.append(np.hstack([g for g, _ in gains]))
        z.append(np.hstack([deviations for _, deviations in gains]))
    rows = np.concatenate([trials for trials, _ in models])
    return TrialGains(rows, np.concatenate(sizes), np.concatenate(z))


def _gains(part: Part, D: FloatArray) -> tuple[FloatArray, FloatArray]:
    """g (T, k) of each trial, and g in robust standard deviations of the trials."""
    # H_t (T, k, k) g_t = D^T r_t; a trial without force along an axis has no information on it
    inverse = np.linalg.pinv(D.T @ part.A @ D)
    g = (inverse @ (part.residual @ D)[..., None])[..., 0]
    spread = g / np.sqrt(np.maximum(np.einsum("tkk->tk", inverse), 1e-300))
    robust = np.median(np.abs(spread), axis=0) / _NORMAL_MEDIAN
    return g, spread / np.maximum(robust, 1e-300)


def check_single_trials(
    recording: Recording, models: Sequence[tuple[IntArray, Model]]
) -> tuple[Finding, ...]:
    """The finding "single trials"; empty if there are few trials.

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
    """A trial and its response, along one axis only if that differs clearly from all axes."""
    z = np.abs(gains.z[i])
    column = int(np.argmax(z)) if z.max() > CLEARLY * z[0] else 0
    along = "" if column == 0 else f" along {axis_name(recording.kind, column - 1)}"
    number = recording.trials["trial"].iloc[int(gains.rows[i])]
    percent = round(100 * float(1 + gains.sizes[i, column]))
    return f"trial {number} answers by {percent} %{along}"
