"""What a regression says: named parameters, their covariance, and how far to trust them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri, stdtrit

from armimpedance.arrays import BoolArray, FloatArray, frozen_array
from armimpedance.errors import EstimationError, InputError

Function = Callable[[FloatArray], ArrayLike]


@dataclass(frozen=True)
class Derived:
    """Functions of fitted parameters with their covariance by the delta method.

    Attributes
    ----------
    names, units : tuple of str
    values : (m,)
    covariance : (m, m)
    dof : float
        Of the t distribution for intervals; inf = normal.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    values: FloatArray
    covariance: FloatArray
    dof: float

    @property
    def sd(self) -> FloatArray:
        """Standard errors, (m,)."""
        return np.sqrt(np.diag(self.covariance))

    def interval(self, level: float = 0.95) -> FloatArray:
        """Confidence limits, (m, 2)."""
        return t_interval(self.values, self.sd, self.dof, level)


@dataclass(frozen=True)
class Validation:
    """How well a fit predicts data that it may not have seen.

    Attributes
    ----------
    r2 : float
        ``1 - |Y - Yhat|^2 / |Y|^2`` over all outputs; |Y| about its mean where the fit has an
        intercept, else about zero.
    vaf : float
        The same with each output's mean taken off the residual and off Y: a constant offset is
        forgiven.
    rms : (q,)
        Root mean square of the residual, in the outputs' units.
    correlation : float
        ``sum Y Yhat / sqrt(sum Y^2 sum Yhat^2)`` over all outputs, about the mean where the fit
        has an intercept, else about zero.
    """

    r2: float
    vaf: float
    rms: FloatArray
    correlation: float


@dataclass(frozen=True)
class Fit:
    """A solved linear model ``Y = W Theta + E``.

    Attributes
    ----------
    regressors, outputs : tuple of str
        The p columns of W and the q columns of Y.
    names, units : tuple of str
        Of `parameters`.
    coefficients : (p, q)
        Theta, SI. Column j predicts output j.
    covariance : (p q, p q)
        Of `parameters`: all regressors of output 1, then of output 2, and so on.
    covariance_kind : str
        ``cr1``, ``cr3``, ``classical``, or what `with_covariance` was told.
    dof : float
        Of the t distribution for intervals: clusters - 1 for clustered covariances,
        rows - p - nuisance for the classical one; inf = normal.
    cond_raw, cond_scaled : float
        Condition of W as given and with unit columns.
    rank, n_trials, n_rows : int
        n_trials counts clusters.
    residual_covariance : (q, q)
        ``E^T E / (n_rows - p - nuisance)``.
    r2 : float
        ``1 - |E|^2 / |Y|^2`` over all outputs together, outputs as given (SI, unweighted).
    centred : bool
        |Y|^2 is about each output's mean, which is done if and only if the model has an
        intercept (a constant regressor). Otherwise it is about zero; once an offset per trial
        has been projected out of both sides the two agree closely.
    triangle : (p, p)
        R of W = Z R.
    warnings : tuple of str
    """

    regressors: tuple[str, ...]
    outputs: tuple[str, ...]
    names: tuple[str, ...]
    units: tuple[str, ...]
    coefficients: FloatArray
    covariance: FloatArray
    covariance_kind: str
    dof: float
    cond_raw: float
    cond_scaled: float
    rank: int
    n_trials: int
    n_rows: int
    residual_covariance: FloatArray
    r2: float
    centred: bool
    triangle: FloatArray
    warnings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        p, q = len(self.regressors), len(self.outputs)
        if len(self.names) != p * q or len(self.units) != p * q:
            raise InputError(
                f"{len(self.names)} names and {len(self.units)} units for {p * q} parameters"
            )
        put = object.__setattr__
        for name, shape in (
            ("coefficients", (p, q)),
            ("covariance", (p * q, p * q)),
            ("residual_covariance", (q, q)),
            ("triangle", (p, p)),
        ):
            put(self, name, frozen_array(getattr(self, name), name, shape))
        if not self.dof > 0:
            raise InputError(f"{self.dof} degrees of freedom", expected="more than 0")

    @property
    def parameters(self) -> FloatArray:
        """(p q,): all regressors of output 1, then of output 2, and so on."""
        return self.coefficients.T.ravel()

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
        """Whether twice the relative standard error stays below the limit, (p q,) bool."""
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
    ) -> Derived:
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
        at = self.parameters
        values = np.atleast_1d(np.asarray(function(at), dtype=np.float64))
        if values.shape != (len(names),) or len(units or names) != len(names):
            raise InputError(f"{len(names)} names for values of shape {values.shape}")
        if jacobian is not None:
            D = np.asarray(jacobian(at), dtype=np.float64).reshape(len(names), len(at))
        else:
            D = _differences(function, at, 1e-3 * np.maximum(np.abs(at), self.sd))
        if not (np.isfinite(values).all() and np.isfinite(D).all()):
            raise EstimationError(f"{', '.join(names)} or a derivative of it is not finite here")
        # C_g (m, m) = D (m, pq) C (pq, pq) D^T
        covariance = D @ self.covariance @ D.T
        return Derived(
            tuple(names), tuple(units or ("",) * len(names)), values, covariance, self.dof
        )

    def with_warning(self, *sentences: str) -> Fit:
        """A copy that carries these warnings too."""
        return replace(self, warnings=(*self.warnings, *sentences))


def with_covariance(fit: Fit, covariance: ArrayLike, kind: str, dof: float) -> Fit:
    """The same fit with another covariance (p q, p q) of `parameters`, as from HAC or bootstrap."""
    return replace(
        fit, covariance=np.asarray(covariance, np.float64), covariance_kind=kind, dof=dof
    )


def t_factor(dof: float, level: float = 0.95) -> float:
    """Half-width of a two-sided interval in standard errors; dof inf = normal.

    Raises
    ------
    InputError
        The level does not lie between 0 and 1.
    """
    if not 0 < level < 1:
        raise InputError(f"an interval of level {level}", expected="between 0 and 1")
    upper = 0.5 + level / 2
    return float(ndtri(upper) if np.isinf(dof) else stdtrit(dof, upper))


def t_interval(values: FloatArray, sd: FloatArray, dof: float, level: float = 0.95) -> FloatArray:
    """Limits ``values -+ t sd`` (m, 2) of a two-sided interval; dof inf = normal.

    Raises
    ------
    InputError
        The level does not lie between 0 and 1.
    """
    half = t_factor(dof, level) * sd
    return np.stack([values - half, values + half], axis=-1)


def _differences(function: Function, at: FloatArray, step: FloatArray) -> FloatArray:
    """Jacobian (m, n) by central differences of fourth order."""
    columns = []
    for j, h in enumerate(np.where(step > 0, step, 1e-3)):
        e = np.zeros_like(at)
        e[j] = h
        f = [np.atleast_1d(np.asarray(function(at + m * e), dtype=float)) for m in (-2, -1, 1, 2)]
        columns.append((f[0] - 8 * f[1] + 8 * f[2] - f[3]) / (12 * h))
    return np.stack(columns, axis=1)


def _ratio(part: float, whole: float) -> float:
    return float(part / whole) if whole > 0 else float("nan")
