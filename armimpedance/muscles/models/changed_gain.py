"""Test of a changed gain of an EMG channel between conditions, from the rows themselves.

    y_p = X_p theta + w_p D_pi g_i

`D_pi` (r,): what a relative change of muscle i's activation does to the outputs of condition p;
w: 0 before a condition and 1 from it on, or rising from the first to the last, in the rows' order.
g_i > 0 means that the muscle is stiffer than its EMG says: its channel shows less than before.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.special import ndtri

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.findings import Finding

#: Conditions before and after a change that are wanted at least.
FEWEST_BESIDE: Final = 3
#: A change is named where chance makes as much in all that is tried less often than this, and
#: where it is this part at least.
LEVEL: Final = 1e-5
LEAST: Final = 0.1
#: Gains change by this factor at most; what asks for more is no gain.
MOST: Final = 10.0
#: Part of what the conditions would tell with theta known, below which they tell nothing.
LEAST_TOLD: Final = 1e-9
#: This part of a change's statistic stays whichever condition is left out; else one is wrong.
WITHOUT_ONE: Final = 0.6


@dataclass(frozen=True, eq=False)
class WhiteRows:
    """A fit of P conditions of r rows with errors of unit variance.

    `design` (P, r, p), `error` (P, r): regressors, and measured less fitted.
    `covariance` (p, p): of theta, with what a prior says of it.
    `slopes` (P, r, m): D, what a relative change of each muscle's activation does.
    `coefficients` (m, k) int: where in theta the active part of each muscle stands.
    """

    design: FloatArray
    error: FloatArray
    theta: FloatArray
    covariance: FloatArray
    slopes: FloatArray
    coefficients: IntArray

    def without(self, condition: int) -> WhiteRows:
        """The fit of all conditions but one, whose slopes are zero in it."""
        X, e = self.design[condition], self.error[condition]
        # theta moves by -C X^T (1 - X C X^T)^-1 e, C grows by C X^T (1 - X C X^T)^-1 X C
        gain = self.covariance @ X.T @ np.linalg.pinv(np.eye(len(e)) - X @ self.covariance @ X.T)
        kept = np.arange(len(self.error)) != condition
        return replace(
            self,
            design=self.design * kept[:, None, None],
            error=(self.error + self.design @ (gain @ e)) * kept[:, None],
            theta=self.theta - gain @ e,
            covariance=self.covariance + gain @ X @ self.covariance,
            slopes=self.slopes * kept[:, None, None],
        )


@dataclass(frozen=True, eq=False)
class GainChange:
    """The change of gain that explains most.

    `muscle`: its number; None: all channels by the same part.
    `first`: the condition from which on it holds; None: it grows from the first to the last.
    `part`, `error`: of K for the same EMG, by which it changes, and its standard error.
    `z`, `limit`: its statistic, and what chance does not reach.
    `shifts` (2, p): by how much theta is off from that before and from that after the change.
    """

    muscle: int | None
    first: int | None
    part: float
    error: float
    z: float
    limit: float
    shifts: FloatArray

    @property
    def seen(self) -> bool:
        """True if it is beyond chance and large enough to matter."""
        return self.z > self.limit and abs(self.part) > LEAST

    @property
    def spread(self) -> FloatArray:
        """Covariance (p, p) that it adds, for either of the two gains may be the right one."""
        return np.asarray(self.shifts.T @ self.shifts / 2)

    def finding(self, muscles: Sequence[str], labels: Sequence[str]) -> Finding:
        """The finding "session"."""
        least = f"K changes by {100 * max(self.limit * self.error, LEAST):.2g} % for the same EMG"
        if not self.seen:
            text = "stiffness follows the EMG alike from the first condition to the last"
            return Finding("session", "ok", text, least)
        whose = "all muscles" if self.muscle is None else muscles[self.muscle]
        where = "from the first condition to the last"
        if self.first is not None:
            where = f"from {labels[self.first]} on (in the order of the rows)"
        cause = (
            "a gain of the force or of the EMG amplifier, or another person"
            if self.muscle is None
            else "its electrode or its gain"
        )
        text = (
            f"stiffness of {whose} changes by {100 * self.part:+.0f} % (sd "
            f"{100 * self.error:.0f}) for the same EMG {where}: {cause}; fit the conditions apart"
        )
        return Finding("session", "warning", text, least)


def gain_change(rows: WhiteRows) -> GainChange | None:
    """The change that explains most; None where there are too few conditions."""
    tried = list(_tried(rows))
    if not tried:
        return None
    limit = -float(ndtri(LEVEL / 2 / len(tried)))
    changes = [_change(rows, *one, limit) for one in tried]
    best = int(np.argmax([one.z if 1 / MOST < 1 + one.part < MOST else 0.0 for one in changes]))
    if not changes[best].seen:
        return changes[best]
    muscle, first, w = tried[best]
    alone = (_change(one, muscle, first, w, limit) for one in map(rows.without, range(len(w))))
    stable = all(one.z > WITHOUT_ONE * changes[best].z for one in alone)
    return changes[best] if stable else replace(changes[best], z=0.0)


def _tried(rows: WhiteRows) -> Iterator[tuple[int | None, int | None, FloatArray]]:
    """Muscle, first condition and w (P,) of all changes."""
    P, m = rows.slopes.shape[0], rows.slopes.shape[2]
    courses: list[tuple[int | None, FloatArray]] = [
        (first, (np.arange(P) >= first).astype(float))
        for first in range(FEWEST_BESIDE, P - FEWEST_BESIDE + 1)
    ]
    if courses:
        courses.append((None, np.linspace(0.0, 1.0, P)))
    for first, w in courses:
        yield from ((muscle, first, w) for muscle in (*range(m), None))


def _change(
    rows: WhiteRows,
    muscle: int | None,
    first: int | None,
    w: FloatArray,
    limit: float,
) -> GainChange:
    D = rows.slopes.sum(axis=2) if muscle is None else rows.slopes[:, :, muscle]
    changed = w[:, None] * D
    S = np.einsum("pri,pr->i", rows.design, changed)
    # H g = u, theta (p,) free beside it: H = sum w^2 D^T D - S^T C S, u = sum w D^T e
    information = float((changed**2).sum())
    H = information - float(S @ rows.covariance @ S)
    if H / max(information, 1e-300) < LEAST_TOLD:
        return GainChange(muscle, first, 0.0, 1.0, 0.0, limit, np.zeros((2, len(S))))
    g = float((changed * rows.error).sum()) / H
    shift = -rows.covariance @ S * g
    spare = max(rows.error.size - len(S) - 1, 1)
    scale = max(float((rows.error**2).sum()) - g * g * H, 0.0) / spare
    error = float(np.sqrt(max(scale, 1.0) / H))
    at = rows.coefficients if muscle is None else rows.coefficients[[muscle]]
    own, before = rows.theta[at], rows.theta[at] + shift[at]
    # as a part of what the muscle had before the change
    grown = float((own * before).sum() / max(float((before**2).sum()), 1e-300))
    after = np.array(shift)
    after[at] += g * own
    shifts, z = np.stack([shift, after]), abs(g) / error
    return GainChange(muscle, first, g * grown, error * abs(grown), z, limit, shifts)
