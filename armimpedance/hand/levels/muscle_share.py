"""What is known of single muscles from one joint matrix: sums that it determines, and ranges."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from armimpedance.core.arrays import FloatArray, FrozenRecord


@dataclass(frozen=True)
class Combination(FrozenRecord):
    """A sum ``c k`` over muscles that the joint matrix determines.

    Attributes
    ----------
    name : str
        ``ss``, ``se``, ``ee`` for the elements of ``G^T diag(k) G``, or a muscle's name.
    coefficients : (m,)
        c; m^2 for elements, 1 for a muscle.
    value, sd, low, high : float
        N m/rad (elements) or N/m (a muscle), with 95 % limits; those of viscosity have an s more.
    """

    name: str
    coefficients: Annotated[FloatArray, "m"]
    value: float
    sd: float
    low: float
    high: float


@dataclass(frozen=True)
class FeasibleRange(FrozenRecord):
    """Least and largest value of a sum over muscles among all k >= 0 that give the joint matrix.

    Attributes
    ----------
    name : str
        A muscle, or a group and element such as ``two_joint_ss``.
    coefficients : (m,)
    low, high : float
        At the measured joint matrix (or at the nearest one that the muscles can make); nan where
        there is none.
    outer_low, outer_high : float
        95 % limits: `low` less its error, `high` more its error.
    determined : bool
        Whether the range is a single value for every joint matrix.
    """

    name: str
    coefficients: Annotated[FloatArray, "m"]
    low: float
    high: float
    outer_low: float
    outer_high: float
    determined: bool


@dataclass(frozen=True)
class MuscleShare(FrozenRecord):
    """What one joint matrix says of the muscles.

    Attributes
    ----------
    muscles : (m,) tuple of str
    rank : int
        Independent combinations that are determined.
    combinations : tuple of Combination
        Elements of ``G^T diag(k) G``, then single muscles that are determined.
    single, groups : tuple of FeasibleRange
        The ranges of each muscle, and those of the shoulder's, the elbow's and the two-joint
        muscles' parts in the elements.
    outside_se : float
        How many standard errors the joint matrix lies outside of what muscles with k >= 0 make; 0:
        inside.
    possible : bool
        Whether it is inside, or so near that its error may explain it (at least 95 %). Where it is
        not, no stiffnesses of these muscles with these moment arms make it, and ranges are nan.
    """

    muscles: tuple[str, ...]
    rank: int
    combinations: tuple[Combination, ...]
    single: tuple[FeasibleRange, ...]
    groups: tuple[FeasibleRange, ...]
    outside_se: float
    possible: bool
