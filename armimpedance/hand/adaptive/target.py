"""Requirements: numbers whose intervals are to become narrow.

A number is a function of the conditions' M, B and K. Near the estimates it is linear, with a
gradient g_c (p,) with respect to those of each condition, and its variance is
``sum_c g_c^T C_c g_c``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.special import stdtrit

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.conventions import AXES
from armimpedance.core.errors import InputError, check_number
from armimpedance.hand.adaptive.so_far import SoFar
from armimpedance.hand.ellipses import ellipse
from armimpedance.numerics.regression import t_factor

#: Boundary that a Brownian motion from time 0 to 1 exceeds with a probability of 5 %. A difference
#: that is tested arbitrarily often is significant beyond it (O'Brien and Fleming, Biometrics 35,
#: 1979, 549-556, in the limit of many tests).
BOUNDARY: Final = 2.2414
#: Default probability of detecting a difference.
POWER: Final = 0.9


@dataclass(frozen=True)
class Aim:
    """Requirements for an experiment.

    Attributes
    ----------
    k_part : float or None
        Half-width of the 95 % interval of each diagonal element of K, relative to it, in every
        condition.
    orientation_rad : float or None
        Half-width of the interval of the orientation of K's ellipse, in every condition.
    joint_part : float or None
        As `k_part`, for the joints' stiffness.
    reflex_part : float or None
        Half-width of the interval of a response to the displacement 55 ms earlier, relative to K.
    difference_part : float or None
        Relative difference in the size of K's ellipses that is to be detected between two
        conditions.
    between : (first, second) or None
        The two conditions.
    power : float
        Probability of detecting the difference.
    """

    k_part: float | None = None
    orientation_rad: float | None = None
    joint_part: float | None = None
    reflex_part: float | None = None
    difference_part: float | None = None
    between: tuple[str, str] | None = None
    power: float = POWER

    def __post_init__(self) -> None:
        parts = (
            ("K", self.k_part),
            ("the orientation", self.orientation_rad),
            ("the joints' K", self.joint_part),
            ("the reflex", self.reflex_part),
            ("the difference", self.difference_part),
        )
        if all(value is None for _, value in parts):
            raise InputError("nothing is wished", expected="K within some per cent, or another")
        for name, value in parts:
            if value is not None:
                check_number(value, f"{name} within {value:g}", above=0)
        if (self.difference_part is None) != (self.between is None):
            raise InputError("a difference", expected="its size and the two conditions")
        check_number(self.power, f"a power of {self.power:g}", low=0.5, below=1)


@dataclass(frozen=True, eq=False)
class Target(FrozenRecord):
    """One number with a required precision.

    `gradients`: for each condition that it depends on, (p,).
    `allowed`: largest half-width of the interval.
    `power`: None for an interval; else the probability of detecting the difference `allowed`.
    `column`: the size of a departure in its condition instead.
    `scale`: divisor of the half-width for printing, with `unit`.
    """

    name: str
    gradients: Mapping[str, FloatArray]
    allowed: float
    scale: float = 1.0
    unit: str = "%"
    power: float | None = None
    column: str | None = None

    def factor(self, dof: float) -> float:
        """Number of standard errors that must fit into `allowed`."""
        if self.power is None:
            return t_factor(dof)
        wider = BOUNDARY * t_factor(dof) / t_factor(np.inf)
        return wider + float(stdtrit(dof, self.power))

    def is_detected(self, difference: float, sd: float, dof: float) -> bool:
        """True if a difference with this standard error is significant, however often it is tested.

        With the information ``t = sd_end^2 / sd^2`` relative to the plan, ``B(t) = z sqrt(t)`` is a
        Brownian motion if there is no difference.
        """
        sd_end = self.allowed / self.factor(dof)
        t = min((sd_end / sd) ** 2, 1.0)
        limit = BOUNDARY * t_factor(dof) / t_factor(np.inf)
        return bool(abs(difference) / sd * np.sqrt(t) >= limit)


def targets_of(aim: Aim, known: Sequence[SoFar]) -> list[Target]:
    """Numbers that must be precise for an aim, linearised at the estimates so far.

    Raises InputError: orientation, size or joints if they are not known.
    """
    targets = [target for state in known for target in _of_condition(aim, state)]
    if aim.difference_part is not None and aim.between is not None:
        by_name = {state.name: state for state in known}
        if all(name in by_name for name in aim.between):
            targets.append(_difference(aim, *(by_name[name] for name in aim.between)))
    return targets


def log_size(K: FloatArray) -> float:
    """Logarithm of the size of K's ellipse, for differences."""
    return float(np.log(ellipse(K).size))


def _of_condition(aim: Aim, state: SoFar) -> list[Target]:
    targets = []
    d, K = state.axes, state.stiffness
    if aim.k_part is not None:
        for i in range(d):
            name = f"K {AXES[i]}{AXES[i]} of {state.name}"
            unit = np.zeros((d, d))
            unit[i, i] = 1.0
            part = {state.name: _by_K(state, unit)}
            targets.append(Target(name, part, aim.k_part * K[i, i], K[i, i] / 100))
    if aim.orientation_rad is not None:
        _require_plane(state, "orientation")
        part = {state.name: _by_K(state, _of_ellipse(K, 1))}
        name = f"orientation of {state.name}"
        targets.append(Target(name, part, aim.orientation_rad, np.pi / 180, "degrees"))
    if aim.joint_part is not None:
        targets += _of_joints(aim.joint_part, state)
    if aim.reflex_part is not None:
        name = f"reflex of {state.name}"
        targets.append(
            Target(name, {state.name: np.zeros(0)}, aim.reflex_part, 0.01, column="reflex")
        )
    return targets


def _of_joints(part: float, state: SoFar) -> list[Target]:
    """Targets for the diagonal of ``J^T K J``; the force's share counts as known."""
    J = state.jacobian
    if J is None:
        raise InputError(
            f"{state.name}: joint stiffness without the arm's lengths and joint angles",
            expected="a planar arm with both in the recording",
        )
    K = J.T @ state.stiffness @ J
    targets = []
    for i, joint in enumerate(("shoulder", "elbow")):
        slope = np.outer(J[:, i], J[:, i])
        name = f"{joint} K of {state.name}"
        targets.append(
            Target(name, {state.name: _by_K(state, slope)}, part * abs(K[i, i]), abs(K[i, i]) / 100)
        )
    return targets


def _difference(aim: Aim, first: SoFar, second: SoFar) -> Target:
    """Target for the logarithm of the sizes' ratio, which is to be distinguished from zero."""
    slopes = {}
    for sign, state in ((1.0, first), (-1.0, second)):
        _require_plane(state, "size")
        by_size = _of_ellipse(state.stiffness, 0) / ellipse(state.stiffness).size
        slopes[state.name] = sign * _by_K(state, by_size)
    name = f"difference of {first.name} and {second.name}"
    return Target(name, slopes, float(np.log1p(aim.difference_part or 0.0)), 0.01, power=aim.power)


def _require_plane(state: SoFar, what: str) -> None:
    if state.axes != 2:
        raise InputError(f"{what} of a hand in {state.axes} axes", expected="two axes; or K itself")


def _by_K(state: SoFar, slope: FloatArray) -> FloatArray:
    """Gradient with respect to M, B, K (3 d^2,) of a function of K only."""
    rest = np.zeros(2 * state.axes**2)
    return np.concatenate([rest, slope.ravel()])


def _of_ellipse(K: FloatArray, number: int) -> FloatArray:
    """Derivative of the ellipse's size (0) or orientation (1) by the elements of K, (2, 2)."""
    xx, xy, yy = ellipse(K).gradient[number]
    # the ellipse is that of the symmetric part
    return np.array([[xx, xy / 2], [xy / 2, yy]])
