"""Result of a regression: named parameters, their covariance, and quality of the fit."""

from __future__ import annotations

from dataclasses import dataclass, replace
from html import escape
from typing import TYPE_CHECKING, Annotated, Any, Final

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import BoolArray, FloatArray, FrozenRecord
from armimpedance.core.errors import InputError
from armimpedance.core.findings import Finding
from armimpedance.numerics.regression.parameters import (
    Function,
    NamedParameter,
    Parameters,
    parameter_dict,
    parameter_frame,
    parameter_html,
    t_interval,
)

if TYPE_CHECKING:
    import pandas as pd

#: Most parameters that a short text shows.
_MOST_SHOWN: Final = 10


@dataclass(frozen=True)
class Validation:
    """Quality of a fit's prediction of data, which may be new.

    Attributes
    ----------
    r2 : float
        ``1 - |Y - Yhat|^2 / |Y|^2`` over all outputs; ``|Y|`` about its mean if the fit has an
        intercept, else about zero.
    vaf : float
        The same with each output's mean subtracted from the residual and from Y: a constant offset
        does not count.
    rms : (q,)
        Root mean square of the residual, in the outputs' units.
    correlation : float
        ``sum Y Yhat / sqrt(sum Y^2 sum Yhat^2)`` over all outputs, about the mean if the fit
        has an intercept, else about zero.
    """

    r2: float
    vaf: float
    rms: FloatArray
    correlation: float


@dataclass(frozen=True, repr=False)
class Fit(FrozenRecord):
    """A solved linear model ``Y = W Theta + E``.

    Attributes
    ----------
    regressors, outputs : tuple of str
        The p columns of W and the q columns of Y.
    names, units : tuple of str
        Names and units of `parameters`.
    coefficients : (p, q)
        Theta, SI. Column j predicts output j.
    covariance : (p q, p q)
        Covariance of `parameters`: all regressors of output 1, then of output 2, and so on.
    covariance_kind : str
        ``cr1``, ``cr3``, ``classical``, or what `with_covariance` was given.
    dof : float
        Degrees of freedom of the t distribution for intervals: clusters - 1 for clustered
        covariances, rows - p - nuisance for the classical one; inf = normal.
    cond_raw, cond_scaled : float
        Condition number of W unscaled and with unit columns.
    rank, n_trials, n_rows : int
        n_trials counts clusters.
    residual_covariance : (q, q)
        ``E^T E / (n_rows - p - nuisance)``.
    r2 : float
        ``1 - |E|^2 / |Y|^2`` over all outputs together, unweighted (SI).
    centred : bool
        True: ``|Y|^2`` is about each output's mean, if and only if the model has an intercept (a
        constant regressor). False: it is about zero. If an offset per trial was projected out of
        both sides, the two agree closely.
    triangle : (p, p)
        R of W = Z R.
    warnings : tuple of str
    """

    regressors: Annotated[tuple[str, ...], "p"]
    outputs: Annotated[tuple[str, ...], "q"]
    names: Annotated[tuple[str, ...], "pq"]
    units: Annotated[tuple[str, ...], "pq"]
    coefficients: Annotated[FloatArray, "p q"]
    covariance: Annotated[FloatArray, "pq pq"]
    covariance_kind: str
    dof: float
    cond_raw: float
    cond_scaled: float
    rank: int
    n_trials: int
    n_rows: int
    residual_covariance: Annotated[FloatArray, "q q"]
    r2: float
    centred: bool
    triangle: Annotated[FloatArray, "p p"]
    warnings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.dof > 0:
            raise InputError(f"{self.dof} degrees of freedom", expected="more than 0")

    @property
    def parameters(self) -> FloatArray:
        """Parameters (p q,): all regressors of output 1, then of output 2, and so on."""
        return self.coefficients.T.ravel()

    @property
    def named(self) -> Parameters:
        """The p q parameters with names, units and covariance."""
        return Parameters(
            self.names,
            self.units,
            self.parameters,
            self.covariance,
            self.covariance_kind,
            self.dof,
        )

    @property
    def sd(self) -> FloatArray:
        """Standard errors of `parameters`, (p q,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def relative_sd_percent(self) -> FloatArray:
        """``100 sd / |parameter|``, (p q,); inf for a parameter that is exactly zero."""
        size = np.abs(self.parameters)
        return np.where(size > 0, 100 * self.sd / np.where(size > 0, size, 1.0), np.inf)

    @property
    def residual_sd(self) -> float:
        """Residual standard deviation, the root mean square over outputs."""
        return float(np.sqrt(np.trace(self.residual_covariance) / len(self.outputs)))

    @property
    def vaf(self) -> float:
        """Variance accounted for, 0..1: on the fitted data the same as `r2`."""
        return self.r2

    @property
    def correlation(self) -> float:
        """Multiple correlation between Y and its prediction over all outputs.

        ``sum Y Yhat / sqrt(sum Y^2 sum Yhat^2)``, sums over rows and outputs, about each
        output's mean if `centred`, else about zero. For a least-squares prediction it equals
        ``sqrt(r2)``. It cannot see a wrong model that fits.
        """
        return float(np.sqrt(max(self.r2, 0.0)))

    def interval(self, level: float = 0.95) -> FloatArray:
        """Confidence limits of `parameters` by the t distribution, (p q, 2)."""
        return t_interval(self.parameters, self.sd, self.dof, level)

    def well_identified(self, limit_percent: float = 10.0) -> BoolArray:
        """True where twice the relative standard error is below the limit, (p q,) bool."""
        return np.asarray(2 * self.relative_sd_percent < limit_percent)

    def predict(self, W: ArrayLike) -> FloatArray:
        """Outputs (..., q) for regressors (..., p)."""
        # Yhat (..., q) = W (..., p) Theta (p, q)
        return np.asarray(np.asarray(W, dtype=np.float64) @ self.coefficients)

    def validate(self, W: ArrayLike, Y: ArrayLike) -> Validation:
        """Judge the prediction of Y (..., q) from W (..., p).

        Raises
        ------
        InputError
            Shapes that do not belong together.
        """
        p, q = self.coefficients.shape
        W, Y = np.asarray(W, dtype=np.float64), np.asarray(Y, dtype=np.float64)
        if W.shape != (*Y.shape[:-1], p) or Y.shape[-1:] != (q,):
            raise InputError(
                f"regressors of shape {W.shape}, outputs of shape {Y.shape}",
                expected=f"(..., {p}) and (..., {q}) with the same rows",
            )
        measured, predicted = Y.reshape(-1, q), self.predict(W).reshape(-1, q)
        residual = measured - predicted
        varying = measured - measured.mean(axis=0)
        y, yhat = measured, predicted
        if self.centred:
            y, yhat = varying, predicted - predicted.mean(axis=0)
        return Validation(
            r2=1 - _ratio((residual**2).sum(), (y**2).sum()),
            vaf=1 - _ratio(residual.var(axis=0).sum(), varying.var(axis=0).sum()),
            rms=np.sqrt((residual**2).mean(axis=0)),
            correlation=_ratio((y * yhat).sum(), np.sqrt((y**2).sum() * (yhat**2).sum())),
        )

    def transform(
        self,
        function: Function,
        names: tuple[str, ...],
        units: tuple[str, ...] | None = None,
        *,
        jacobian: Function | None = None,
    ) -> Parameters:
        """Functions of the parameters, with their covariance by the delta method.

        Parameters
        ----------
        function : callable
            ``(p q,) -> (m,)``, of `parameters`; smooth near the estimate.
        names, units : tuples of str, length m
        jacobian : callable, optional
            ``(p q,) -> (m, p q)``; without it five-point differences are taken with steps of a
            thousandth of the parameter or of its standard error, whichever is larger.

        Raises
        ------
        InputError
            Not as many names as values.
        EstimationError
            The function or its derivative is not finite.
        """
        return self.named.transform(function, names, units, jacobian=jacobian)

    def to_frame(self) -> pd.DataFrame:
        """One row a parameter: value, standard error, 95 % limits, unit."""
        return self.named.to_frame()

    def to_dict(self) -> list[dict[str, Any]]:
        """One mapping a parameter, of plain numbers and texts."""
        return self.named.to_dict()

    def __repr__(self) -> str:
        shown = [repr(self.named[i]) for i in range(min(len(self.names), _MOST_SHOWN))]
        hidden = len(self.names) - len(shown)
        more = [f"... and {hidden} more"] if hidden else []
        return "\n".join([f"R^2 {self.r2:.3f}, {self.n_rows} rows", *shown, *more])

    def _repr_html_(self) -> str:
        return self.named._repr_html_()

    def with_covariance(self, covariance: ArrayLike, kind: str, dof: float) -> Fit:
        """Return a copy with another covariance (p q, p q) of `parameters`, as from a bootstrap."""
        matrix = np.asarray(covariance, np.float64)
        return replace(self, covariance=matrix, covariance_kind=kind, dof=dof)

    def with_warning(self, *sentences: str) -> Fit:
        """Return a copy with these sentences after its warnings."""
        return replace(self, warnings=(*self.warnings, *sentences))


def _ratio(part: float, total: float) -> float:
    return float(part / total) if total > 0 else float("nan")


# Summary of a fit in files (FIT.json, MODEL.json).

#: Most parameters that a short text shows; a body has more than a hundred.
MOST_SHOWN: Final = 12


@dataclass(frozen=True, repr=False)
class FitSummary:
    """Method, size, condition and parameters of a fit.

    Attributes
    ----------
    method : str
    n : int
        Rows of the regression.
    cond_raw, cond_scaled : float
    rank : int
    r2, vaf : float
    parameters : tuple of NamedParameter
    warnings : tuple of str
    checks : tuple of Finding
        Findings on every assumption of the model that was checked, also those that hold.
    """

    method: str
    n: int
    cond_raw: float
    cond_scaled: float
    rank: int
    r2: float
    vaf: float
    parameters: tuple[NamedParameter, ...]
    warnings: tuple[str, ...] = ()
    checks: tuple[Finding, ...] = ()

    def __post_init__(self) -> None:
        names = [(p.name, p.joint) for p in self.parameters]
        if len(set(names)) != len(names):
            raise InputError("a fit has two parameters of one name")

    def to_frame(self) -> pd.DataFrame:
        """One row a parameter: value, standard error, 95 % limits, unit."""
        return parameter_frame(self.parameters)

    def to_dict(self) -> dict[str, Any]:
        """Return the entries of every fit in FIT.json, in the order of the format."""
        return {
            "method": self.method,
            "n": int(self.n),
            "cond_raw": float(self.cond_raw),
            "cond_scaled": float(self.cond_scaled),
            "rank": int(self.rank),
            "r2": float(self.r2),
            "vaf": float(self.vaf),
            "warnings": list(self.warnings),
            "parameters": [parameter_dict(item) for item in self.parameters],
            "checks": [item.to_dict() for item in self.checks],
        }

    def __repr__(self) -> str:
        shown = list(map(repr, self.parameters[:MOST_SHOWN]))
        hidden = len(self.parameters) - len(shown)
        more = [f"... and {hidden} more"] if hidden else []
        warned = [f"warning: {sentence}" for sentence in self.warnings]
        return "\n".join([f"{self.method}, R^2 {self.r2:.3f}", *shown, *more, *warned])

    def _repr_html_(self) -> str:
        warned = "".join(f"<li>{escape(sentence)}</li>" for sentence in self.warnings)
        head = f"<p>{escape(self.method)}, R<sup>2</sup> {self.r2:.3f}</p>"
        return f"{head}{parameter_html(self.parameters)}<ul>{warned}</ul>"
