"""What is wished: numbers whose intervals are to become narrow.

A number is a function of the conditions' M, B and K; near what was measured it is linear, with a
gradient g_c (p,) by those of each condition, and its variance is ``sum_c g_c^T C_c g_c``.
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

#: A Brownian motion from 0 to time 1 leaves +- this in 5 % of all cases: a difference that is
#: looked at as often as one likes is detected beyond it (O'Brien and Fleming, Biometrics 35, 1979,
#: 549-556, in the limit of many looks).
BOUNDARY: Final = 2.2414
#: A difference of which nothing else was said is to be detected with this probability.
POWER: Final = 0.9


@dataclass(frozen=True)
class Aim:
    """What an experiment is to tell.

    Attributes
    ----------
    k_part : float or None
        The 95 % interval of each diagonal element of K, in every condition, as a part of it.
    orientation_rad : float or None
        Half the interval of the orientation of K's ellipse, in every condition.
    joint_part : float or None
        As `k_part`, of the joints' stiffness.
    reflex_part : float or None
        Half the interval of an answer to what was 55 ms earlier, as a part of K.
    difference_part : float or None
        Two conditions whose ellipses of K differ in size by this part are to be told apart.
    between : (first, second) or None
        The two conditions.
    power : float
        With this probability they are told apart.
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
    """One number that is to be known.

    `gradients`: of each condition that it depends on, (p,).
    `allowed`: half the interval that fulfils the wish.
    `power`: None for an interval; else the difference `allowed` is to be detected so often.
    `column`: a departure's number instead, in its condition.
    `scale`: what half an interval is divided by to be shown, with `unit`.
    """

    name: str
    gradients: Mapping[str, FloatArray]
    allowed: float
    scale: float = 1.0
    unit: str = "%"
    power: float | None = None
    column: str | None = None

    def factor(self, dof: float) -> float:
        """Standard errors that must fit into `allowed`."""
        if self.power is None:
            return t_factor(dof)
        wider = BOUNDARY * t_factor(dof) / t_factor(np.inf)
        return wider + float(stdtrit(dof, self.power))

    def is_detected(self, difference: float, sd: float, dof: float) -> bool:
        """Whether a difference with this standard error is significant, however often it is asked.

        With the information ``t = sd_end^2 / sd^2`` of what is planned, ``B(t) = z sqrt(t)`` is a
        Brownian motion where there is no difference.
        """
        sd_end = self.allowed / self.factor(dof)
        t = min((sd_end / sd) ** 2, 1.0)
        limit = BOUNDARY * t_factor(dof) / t_factor(np.inf)
        return bool(abs(difference) / sd * np.sqrt(t) >= limit)


def targets_of(aim: Aim, known: Sequence[SoFar]) -> list[Target]:
    """The numbers that fulfil an aim, near what was measured.

    Raises InputError: orientation, size or joints where they are not known.
    """
    made = [target for one in known for target in _of_condition(aim, one)]
    if aim.difference_part is not None and aim.between is not None:
        found = {one.name: one for one in known}
        if all(name in found for name in aim.between):
            made.append(_difference(aim, *(found[name] for name in aim.between)))
    return made


def log_size(K: FloatArray) -> float:
    """Logarithm of the size of K's ellipse, which differences compare."""
    return float(np.log(ellipse(K).size))


def _of_condition(aim: Aim, one: SoFar) -> list[Target]:
    made = []
    d, K = one.axes, one.stiffness
    if aim.k_part is not None:
        for i in range(d):
            name = f"K {AXES[i]}{AXES[i]} of {one.name}"
            unit = np.zeros((d, d))
            unit[i, i] = 1.0
            part = {one.name: _by_K(one, unit)}
            made.append(Target(name, part, aim.k_part * K[i, i], K[i, i] / 100))
    if aim.orientation_rad is not None:
        _require_plane(one, "orientation")
        part = {one.name: _by_K(one, _of_ellipse(K, 1))}
        name = f"orientation of {one.name}"
        made.append(Target(name, part, aim.orientation_rad, np.pi / 180, "degrees"))
    if aim.joint_part is not None:
        made += _of_joints(aim.joint_part, one)
    if aim.reflex_part is not None:
        name = f"reflex of {one.name}"
        made.append(Target(name, {one.name: np.zeros(0)}, aim.reflex_part, 0.01, column="reflex"))
    return made


def _of_joints(part: float, one: SoFar) -> list[Target]:
    """The diagonal of ``J^T K J``; the force's share counts as known."""
    J = one.jacobian
    if J is None:
        raise InputError(
            f"{one.name}: joint stiffness without the arm's lengths and joint angles",
            expected="a planar arm with both in the recording",
        )
    K = J.T @ one.stiffness @ J
    made = []
    for i, joint in enumerate(("shoulder", "elbow")):
        slope = np.outer(J[:, i], J[:, i])
        name = f"{joint} K of {one.name}"
        made.append(
            Target(name, {one.name: _by_K(one, slope)}, part * abs(K[i, i]), abs(K[i, i]) / 100)
        )
    return made


def _difference(aim: Aim, first: SoFar, second: SoFar) -> Target:
    """Logarithm of the sizes' ratio, which is to be told from zero."""
    slopes = {}
    for sign, one in ((1.0, first), (-1.0, second)):
        _require_plane(one, "size")
        by_size = _of_ellipse(one.stiffness, 0) / ellipse(one.stiffness).size
        slopes[one.name] = sign * _by_K(one, by_size)
    name = f"difference of {first.name} and {second.name}"
    return Target(name, slopes, float(np.log1p(aim.difference_part or 0.0)), 0.01, power=aim.power)


def _require_plane(one: SoFar, what: str) -> None:
    if one.axes != 2:
        raise InputError(f"{what} of a hand in {one.axes} axes", expected="two axes; or K itself")


def _by_K(one: SoFar, slope: FloatArray) -> FloatArray:
    """Gradient by M, B, K (3 d^2,) of what depends on K only."""
    rest = np.zeros(2 * one.axes**2)
    return np.concatenate([rest, slope.ravel()])


def _of_ellipse(K: FloatArray, number: int) -> FloatArray:
    """Derivative of its ellipse's size (0) or orientation (1) by the elements of K, (2, 2)."""
    xx, xy, yy = ellipse(K).gradient[number]
    # the ellipse is that of the symmetric part
    return np.array([[xx, xy / 2], [xy / 2, yy]])
