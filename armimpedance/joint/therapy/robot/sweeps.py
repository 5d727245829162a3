"""Friction and cables of one axis from sweeps at constant velocity, above the static range.

``motor - rigid = sign(v) tau_c (1 - exp(-|v| / v_s)) + k_v v + (function of the angle)``. The
cables' ``k_c (q - q_c)`` and the counterbalance spring depend only on the angle. Friction changes
its sign with the direction, so both directions are needed. A Coulomb friction that is larger in one
direction than in the other cannot be distinguished from the cables' offset; on the axis of the
spring the holds decide.

At low speeds friction is larger than this law: static friction and its remainder (Stribeck). The
static range is determined from the data: the law is fitted to the two highest speeds and extended
to lower ones, speed by speed, as long as the friction at the next speed agrees with it.
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

#: Speeds that differ by less than this factor count as one speed.
_SAME_SPEED: Final = 1.1
#: Friction at a speed agrees with the law within this many standard errors; once there are enough
#: speeds, a smaller excess, typical of static friction, ends the search.
_ERRORS: Final = 3.3
_EXCESS_ERRORS: Final = 2.0
#: It also agrees within this share of the Coulomb friction, whose effect on tau_c is smaller.
_NEGLIGIBLE: Final = 0.003
#: Least number of speeds above the static range: two for the law, one to test it.
LEAST_SPEEDS: Final = 3
#: Share of the Coulomb torque that is missing at the lowest used speed.
_MISSING_AT_LOWEST: Final = 1e-6
#: Order of the polynomial of the angle on the axis of the spring.
_SPRING_ORDER: Final = 4

FRICTION: Final = ("coulomb", "viscous")
FRICTION_UNITS: Final = ("N m", "N m s/rad")
CABLE: Final = ("cable_offset", "cable_stiffness")


@dataclass(frozen=True)
class SpeedPoint:
    """Result of the sweeps at one speed.

    `up_Nm`, `down_Nm`: mean torque in positive and in negative direction, less the function of the
    angle.
    `used`: True if the speed lies above the static range.
    """

    speed_rad_s: float
    up_Nm: float
    down_Nm: float
    used: bool

    @property
    def friction_Nm(self) -> float:
        """Half the difference of both directions, the part that is odd in the velocity, N m."""
        return (self.up_Nm - self.down_Nm) / 2

    @property
    def even_Nm(self) -> float:
        """Half the sum of both directions, N m; 0 for a friction that is odd."""
        return (self.up_Nm + self.down_Nm) / 2


@dataclass(frozen=True)
class AxisSweeps(FrozenRecord):
    """Friction and cables of one axis.

    Attributes
    ----------
    axis : int
        Counted from 0.
    fit : Fit
        coulomb, viscous, then cable_offset and cable_stiffness, or, with a spring, a polynomial of
        the angle of sufficient order.
    spring_fit : Fit or None
        With a spring: coulomb, viscous and the spring's polynomial (12).
    rise_rad_s : float
        v_s, see `rise_speed`.
    lowest_used_rad_s : float
    static_range_rad_s : float
        Highest speed that does not follow the law; 0 if all do.
    points : tuple of SpeedPoint
        From the lowest speed to the highest.
    even_slope : (2,)
        Coefficient of an additional ``|v|``, N m s/rad, and its standard error; 0 for a friction
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
        """Fields of the axis in ROBOT.json; speeds in degrees per second."""
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
        """Fitted friction law (10), odd, at velocities of any shape, N m."""
        coulomb, viscous = self.fit.parameters[:2]
        return np.asarray(coulomb * friction_sign(velocity, self.rise_rad_s) + viscous * velocity)


def rise_speed(lowest_used_rad_s: float) -> float:
    """Speed v_s for which the law lacks one part in a million at the lowest speed used: 1/14 of it.

    Table 3 of the source has no v_s, and it cannot be measured below the static range. With this
    value the law is complete wherever it was fitted, so v_s does not affect tau_c. With a smaller
    value noise of the velocity at rest would get a sign. On the simulated robot's movements (16) is
    flat within 2 % from .2 to .5 deg/s, the result of this rule, and 25 % worse at .003 deg/s.
    """
    return lowest_used_rad_s / -float(np.log(_MISSING_AT_LOWEST))


def fit_axis(parts: Sequence[SteadyPart], *, spring: bool) -> AxisSweeps:
    """Fit friction and cables of one axis.

    `parts`: sweeps of one axis.
    `spring`: True if the counterbalance spring acts on it (then there are no cables).
    Raises InputError: one direction only, or fewer than `LEAST_SPEEDS` speeds above the static
    range.
    Raises NotIdentifiableError: the sweeps do not separate the terms.
    """
    axis = parts[0].axis
    speeds, one_sided = _both_directions(parts)
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
        for s in one_sided
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
    """Group sweeps by speed, from the slowest; return those with both directions, and the
    others."""
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
    """Return True if the friction at a lower speed lies on the law of the higher ones."""
    parts = [*slower, *(p for s in faster for p in s)]
    # with a term |v|, so that a friction that is not odd does not hide the excess in the scatter
    fitted = _fit(parts, rise_speed(_speed(slower)), order, even=True, excess_of=slower)
    # few sweeps may agree by chance: their spread is at least that of white noise
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
    """Fit law and polynomial of the angle, and on request |v| and an excess at some speed."""
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
    by_direction: dict[int, list[float]] = {1: [], -1: []}
    for part in parts:
        still = np.stack(_angle_columns(part.q, order), axis=1) @ angle
        by_direction[part.approach].append(float((part.load - still).mean()))
    return SpeedPoint(
        _speed(parts), float(np.mean(by_direction[1])), float(np.mean(by_direction[-1])), used
    )
