"""Least squares on a joint's equations, with the source's covariance and a robust one."""

from __future__ import annotations

from dataclasses import dataclass

from armimpedance.passive.equations import Equations
from armimpedance.passive.long_run import with_long_run
from armimpedance.regression import Fit, fit


@dataclass(frozen=True)
class TwoFits:
    """One estimate with two covariances.

    Attributes
    ----------
    classical : Fit
        The source's (10): independent residuals.
    robust : Fit
        For autocorrelated residuals; intervals are made of it.
    """

    classical: Fit
    robust: Fit


def solve_linear(equations: Equations, sample_rate_hz: float) -> TwoFits:
    """Least squares with both covariances.

    Raises
    ------
    NotIdentifiableError
        W loses rank; names the parameters.
    InputError
        No more rows than parameters.
    """
    classical = fit(
        equations.factors(),
        covariance="classical",
        parameter_names=equations.columns,
        parameter_units=equations.column_units,
    )
    E = [y - classical.predict(w) for w, y in zip(equations.W, equations.Y, strict=True)]
    return TwoFits(classical, with_long_run(classical, equations.W, E, sample_rate_hz))
