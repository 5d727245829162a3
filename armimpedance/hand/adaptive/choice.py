"""Choice of the pushes, by line and condition, that meet the required precision soonest.

Pushes are added in small groups. Each group is placed where it narrows most the interval that is
furthest from its requirement. At the end the pushes that later ones have made unnecessary are
removed. The allowance for departures is included: if a reflex that cannot be excluded widens the
interval, the push that excludes it is chosen.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.hand.adaptive.menu import Menu
from armimpedance.hand.adaptive.so_far import SoFar, loss_of
from armimpedance.hand.adaptive.target import Target
from armimpedance.hand.still import expected_mean_squares

#: Size of a group of pushes, as a share of the trials so far; at least one.
_GROUP: Final = 0.04
#: Exponent of the mean over targets: large, so that the furthest target dominates.
_SHARP: Final = 64.0
#: The column whose size is a reflex.
REFLEX: Final = "reflex 0.055"


@dataclass(frozen=True, eq=False)
class ExperimentSoFar:
    """Conditions, the information of further pushes of each, and the requirements."""

    known: tuple[SoFar, ...]
    menus: tuple[Menu, ...]
    targets: tuple[Target, ...]

    @cached_property
    def seen(self) -> tuple[FloatArray, FloatArray]:
        """Estimated sizes of the departures over all conditions, and standard errors, (c,)."""
        weight = np.stack([state.seen_error**-2 for state in self.known])
        k = (weight * np.stack([state.seen for state in self.known])).sum(axis=0) / weight.sum(
            axis=0
        )
        return k, weight.sum(axis=0) ** -0.5

    def of(self, name: str) -> int:
        """Index of a condition."""
        return [state.name for state in self.known].index(name)


@dataclass(frozen=True)
class Need:
    """Pushes that are still needed.

    `counts`: for each condition, of each line (L,).
    `parts`: for each target, the half-width after them relative to the allowed one.
    `enough`: True if the requirements are met with them.
    """

    counts: tuple[IntArray, ...]
    parts: FloatArray
    enough: bool

    @property
    def trials(self) -> int:
        """Total number of pushes."""
        return int(sum(count.sum() for count in self.counts))


def needed(session: ExperimentSoFar, most: int, scale: Mapping[str, float] | None = None) -> Need:
    """Add pushes until every target is met, or until there are `most`.

    `scale`: for each target, the ratio of the half-width by `estimate` so far to the prediction
    here.
    """
    wider = np.array([(scale or {}).get(target.name, 1.0) for target in session.targets])
    information = [state.knowledge.information for state in session.known]
    trials = [float(state.trials) for state in session.known]
    counts = [np.zeros(len(menu.lines), dtype=int) for menu in session.menus]
    while True:
        parts = wider * _parts(session, information, trials)
        done = sum(int(count.sum()) for count in counts)
        if (parts <= 1).all():
            return _pared(session, Need(tuple(counts), parts, enough=True), wider)
        if done >= most:
            return Need(tuple(counts), parts, enough=False)
        group = min(max(1, round(_GROUP * sum(trials))), most - done)
        which, line = _best(session, information, trials, group, wider)
        information[which] = information[which] + group * session.menus[which].information[line]
        trials[which] += group
        counts[which][line] += group


def _pared(session: ExperimentSoFar, need: Need, wider: FloatArray) -> Need:
    """Remove the pushes that later ones have made unnecessary, as many at a time as possible."""
    counts, parts = [count.copy() for count in need.counts], need.parts
    group = max(1, need.trials // 8)
    while group:
        options = []
        for which, menu in enumerate(session.menus):
            lines = np.flatnonzero(counts[which] >= group)
            if len(lines):
                fewer = _after(session, counts, which, -group * menu.information[lines])
                after = [
                    state.trials + c.sum() for state, c in zip(session.known, counts, strict=True)
                ]
                after[which] -= group
                tried = wider[:, None] * _parts(session, fewer, after)
                line = int(np.argmin(tried.max(axis=0)))
                options.append(
                    (float(tried[:, line].max()), which, int(lines[line]), tried[:, line])
                )
        best = min(options, key=lambda state: state[:3], default=None)
        if best is None or best[0] > 1:
            group //= 2
            continue
        counts[best[1]][best[2]] -= group
        parts = best[3]
    return Need(tuple(counts), parts, enough=True)


def _after(
    session: ExperimentSoFar, counts: Sequence[IntArray], which: int, more: FloatArray
) -> list[FloatArray]:
    """Information of each condition after pushes; one condition's with each of `more` (J, q, q)."""
    totals = []
    for number, (state, menu, count) in enumerate(
        zip(session.known, session.menus, counts, strict=True)
    ):
        total = state.knowledge.information + np.tensordot(count, menu.information, axes=1)
        added = more if number == which else np.zeros((len(more), 1, 1))
        totals.append(total + added)
    return totals


def _best(
    session: ExperimentSoFar,
    information: Sequence[FloatArray],
    trials: Sequence[float],
    group: int,
    wider: FloatArray,
) -> tuple[int, int]:
    """The condition and line whose pushes help most."""
    options = []
    for which, menu in enumerate(session.menus):
        more = information[which] + group * menu.information
        own = [
            np.broadcast_to(of_condition, (len(more), *of_condition.shape))
            for of_condition in information
        ]
        own[which] = more
        after = [t + group * (c == which) for c, t in enumerate(trials)]
        parts = wider[:, None] * _parts(session, own, after)
        badness = (parts**_SHARP).sum(axis=0)
        line = int(np.argmin(badness))
        options.append((float(badness[line]), which, line))
    return min(options)[1:]


def _parts(
    session: ExperimentSoFar, information: Sequence[FloatArray], trials: Sequence[float]
) -> FloatArray:
    """Half-width of each target's interval relative to the allowed one, (targets, ...).

    `information`: of each condition, (..., q, q).
    """
    p = len(session.known[0].parameters)
    covariance = [np.linalg.inv(of_condition[..., :p, :p]) for of_condition in information]
    shifts = [
        of_condition[..., p:, :p] @ C
        for of_condition, C in zip(information, covariance, strict=True)
    ]
    own = [
        of_condition[..., p:, p:] - S @ of_condition[..., :p, p:]
        for of_condition, S in zip(information, shifts, strict=True)
    ]
    squares = expected_mean_squares(own, sum(trials) - len(trials), session.seen)
    loss = loss_of(session.known[0].axes)
    parts = []
    for target in session.targets:
        dof = min(trials[session.of(name)] for name in target.gradients) - 1
        variance: FloatArray = np.zeros(information[0].shape[:-2])
        wrong: FloatArray = np.zeros(squares.shape)
        for name, slope in target.gradients.items():
            which = session.of(name)
            if target.column is not None:
                at = session.known[which].knowledge.names.index(REFLEX)
                variance = variance + 1 / np.maximum(own[which][..., at, at], 1e-300)
                continue
            g = loss * slope
            variance = variance + np.einsum("i,...ij,j->...", g, covariance[which], g)
            wrong = wrong + shifts[which] @ slope
        variance = variance + (squares * wrong**2).sum(axis=-1)
        parts.append(target.factor(dof) * np.sqrt(variance) / target.allowed)
    return np.asarray(parts)


def scaled_to(session: ExperimentSoFar, found: Mapping[str, float]) -> dict[str, float]:
    """Ratio of each target's half-width by `estimate` to the prediction for the same trials.

    `found`: half-widths of targets relative to the allowed ones.
    """
    information = [state.knowledge.information for state in session.known]
    parts = _parts(session, information, [float(state.trials) for state in session.known])
    return {
        target.name: found[target.name] / float(part)
        for target, part in zip(session.targets, parts, strict=True)
        if target.name in found and part > 0
    }
