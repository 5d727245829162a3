"""What a reader of a robot's calibration must know."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.joint.therapy.robot.holds import SpringHolds, polynomial_of
from armimpedance.joint.therapy.robot.sweeps import CABLE, AxisSweeps
from armimpedance.joint.therapy.robot.therapy_robot import TherapyRobot
from armimpedance.numerics.regression import t_factor

#: Two looks at one thing differ when they do so at this level ...
_LEVEL: Final = 0.99
#: ... and by more than this share of the Coulomb friction.
_SHARE: Final = 0.02


def axis_notes(sweeps: AxisSweeps, robot: TherapyRobot) -> tuple[str, ...]:
    """Notes on the friction and the cables of one axis."""
    fitted, name = sweeps.fit, f"axis {sweeps.axis + 1}"
    notes = list(sweeps.notes)
    coulomb, viscous = fitted.parameters[:2]
    low, high = fitted.interval()[:2].T
    for label, at in (("Coulomb", 0), ("viscous", 1)):
        if high[at] < 0:
            notes.append(f"{name}: negative {label} friction {fitted.parameters[at]:.3g}: drives")
    fastest = max(p.speed_rad_s for p in sweeps.points)
    slope, sd = sweeps.even_slope
    if abs(slope) > t_factor(fitted.dof, _LEVEL) * sd and abs(slope) * fastest > _SHARE * coulomb:
        plus, minus = viscous + slope, viscous - slope
        notes.append(
            f"{name}: friction is not odd in the velocity: {plus:.4g} N m s/rad in positive and "
            f"{minus:.4g} in negative direction, their half difference {slope:.2g} +- {sd:.2g}; "
            "the law is their mean"
        )
    if sweeps.axis != robot.spring_axis:
        k = fitted.names.index(CABLE[1])
        if fitted.interval()[k, 0] <= 0 <= fitted.interval()[k, 1]:
            notes.append(f"{name}: no cable stiffness different from zero: q_c is not identified")
    return tuple(notes)


def rise_notes(axes: Sequence[AxisSweeps]) -> tuple[str, ...]:
    """From which speed each axis was fitted, and its v_s; axes that are alike share a note."""
    alike: dict[str, list[int]] = {}
    for sweeps in axes:
        alike.setdefault(_rise_note(sweeps), []).append(sweeps.axis + 1)
    return tuple(
        f"ax{'is' if len(numbers) == 1 else 'es'} {', '.join(map(str, numbers))}: {text}"
        for text, numbers in alike.items()
    )


def _rise_note(sweeps: AxisSweeps) -> str:
    highest, lowest = np.rad2deg([sweeps.static_range_rad_s, sweeps.lowest_used_rad_s])
    where = f"static range up to {highest:.2g} deg/s" if highest else "no static range seen"
    return (
        f"{where}, fitted from {lowest:.3g} deg/s; v_s is set to "
        f"{np.rad2deg(sweeps.rise_rad_s):.2g} deg/s, by rule and not measured: the "
        "Coulomb friction is complete at the lowest speed used"
    )


def spring_notes(spring: SpringHolds, sweeps: AxisSweeps) -> tuple[str, ...]:
    """Notes on the holds, and on what the sweeps of the same axis say of the spring."""
    notes = list(spring.notes)
    gap, sd = spring_gap(spring, sweeps)
    beyond = np.abs(gap) - t_factor(min(spring.fit.dof, sweeps.fit.dof), _LEVEL) * sd
    worst = int(np.argmax(beyond))
    if beyond[worst] > 0 and abs(gap[worst]) > _SHARE * float(sweeps.fit.parameters[0]):
        notes.append(
            f"axis {sweeps.axis + 1}: the spring differs between holds and sweeps, by "
            f"{gap[worst]:.3g} +- {sd[worst]:.2g} N m at "
            f"{np.rad2deg(spring.angle_rad[worst]):.3g} deg: friction that is not odd, or holds "
            "that stick unevenly"
        )
    return tuple(notes)


def spring_gap(spring: SpringHolds, sweeps: AxisSweeps) -> tuple[FloatArray, FloatArray]:
    """Holds' polynomial less that of the sweeps at the holds' angles (A,), and its sd (A,)."""
    held, of_held = polynomial_of(spring.fit, spring.angle_rad)
    swept, of_swept = polynomial_of(sweeps.spring_fit or sweeps.fit, spring.angle_rad)
    return held - swept, np.sqrt(of_held + of_swept)
