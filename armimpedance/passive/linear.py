"""Least squares on a joint's equations, with the source's covariance and a robust one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.errors import InputError
from armimpedance.passive.equations import Equations
from armimpedance.records import FloatArray
from armimpedance.regression.covariance import hac_covariance
from armimpedance.regression.fit import Fit, with_covariance
from armimpedance.regression.solve import fit

#: Seconds over which residuals may remember; see docs of `robust_lag`.
MEMORY_S: Final = 1.0


@dataclass(frozen=True)
class TwoFits:
    """One estimate with two covariances.

    Attributes
    ----------
    classical : Fit
        The source's (10): independent residuals.
    robust : Fit
        HAC; intervals are made of it.
    """

    classical: Fit
    robust: Fit


def solve_linear(
    equations: Equations, sample_rate_hz: float, *, nuisance_per_trial: int = 0
) -> TwoFits:
    """Least squares with both covariances.

    Raises
    ------
    NotIdentifiableError
        W loses rank; names the parameters.
    InputError
        No more rows than parameters.
    """
    classical = fit(
        equations.factors(nuisance_per_trial),
        covariance="classical",
        parameter_names=equations.columns,
        parameter_units=equations.column_units,
    )
    E = [y - classical.predict(w) for w, y in zip(equations.W, equations.Y, strict=True)]
    return TwoFits(classical, robust(classical, equations.W, E, sample_rate_hz))


def robust(
    classical: Fit, W: tuple[FloatArray, ...], E: list[FloatArray], sample_rate_hz: float
) -> Fit:
    """The same fit with the HAC covariance of its rows W (S_t, p) and residuals E (S_t, 1)."""
    rows = [len(w) for w in W]
    lag = robust_lag(rows, sample_rate_hz)
    covariance = hac_covariance(W, E, classical.triangle, lag)
    left = sum(rows) - len(classical.parameters)
    # the Bartlett sum of lags takes about 1.5 N / lag independent looks at the residuals
    dof = max(1.5 * left / (lag + 1), 1.0)
    return with_covariance(classical, covariance, f"hac, lag {lag}", min(dof, float(left)))


def robust_lag(rows: list[int], sample_rate_hz: float) -> int:
    """Samples of memory for the HAC covariance: `MEMORY_S`, but a fifth of the shortest trial."""
    if min(rows) < 2:
        raise InputError("a trial of a single row", expected="two or more")
    return int(np.clip(round(MEMORY_S * sample_rate_hz), 0, min(rows) // 5))
