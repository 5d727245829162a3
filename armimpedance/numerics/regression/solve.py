"""Solve the linear model on per-trial factors."""

from __future__ import annotations

from collections.abc import Sequence

from numpy.typing import ArrayLike

from armimpedance.core.errors import InputError
from armimpedance.numerics.regression.covariance import (
    CovarianceKind,
    clustered_dof,
    parameter_covariance,
    residual_covariance,
    residual_dof,
)
from armimpedance.numerics.regression.diagnose import Pooled, conditioning_warnings, pool
from armimpedance.numerics.regression.factors import TrialFactors
from armimpedance.numerics.regression.result import Fit


def fit(
    factors: TrialFactors,
    *,
    covariance: CovarianceKind = "cr1",
    strata: ArrayLike | None = None,
    parameter_names: Sequence[str] | None = None,
    parameter_units: Sequence[str] | None = None,
    warn_cond: float = 1e6,
) -> Fit:
    """Least squares ``Y = W Theta + E`` over all clusters.

    Parameters
    ----------
    factors : TrialFactors
    covariance : {"cr1", "cr3", "replicates", "classical"}
        Clustered by trial (t with clusters - 1 degrees of freedom; replicates: clusters - strata),
        or the classical covariance.
    strata : (T,), optional
        For replicates: clusters with the same label had the same disturbance.
    parameter_names, parameter_units : sequences of p q str, optional
        In the order of `Fit.parameters`; by default ``output:regressor`` (the plain regressor
        if there is one output) and the output's unit over the regressor's.
    warn_cond : float
        Scaled condition number above which the fit warns and names the columns.

    Returns
    -------
    Fit
        Coefficients, their covariance and degrees of freedom, residual variance and warnings.

    Raises
    ------
    NotIdentifiableError
        W loses rank; names the regressors.
    InputError
        One cluster only, no more rows than parameters, or names that do not fit.
    """
    pooled = pool(factors)
    clustered = covariance != "classical"
    C = parameter_covariance(factors, pooled, covariance, strata)
    state = pooled.state
    return Fit(
        regressors=factors.regressors,
        outputs=factors.outputs,
        names=tuple(parameter_names or _default_names(factors)),
        units=tuple(parameter_units or _default_units(factors)),
        coefficients=pooled.coefficients,
        covariance=C,
        covariance_kind=covariance,
        dof=float(
            clustered_dof(factors, covariance, strata) if clustered else residual_dof(factors)
        ),
        cond_raw=state.cond_raw,
        cond_scaled=state.cond_scaled,
        rank=state.rank,
        n_trials=factors.n_clusters,
        n_rows=int(factors.rows.sum()),
        residual_covariance=residual_covariance(factors, pooled),
        r2=_r2(pooled),
        centred=factors.intercept is not None,
        triangle=pooled.triangle,
        warnings=conditioning_warnings(state, factors.regressors, warn_cond),
    )


def _r2(pooled: Pooled) -> float:
    total = float(pooled.total_squares.sum())
    if total == 0:
        raise InputError("the outputs do not vary: there is nothing to explain")
    return 1.0 - float((pooled.residual_triangle**2).sum()) / total


def _default_names(factors: TrialFactors) -> tuple[str, ...]:
    if factors.n_outputs == 1:
        return factors.regressors
    return tuple(f"{o}:{r}" for o in factors.outputs for r in factors.regressors)


def _default_units(factors: TrialFactors) -> tuple[str, ...]:
    per = {r: f"/({r})" if set("/ *") & set(r) else f"/{r}" for r in factors.regressor_units}
    # an unknown unit on either side leaves the parameter's unit unknown
    return tuple(
        o + per[r] if o and r else "" for o in factors.output_units for r in factors.regressor_units
    )


# Blocks of a long record, which serve as clusters.


def split_blocks(n_rows: int, block_rows: int) -> tuple[slice, ...]:
    """Split a long trial into blocks that serve as its clusters.

    All blocks have `block_rows` rows, the last up to almost twice as many: a short remainder would
    be a cluster with little information, so it joins the last block. Blocks must be much longer
    than the residuals are correlated.

    Parameters
    ----------
    n_rows, block_rows : int

    Returns
    -------
    tuple of slice

    Raises
    ------
    InputError
        Fewer than two blocks fit.
    """
    count = n_rows // block_rows if block_rows > 0 else 0
    if count < 2:
        raise InputError(
            f"{n_rows} rows in blocks of {block_rows}", expected="room for two blocks or more"
        )
    edges = [*range(0, count * block_rows, block_rows), n_rows]
    return tuple(slice(a, b) for a, b in zip(edges[:-1], edges[1:], strict=True))
