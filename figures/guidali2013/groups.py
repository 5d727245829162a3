"""Contributions of all people by movement, group and condition."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance_figures.guidali2013.printed import CONTRIBUTIONS
from armimpedance_figures.guidali2013.study import Measured, TherapyStudy

#: (movement, group) in the order of the source's Fig. 6, and what they are called.
GROUPS: Final = {
    ("elevation", "S"): "elevation, able-bodied",
    ("horizontal", "S"): "horizontal, able-bodied",
    ("elevation", "P"): "elevation, patients",
    ("horizontal", "P"): "horizontal, patients",
}


def groups_of(studied: TherapyStudy) -> list[tuple[str, str]]:
    """Those that somebody is in."""
    there = {person.group for person in studied.people}
    return [key for key in GROUPS if key[1] in there]


def conditions_of(movement: str, group: str) -> list[str]:
    """Those that the source has of this group."""
    return [c for (m, g, c) in CONTRIBUTIONS if (m, g) == (movement, group)]


def measured_of(studied: TherapyStudy, movement: str, group: str, condition: str) -> list[Measured]:
    """All repetitions of all people of the group."""
    people = [person for person in studied.people if person.group == group]
    return [m for person in people for m in person.of(movement, condition)]


def ratios(measured: Sequence[Measured], *, valid: bool = True) -> FloatArray:
    """(4) where it is valid, or where it is flagged."""
    return values(measured, lambda m: m.found.ratio.valid == valid, lambda m: m.found.ratio.percent)


def projections(measured: Sequence[Measured]) -> FloatArray:
    """The projection where it is valid."""
    return values(
        measured, lambda m: m.found.projection.valid, lambda m: m.found.projection.percent
    )


def shares(measured: Sequence[Measured]) -> FloatArray:
    """The share beside the robot's inertia where it is valid."""
    return values(measured, lambda m: m.found.share.valid, lambda m: m.found.share.percent)


def true_ratios(measured: Sequence[Measured]) -> FloatArray:
    """(4) of the simulated torques, of the movements in which ours is valid."""
    return values(measured, lambda m: m.found.ratio.valid, lambda m: m.truth_percent)


def true_projections(measured: Sequence[Measured]) -> FloatArray:
    """The projection of the simulated torques, of the movements in which ours is valid."""
    return values(
        measured, lambda m: m.found.projection.valid, lambda m: m.truth_projection_percent
    )


def true_shares(measured: Sequence[Measured]) -> FloatArray:
    """The share of the simulated torques, of the movements in which ours is valid."""
    return values(measured, lambda m: m.found.share.valid, lambda m: m.truth_share_percent)


def differences(measured: Sequence[Measured]) -> FloatArray:
    """(19) less (4) where both are valid."""
    return values(
        measured,
        lambda m: m.found.ratio.valid and m.found.reference_valid,
        lambda m: m.found.reference.percent - m.found.ratio.percent,
    )


def values(
    measured: Sequence[Measured],
    chosen: Callable[[Measured], bool],
    value: Callable[[Measured], float],
) -> FloatArray:
    """One number each of those that are chosen."""
    return np.array([value(m) for m in measured if chosen(m)])


def lowest(studied: TherapyStudy) -> str:
    """A sentence on the lowest valid (4), and how little it divides by."""
    valid = [(p, m.found) for p in studied.people for m in p.measured if m.found.ratio.valid]
    person, found = min(valid, key=lambda pair: pair[1].ratio.percent)
    return (
        f"The lowest (4), {found.ratio.percent:.0f} %, is one of {person.name}, whose passive arm "
        f"needs {found.mean_arm_Nm:.2g} N m there."
    )


def mean_and_sd(found: FloatArray) -> tuple[float, float]:
    """NaN where there are too few."""
    mean = float(found.mean()) if len(found) else float("nan")
    return mean, float(found.std(ddof=1)) if len(found) > 1 else float("nan")
