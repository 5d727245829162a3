"""The inertia at one posture holds two sessions against each other: no muscle can change it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from armimpedance.core.findings import Finding
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.hand.comparison.groups import ComparedGroup
from armimpedance.hand.comparison.pairs import Pair
from armimpedance.numerics.regression import t_factor

#: Groups whose mean places are nearer than this have one posture (m, rad).
SAME_PLACE: Final = 0.02
#: An inertia that differs by more than this part, and by more than chance, is told.
LEAST_CHANGE: Final = 0.03
#: Times the half-width of a 95 % interval that chance exceeds less than once in a hundred times.
UNLIKELY: Final = 1.45


def check_inertia(groups: Sequence[ComparedGroup], pairs: Sequence[Pair]) -> tuple[Finding, ...]:
    """Pairs of one person at one place whose inertia differs by a factor.

    Parameters
    ----------
    groups : sequence of ComparedGroup
    pairs : sequence of Pair

    Returns
    -------
    tuple of Finding
        "inertia", one for each pair that differs, or one for all that do not; empty where no two
        groups have one posture.
    """
    of = {group.name: group.estimate for group in groups}
    told, limits = [], []
    for pair in pairs:
        one, other = of[pair.first], of[pair.second]
        if not _one_posture(one, other):
            continue
        change, error = _factor(one, other)
        # More pairs, more chances: as many standard errors more as of a normal distribution
        many = float(np.sqrt(1 + 2 * np.log(len(pairs)) / (UNLIKELY * t_factor(np.inf)) ** 2))
        limit = max(LEAST_CHANGE, many * UNLIKELY * t_factor(one.dof + other.dof) * error)
        limits.append(limit)
        if abs(change) > limit:
            text = (
                f"{pair.first} | {pair.second}: {100 * change:+.1f} % (sd {100 * error:.1f}) at "
                "one posture, which no muscle can make; a gain, a unit, the sensors' timing or "
                "what is held changed between them, and B and K with it: compare a known load"
            )
            told.append(Finding("inertia", "warning", text, f"{100 * limit:.2g} %"))
    if told or not limits:
        return tuple(told)
    text = "the same in all groups of one posture"
    return (Finding("inertia", "ok", text, f"{100 * max(limits):.2g} %"),)


def _one_posture(one: ImpedanceEstimate, other: ImpedanceEstimate) -> bool:
    if any(one.keys.get(key) != other.keys.get(key) for key in ("subject", "recording")):
        return False
    if one.position is None or other.position is None:
        return False
    return float(np.linalg.norm(one.position - other.position)) < SAME_PLACE


def _factor(one: ImpedanceEstimate, other: ImpedanceEstimate) -> tuple[float, float]:
    """k and its standard error, where M of the second is (1 + k) times that of the first."""
    size = one.k**2
    # with the handle: it is behind the same sensor
    first, second = (np.asarray(each.inertia_with_handle).ravel() for each in (one, other))
    mean = (first + second) / 2
    weight = np.linalg.inv(one.covariance[:size, :size] + other.covariance[:size, :size])
    # M_2 - M_1 (k^2,) = M (k^2,) k, weighted by its covariance
    known = float(mean @ weight @ mean)
    return float(mean @ weight @ (second - first)) / known, known**-0.5
