"""Identify the counterbalance spring from holds: ``c_0 + c_1 q + c_2 q^2`` (12).

A held axis sticks: its motor torque is that of the spring plus any static friction up to the
breakaway torque. If the angle was approached from below, the axis was pushed up against friction;
from above, it was let down. The two errors cancel in the mean, and half their difference is the
friction itself. With one direction only, the friction would be mistaken for a torque of the spring.

Sweeps of the same axis show the spring too, without stiction, and are used as a check. They are not
fitted together with holds: long slow sweeps have most samples in the middle of the range, and since
the spring is not exactly a polynomial, they would distort the fit (.21 N m rms over the simulated
robot's range against .11).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.errors import InputError
from armimpedance.joint.therapy.robot.steady import SteadyPart
from armimpedance.joint.therapy.robot.therapy_robot import SPRING_TERMS, SPRING_UNITS
from armimpedance.numerics.regression import Fit, fit, ragged_factors

#: Holds whose angles differ by less than this count as one angle, rad.
_SAME_ANGLE_RAD: Final = np.deg2rad(2.0)
#: Least number of angles for a polynomial of second order: three, and one to test it.
LEAST_ANGLES: Final = 4


@dataclass(frozen=True)
class SpringHolds(FrozenRecord):
    """The spring of one axis from holds at A angles.

    `fit`: spring_0, spring_1, spring_2, then the stiction: half the difference of both directions.
    `angle_rad` (A,): mean of the holds at each angle.
    `from_below_Nm`, `from_above_Nm` (A,): motor torque less weight, by direction of approach.
    """

    fit: Fit
    angle_rad: Annotated[FloatArray, "A"]
    from_below_Nm: Annotated[FloatArray, "A"]
    from_above_Nm: Annotated[FloatArray, "A"]
    notes: tuple[str, ...] = ()

    @property
    def spring_Nm(self) -> FloatArray:
        """Mean of both directions at each angle, (A,)."""
        return (self.from_below_Nm + self.from_above_Nm) / 2

    @property
    def stiction_Nm(self) -> FloatArray:
        """Half the difference of both directions, (A,): stiction, at most the static friction."""
        return (self.from_below_Nm - self.from_above_Nm) / 2

    def polynomial(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Torque of the spring (F,) at angles (F,), rad, and its standard error (F,), N m."""
        torque, variance = polynomial_of(self.fit, q)
        return torque, np.sqrt(variance)


def polynomial_of(fitted: Fit, q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Polynomial (12) of a fit at angles (F,), and its variance, both (F,)."""
    rows = np.stack([q**k for k in range(len(SPRING_TERMS))], axis=1)
    at = [fitted.names.index(name) for name in SPRING_TERMS]
    # var (F,) = diag(rows (F, 3) C (3, 3) rows^T)
    variance = ((rows @ fitted.covariance[np.ix_(at, at)]) * rows).sum(axis=1)
    return rows @ fitted.parameters[at], variance


def fit_holds(parts: Sequence[SteadyPart]) -> SpringHolds:
    """Fit the spring's polynomial to holds of its axis.

    Raises InputError: fewer than `LEAST_ANGLES` angles that were approached from below and from
    above.
    """
    angles, one_sided = _both_approaches(parts)
    W, Y = [], []
    for holds in angles:
        rows = [[1.0, q := float(p.q.mean()), q**2, float(p.approach)] for p in holds]
        W.append(np.array(rows))
        Y.append(np.array([[float(p.load.mean())] for p in holds]))
    # load (2, 1) = [1, q, q^2, approach] (2, 4) [c_0, c_1, c_2, stiction] (4, 1), for all angles
    factors = ragged_factors(W, Y, regressors=(*SPRING_TERMS, "stiction"), outputs=("load",))
    units = (*SPRING_UNITS, "N m")
    fitted = fit(
        factors, covariance="cr3", parameter_names=factors.regressors, parameter_units=units
    )
    return SpringHolds(
        fit=fitted,
        angle_rad=np.array([w[:, 1].mean() for w in W]),
        from_below_Nm=np.array([y[w[:, 3] > 0].mean() for w, y in zip(W, Y, strict=True)]),
        from_above_Nm=np.array([y[w[:, 3] < 0].mean() for w, y in zip(W, Y, strict=True)]),
        notes=tuple(
            f"the hold at {np.rad2deg(holds[0].q.mean()):.3g} deg was approached from one side "
            "only: not used"
            for holds in one_sided
        ),
    )


def _both_approaches(
    parts: Sequence[SteadyPart],
) -> tuple[list[list[SteadyPart]], list[list[SteadyPart]]]:
    """Group holds by angle, from the lowest; return those with both approaches, and the others."""
    angles: list[list[SteadyPart]] = []
    for part in sorted(parts, key=lambda p: float(p.q.mean())):
        if angles and float(part.q.mean() - angles[-1][0].q.mean()) < _SAME_ANGLE_RAD:
            angles[-1].append(part)
        else:
            angles.append([part])
    both = [a for a in angles if len({p.approach for p in a}) == 2]
    if len(both) < LEAST_ANGLES:
        problem = f"{len(both)} of {len(angles)} angles were held from both directions"
        raise InputError(
            problem if angles else "no holds of the axis with the spring",
            column="approach",
            expected=f"{LEAST_ANGLES} or more angles, each approached from below (1) and from "
            "above (-1): a held axis sticks, and one direction takes the friction for the spring",
        )
    return both, [a for a in angles if a not in both]
