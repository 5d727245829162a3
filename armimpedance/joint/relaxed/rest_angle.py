"""Where the data put the rest angle, where somebody stated another one."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import ArmImpedanceError
from armimpedance.joint.relaxed.equations import Equations
from armimpedance.joint.relaxed.linear import solve_linear
from armimpedance.joint.relaxed.terms import UNITS, Terms

#: Of the interval that must exclude the stated angle.
_LEVEL: Final = 0.99
#: How far outside of it the stated angle must lie, rad: that moves k by some 4 %.
_CLEARLY_RAD: Final = 0.05
#: A stiffness of fewer robust standard errors puts the rest angle nowhere.
_LEAST_STIFFNESS: Final = 5.0


@dataclass(frozen=True)
class FreeRestAngle:
    """The rest angle that the motion shows, and its 99 % interval, rad."""

    value: float
    low: float
    high: float

    def contradicts(self, stated: float) -> bool:
        """Whether an angle lies clearly outside of the interval."""
        return not self.low - _CLEARLY_RAD <= stated <= self.high + _CLEARLY_RAD


def free_rest_angle(
    equations: Equations, terms: Terms, sample_rate_hz: float
) -> FreeRestAngle | None:
    """Fit the rest angle too, to the equations of one that is stated.

    Parameters
    ----------
    equations : Equations
        Equations of a single joint, by these terms.
    terms : Terms
        Terms of the model, with a stated rest angle.
    sample_rate_hz : float

    Returns
    -------
    FreeRestAngle or None
        None where the motion does not show it.
    """
    try:
        fits = solve_linear(_with_offset(equations), sample_rate_hz)
        fitted = replace(terms, rest_angle="free").parameters(fits.robust)
    except ArmImpedanceError:
        return None
    k, rest = fitted.names.index("k"), fitted.names.index("q_r")
    shown = abs(fitted.values[k]) > _LEAST_STIFFNESS * fitted.sd[k]
    low, high = fitted.interval(_LEVEL)[rest] + terms.reference
    if not (shown and np.isfinite([low, high]).all()):
        return None
    return FreeRestAngle(float(fitted.values[rest]) + terms.reference, float(low), float(high))


def rest_angle_note(equations: Equations, terms: Terms, sample_rate_hz: float) -> str | None:
    """A sentence where the data contradict the stated rest angle, else None."""
    if terms.free:
        return None
    fitted = free_rest_angle(equations, terms, sample_rate_hz)
    if fitted is None or not fitted.contradicts(terms.reference):
        return None
    return (
        f"the data put the rest angle at {fitted.value:.3f} ({fitted.low:.3f} to "
        f"{fitted.high:.3f}) rad, not at {terms.reference:g}, and k depends on it: is "
        f"{terms.reference:g} in radians, from the same zero?"
    )


def _with_offset(equations: Equations) -> Equations:
    """The same rows with the column of ones that a free rest angle needs.

    Angles count from the stated one, so that the fitted one comes out as the difference.
    """

    def more(W: FloatArray) -> FloatArray:
        return np.insert(W, before, 1.0, axis=1)

    before = len(set(equations.columns) - {"K"})
    columns = (*equations.columns[:before], "offset", *equations.columns[before:])
    units = (*equations.column_units[:before], UNITS["f"], *equations.column_units[before:])
    return Equations(columns, units, tuple(more(w) for w in equations.W), equations.Y)
