"""Friction and cables of one axis from sweeps at constant velocity, above the static range.

``motor - rigid = sign(v) tau_c (1 - exp(-|v| / v_s)) + k_v v + (what depends on the angle)``. The
cables' ``k_c (q - q_c)`` depend on the angle alone, and so does the counterbalance spring: friction
is what changes its sign with the direction, so that both directions must be there. A Coulomb
friction that is larger one way than the other cannot be told from the cables' offset; on the axis
of the spring the holds tell.

At low speeds friction is larger than this law: static friction and what is left of it (Stribeck).
The static range is found from the data: the law is fitted to the two highest speeds and taken
down, speed by speed, for as long as the friction at the next one agrees with it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import degrees
from typing import Annotated, Any, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.errors import InputError
from armimpedance.joint.therapy.robot.steady import SteadyPart, at_least_white, white_sd
from armimpedance.joint.therapy.robot.therapy_robot import SPRING_TERMS, friction_sign
from armimpedance.numerics.regression import Fit, fit, ragged_factors

#: Speeds that differ by less than this factor count as one.
_SAME_SPEED: Final = 1.1
#: Friction at a speed agrees with the law within this many standard errors; once there are enough
#: speeds, an excess that looks like static friction need not be as clear to end the search.
_ERRORS: Final = 3.3
_EXCESS_ERRORS: Final = 2.0
#: It agrees also within this share of the Coulomb friction, which moves tau_c by less.
_NEGLIGIBLE: Final = 0.003
#: Speeds above the static range that a fit needs: two for the law, one to see that it holds.
LEAST_SPEEDS: Final = 3
#: The Coulomb torque has built up to all but this share at the lowest speed that is used.
_MISSING_AT_LOWEST: Final = 1e-6
#: Order of the polynomial that takes up what depends on the angle where there is a spring.
_SPRING_ORDER: Final = 4

FRICTION: Final = ("coulomb", "viscous")
FRICTION_UNITS: Final = ("N m", "N m s/rad")
CABLE: Final = ("cable_offset", "cable_stiffness")


@dataclass(frozen=True)
class SpeedPoint:
    """What the sweeps of one speed say.

    `up_Nm`, `down_Nm`: mean torque in positive and in negative direction, less what depends on the
    angle.
    `used`: whether the speed lies above the static range.
    """

    speed_rad_s: float
    up_Nm: float
    down_Nm: float
    used: bool

    @property
    def friction_Nm(self) -> float:
        """Half the difference of both directions: what is odd in the velocity."""
        return (self.up_Nm - self.down_Nm) / 2

    @property
    def even_Nm(self) -> float:
        """Half their sum: 0 for a friction that is odd."""
        return (self.up_Nm + self.down_Nm) / 2


@dataclass(frozen=True)
class AxisSweeps(FrozenRecord):
    """Friction and cables of one axis.

    Attributes
    ----------
    axis : int
        Counted from 0.
    fit : Fit
        coulomb, viscous, then cable_offset and cable_stiffness, or, where there is a spring, a
        polynomial of the angle that is long enough to follow it.
    spring_fit : Fit or None
        Where there is a spring: coulomb, viscous and its own polynomial (12).
    rise_rad_s : float
        v_s, see `rise_speed`.
    lowest_used_rad_s : float
    static_range_rad_s : float
        Highest speed that does not follow the law; 0 where all do.
    points : tuple of SpeedPoint
        From the lowest speed to the highest.
    even_slope : (2,)
        Coefficient of ``|v|`` beside the law, N m s/rad, and its standard error: 0 for a friction
        that is odd.
    notes : tuple of str
    """

    axis: int
    fit: Fit
    spring_fit: Fit | None
    rise_rad_s: float
    lowest_used_rad_s: float
    static_range_rad_s: float
    points: tuple[SpeedPoint, ...]
    even_slope: Annotated[FloatArray, "2"]
    notes: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """What ROBOT.json says of the axis: speeds in degrees per second."""
        return {
            "joint": self.axis + 1,
            "lowest_used_deg_s": degrees(self.lowest_used_rad_s),
            "static_range_deg_s": degrees(self.static_range_rad_s),
            "rise_deg_s": degrees(self.rise_rad_s),
            "points": [
                {
                    "speed_deg_s": degrees(p.speed_rad_s),
                    "up_Nm": p.up_Nm,
                    "down_Nm": p.down_Nm,
                    "used": p.used,
                }
                for p in self.points
            ],
        }

    def friction(self, velocity: FloatArray) -> FloatArray:
        """The fitted law (10), odd, at velocities of any shape, N m."""
        coulomb, viscous = self.fit.parameters[:2]
        return np.asarray(coulomb * friction_sign(velocity, self.rise_rad_s) + viscous * velocity)


def rise_speed(lowest_used_rad_s: float) -> float:
    """v_s of a law that lacks one part in a million at the lowest speed used: some 1/14 of it.

    Table 3 of the source has none, and none can be measured below the static range. With this one
    the law is complete wherever it was fitted, so that v_s does not move tau_c; a smaller one would
    give noise of the velocity at rest a sign. On the simulated robot's movements (16) is flat
    within 2 % from .2 to .5 deg/s, where this rule puts it, and 25 % worse at .003 deg/s.
    """
    return lowest_used_rad_s / -float(np.log(_MISSING_AT_LOWEST))


def fit_axis(parts: Sequence[SteadyPart], *, spring: bool) -> AxisSweeps:
    """Friction and cables of one axis.

    `parts`: all of one axis.
    `spring`: whether the counterbalance spring acts on it (no cables then).
    Raises InputError: one direction only, or fewer than `LEAST_SPEEDS` speeds above the static
    range.
    Raises NotIdentifiableError: the sweeps do not tell the terms apart.
    """
    axis = parts[0].axis
    speeds, alone = _both_directions(parts)
    order = _SPRING_ORDER if spring else 1
    used = _above_static_range(speeds, order)
    slow = [s for s in speeds if s not in used]
    lowest = min(_speed(s) for s in used)
    rise = rise_speed(lowest)
    chosen = [p for s in used for p in s]
    fitted = at_least_white(_fit(chosen, rise, order))
    polynomial = at_least_white(_fit(chosen, rise, 2)) if spring else None
    even = _fit(chosen, rise, order, even=True)
    notes = [
        f"axis {axis + 1}: no sweep in the other direction at "
        f"{np.rad2deg(_speed(s)):.3g} deg/s: not used"
        for s in alone
    ]
    return AxisSweeps(
        axis=axis,
        fit=fitted,
        spring_fit=polynomial,
        rise_rad_s=rise,
        lowest_used_rad_s=lowest,
        static_range_rad_s=max((_speed(s) for s in slow), default=0.0),
        points=tuple(_point(s, fitted, order, s in used) for s in speeds),
        even_slope=np.array([even.parameters[-1], even.sd[-1]]),
        notes=(*notes, *fitted.warnings),
    )


def _both_directions(
    parts: Sequence[SteadyPart],
) -> tuple[list[list[SteadyPart]], list[list[SteadyPart]]]:
    """Sweeps of one speed each, from the slowest, and those that lack a direction."""
    speeds: list[list[SteadyPart]] = []
    for part in sorted(parts, key=lambda p: p.speed):
        if speeds and part.speed < _SAME_SPEED * speeds[-1][0].speed:
            speeds[-1].append(part)
        else:
            speeds.append([part])
    both = [s for s in speeds if len({p.approach for p in s}) == 2]
    if not both:
        raise InputError(
            f"axis {parts[0].axis + 1}: sweeps in one direction only",
            expected="both at every speed: friction is what turns round with the direction",
        )
    return both, [s for s in speeds if s not in both]


def _speed(parts: Sequence[SteadyPart]) -> float:
    return float(np.mean([p.speed for p in parts]))


def _above_static_range(speeds: list[list[SteadyPart]], order: int) -> list[list[SteadyPart]]:
    """The highest speeds, down to the lowest at which the law still holds."""
    first = max(len(speeds) - 2, 0)
    while first > 0 and _agrees(speeds[first - 1], speeds[first:], order):
        first -= 1
    used = speeds[first:]
    if len(used) < LEAST_SPEEDS:
        axis, highest = speeds[0][0].axis + 1, np.rad2deg(_speed(speeds[-1]))
        raise InputError(
            f"axis {axis}: {len(speeds)} speeds up to {highest:.3g} deg/s, too few of which "
            "follow the law of Coulomb and viscous friction",
            expected=f"sweeps at {LEAST_SPEEDS} or more speeds above the static range",
        )
    return used


def _agrees(slower: list[SteadyPart], faster: Sequence[Sequence[SteadyPart]], order: int) -> bool:
    """Whether the friction at a lower speed lies on the law of the higher ones."""
    parts = [*slower, *(p for s in faster for p in s)]
    # with |v| beside it, so that a friction that is not odd does not hide the excess in its scatter
    fitted = _fit(parts, rise_speed(_speed(slower)), order, even=True, excess_of=slower)
    # few sweeps may agree by chance: their spread is not taken for less than white noise makes it
    sd = max(float(fitted.sd[-1]), float(white_sd(fitted)[-1]))
    coulomb, excess = abs(float(fitted.parameters[0])), float(fitted.parameters[-1])
    enough = len(faster) >= LEAST_SPEEDS
    above = max((_EXCESS_ERRORS if enough else _ERRORS) * sd, _NEGLIGIBLE * coulomb)
    return -max(_ERRORS * sd, _NEGLIGIBLE * coulomb) <= excess <= above


def _fit(
    parts: Sequence[SteadyPart],
    rise: float,
    order: int,
    *,
    excess_of: Sequence[SteadyPart] = (),
    even: bool = False,
) -> Fit:
    """Law and polynomial of the angle; then, where asked for, |v| and an excess at some speed."""
    names = [*FRICTION, *_angle_terms(order)]
    units = [
        *FRICTION_UNITS,
        "N m",
        *(f"N m/rad^{k}" if k > 1 else "N m/rad" for k in _powers(order)),
    ]
    W = []
    for part in parts:
        sign = friction_sign(part.qd, rise)
        columns = [sign, part.qd, *_angle_columns(part.q, order)]
        if even:
            columns.append(np.abs(part.qd))
        if excess_of:
            columns.append(sign if part in excess_of else np.zeros_like(sign))
        W.append(np.stack(columns, axis=1))
    names += [*(["even"] if even else []), *(["excess"] if excess_of else [])]
    units += [*(["N m s/rad"] if even else []), *(["N m"] if excess_of else [])]
    # load (S, 1) = [sign(v), v, 1, q, ...] (S, p) [tau_c, k_v, c_0, c_1, ...] (p, 1), all sweeps
    factors = ragged_factors(
        W, [p.load[:, None] for p in parts], regressors=names, outputs=("load",)
    )
    return fit(factors, covariance="cr3", parameter_names=names, parameter_units=units)


def _angle_terms(order: int) -> tuple[str, ...]:
    return {1: CABLE, 2: SPRING_TERMS}.get(order, tuple(f"angle_{k}" for k in range(order + 1)))


def _powers(order: int) -> range:
    return range(1, order + 1)


def _angle_columns(q: FloatArray, order: int) -> list[FloatArray]:
    return [q**k for k in range(order + 1)]


def _point(parts: Sequence[SteadyPart], fitted: Fit, order: int, used: bool) -> SpeedPoint:
    angle = fitted.parameters[2:]
    left: dict[int, list[float]] = {1: [], -1: []}
    for part in parts:
        still = np.stack(_angle_columns(part.q, order), axis=1) @ angle
        left[part.approach].append(float((part.load - still).mean()))
    return SpeedPoint(_speed(parts), float(np.mean(left[1])), float(np.mean(left[-1])), used)
