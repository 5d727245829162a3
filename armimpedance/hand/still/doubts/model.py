"""The weighted fit of a condition, and the size of a further departure in it.

The column of a departure is computed with y and K of the plain fit. The rows are weighted by the
noise of the condition, and the size k of the departure has a standard error clustered by trial.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, reduce
from operator import add
from typing import Final

import numpy as np
from scipy.special import stdtrit

from armimpedance.core.arrays import BoolArray, FloatArray
from armimpedance.core.conventions import Kind
from armimpedance.core.errors import EstimationError
from armimpedance.core.records import Window
from armimpedance.hand.still.doubts.inner import FEWEST_AXES, Elbow, Inner, averaged_inner
from armimpedance.hand.still.doubts.inner_fit import InnerFits, InnerSetting, together
from armimpedance.hand.still.doubts.inner_modes import INNER_DIRECTIONS, half_sphere
from armimpedance.hand.still.doubts.knowledge import (
    DepartureProducts,
    Knowledge,
    Peaks,
    information_by_trial,
    products_of,
)
from armimpedance.hand.still.modal import (
    ModalEquation,
    by_course,
    expected_motion,
    modal_equation,
    weighted_equations,
)
from armimpedance.hand.still.weighing import NoiseModel, compensated_equations, weighted_fit
from armimpedance.numerics.regression import TrialEquations, solve_equations, t_factor
from armimpedance.numerics.signals import delayed

# One more column z for each departure from ``M x'' + B x' + K x = y``, y = -f.
#
# - delay: a force that comes late by k seconds, ``z = -y'``;
# - reflex: an answer to the displacement of d seconds before, ``z = K x(t - d)``, or to the
#   velocity then, ``z = K RATE_S x'(t - d)``;
# - amplitude: a stiffness that changes with the deflection, ``z = K x |x|^2 / A^2``;
# - friction: a force that has the sign of the velocity, ``z = F v / |v|``;
# - voluntary: the person pushes along the disturbance from d seconds on, ``z = F u s(t - d)``, s a
# ramp from 0 to 1 and u the direction.
#
# F is the median peak of the response, so that k is a share of it.

#: Delays of a reflex that are tried (s).
REFLEX_S: Final = (0.035, 0.045, 0.055, 0.065, 0.080, 0.100)
#: The same for an answer to the velocity (s), and the time that makes it a displacement (s).
RATE_DELAYS_S: Final = (0.035, 0.055, 0.080)
RATE_S: Final = 0.1
#: Onsets of a voluntary push that are tried (s): no person reacts earlier. The push is complete
#: RISES_S (s) after its onset.
VOLUNTARY_S: Final = (0.10, 0.13, 0.16)
RISES_S: Final = 0.15
#: Departure -> names of its columns, which differ in their delay only.
COLUMNS: Final = {
    "delay": ("delay",),
    "reflex": (
        *(f"reflex {late}" for late in REFLEX_S),
        *(f"reflex {late} rate" for late in RATE_DELAYS_S),
    ),
    "amplitude": ("amplitude",),
    "friction": ("friction",),
    "voluntary": tuple(f"voluntary {late}" for late in VOLUNTARY_S),
}
#: The columns of all departures, in this order.
ALL_COLUMNS: Final = tuple(column for names in COLUMNS.values() for column in names)
#: Span of samples from which the velocity is computed (s), and the share of the peak speed below
#: which dry friction is taken as not sliding.
_SPAN_S: Final = 0.021
_SLOW: Final = 0.05


def family(column: str) -> str:
    """Name of the departure that a column belongs to."""
    return column.split()[0]


def late_s(column: str) -> float:
    """Delay in the name of a column, s."""
    return float(column.split()[1])


def is_of_rate(column: str) -> bool:
    """Return True for the column of a reflex to the velocity."""
    return column.endswith(" rate")


def kind_of(column: str) -> str:
    """Name of a column's departure, by which its prior and its level are listed."""
    return "reflex to the velocity" if is_of_rate(column) else family(column)


def columns_of(
    window: Window,
    equation: ModalEquation,
    Z: FloatArray | None,
    theta: FloatArray,
    peaks: Peaks,
) -> dict[str, FloatArray]:
    """Columns z (T, d, n) of all departures, by name.

    `equation`: the window's, T usable trials of d axes in n modes.
    `Z` (T, 3 d, n) or None: motion free of its noise.
    `theta` (3 d^2,): M, B, K of the plain fit.
    """
    d, used, smooth = equation.axes, window.usable, equation.modes.smooth
    M_B_K = theta.reshape(3, d, d)
    x = window.position[used] - window.position_at_onset[used][:, None]
    squared = (x**2).sum(axis=2, keepdims=True)

    def in_modes(signal: FloatArray) -> FloatArray:
        # (T, S, d) against the modes (n, S): (T, d, n)
        return np.asarray(np.tensordot(signal, smooth, axes=(1, 1)))

    def bears(displacement: FloatArray) -> FloatArray:
        # K (d, d) times the modes (T, d, n) of a displacement
        return np.asarray(M_B_K[2] @ in_modes(displacement))

    columns = {"amplitude": bears(x * squared / peaks.way**2)}
    v = _velocity(x, window.sample_rate_hz)
    for name in COLUMNS["reflex"]:
        stretch = RATE_S * v if is_of_rate(name) else x
        before = delayed(stretch.transpose(0, 2, 1), late_s(name) * window.sample_rate_hz)
        columns[name] = bears(before.transpose(0, 2, 1))
    # [M B K] (d, 3 d) times the motion (3 d, n), which is free of its own noise if Z exists
    force = M_B_K.transpose(1, 0, 2).reshape(d, 3 * d) @ (equation.regressors if Z is None else Z)
    columns["delay"] = -force @ (equation.modes.first @ smooth.T).T
    columns["friction"] = in_modes(peaks.force * _sliding(v))
    furthest = squared[:, :, 0].argmax(axis=1)
    u = x[np.arange(len(x)), furthest]
    u = u / np.maximum(np.linalg.norm(u, axis=1, keepdims=True), 1e-300)
    for name, late in zip(COLUMNS["voluntary"], VOLUNTARY_S, strict=True):
        ramp = np.clip((window.lag_s - late) / RISES_S, 0, 1)
        columns[name] = in_modes(peaks.force * ramp[None, :, None] * u[:, None, :])
    return columns


def _velocity(x: FloatArray, rate_hz: float) -> FloatArray:
    """Velocity of a displacement (T, S, d), smoothed over `_SPAN_S`."""
    span = min(2 * round(_SPAN_S * rate_hz / 2) + 1, x.shape[1] - (x.shape[1] + 1) % 2)
    return rate_hz * _slopes(x, max(span, 3) // 2)


def _sliding(v: FloatArray) -> FloatArray:
    """Direction of a velocity (T, S, d); small where it is slow."""
    speed = np.linalg.norm(v, axis=2, keepdims=True)
    slow = _SLOW * speed.max(axis=1, keepdims=True)
    return np.asarray(v / np.sqrt(speed**2 + slow**2 + 1e-300))


def _slopes(x: FloatArray, half: int) -> FloatArray:
    """Slopes of (T, S, d) per sample, by parabolas over 2 `half` + 1 samples, also at the ends.

    Equal to a Savitzky-Golay filter; SciPy's takes most of a second to import.
    """
    at = np.arange(-half, half + 1)
    near = np.lib.stride_tricks.sliding_window_view(x, len(at), axis=1)
    slopes = np.empty_like(x)
    slopes[:, half : x.shape[1] - half] = near @ (at / (at @ at))
    # slope and bend of the first and the last parabola, (2 h + 1, 3) each
    fit = np.linalg.pinv(at[:, None] ** np.arange(3.0))
    for place, rows in ((0, slice(0, half)), (-1, slice(x.shape[1] - half, None))):
        _, slope, bend = np.moveaxis(near[:, place] @ fit.T, -1, 0)
        beside = at[:half] if place == 0 else at[half + 1 :]
        slopes[:, rows] = slope[:, None] + 2 * bend[:, None] * beside[:, None]
    return slopes


#: Significance level of each departure. It is lower where the best of several delays is chosen,
#: because chance has more ways to produce a large size.
LEVEL: Final = {
    "delay": 0.007,
    "reflex": 0.006,
    "reflex to the velocity": 0.002,
    "amplitude": 0.007,
    "friction": 0.003,
    "voluntary": 0.002,
}


@dataclass(frozen=True)
class Departure:
    """Size of one departure.

    `size`, `error`: k and its standard error.
    `expected`: the standard error expected from the estimated noise. It is a rougher measure than
    `error`, but the same for all columns, which `error` (from few trials) is not.
    `share`: relative error of K (of B, for delay and friction) in the plain fit for each unit of k.
    `known`: relative standard error of that matrix along itself; a smaller error of K or B does not
    matter.
    `level`: probability that chance alone exceeds `limit`.
    """

    size: float
    error: float
    expected: float
    share: float
    known: float
    dof: float
    level: float

    @property
    def t(self) -> float:
        """Size in standard errors. They are those of a normal distribution, whatever the dof."""
        return self.size / self.error

    @property
    def z(self) -> float:
        """Size in expected standard errors: compares how much different departures explain."""
        return self.size / self.expected

    @property
    def limit(self) -> float:
        """Detection limit: the size that chance alone exceeds with probability `level` only."""
        return float(stdtrit(self.dof, 1 - self.level / 2)) * self.error


#: Parameters and k, their covariance, dof and normal matrix.
_Solved = tuple[FloatArray, FloatArray, float, FloatArray]


@dataclass(frozen=True, eq=False)
class Model:
    """A condition's weighted fit and the columns of the departures.

    `instruments` (T, 3 d, n) or None, `covariance` (3 d^2, 3 d^2), `columns` mapping str -> (T, d,
    n).
    `weight` (d n, d n): V, the inverse of the noise's covariance.
    `equations`: the plain fit's, W against Z.
    `parameters` (3 d^2,): M, B and K of the plain fit.
    `peaks`: the peaks that the sizes of the departures are shares of.
    `usable` (window's trials,): which of the window's trials are the T of the fit.
    `inner`: sizes of inner modes, for a hand in space; the column "inner" is that of the likeliest
    mode.
    `noise`: the noise estimated from the window; None if the weight came from elsewhere.
    """

    equation: ModalEquation
    weight: FloatArray
    instruments: FloatArray | None
    equations: TrialEquations
    parameters: FloatArray
    covariance: FloatArray
    columns: dict[str, FloatArray]
    peaks: Peaks
    usable: BoolArray
    inner: InnerFits | None = None
    noise: NoiseModel | None = None

    @classmethod
    def of(cls, window: Window, kind: Kind, free_wrist: bool = False) -> Model:
        """Fit the window without departures, and compute the columns of the departures."""
        fit = weighted_fit(window, kind)
        V = np.linalg.inv(fit.noise.covariance(fit.parameters))
        V = (V + V.T) / 2
        Z = expected_motion(fit.equation)
        plain = compensated_equations(fit.equation, fit.noise, V, Z, kind)
        model = replace(cls._of(window, fit.equation, V, Z, plain), noise=fit.noise)
        return model if fit.equation.axes < FEWEST_AXES else model._with_inner(window, free_wrist)

    @classmethod
    def weighted(cls, window: Window, kind: Kind, V: FloatArray) -> Model:
        """Fit the window with a given weight V (d n, d n) of the rows."""
        equation = modal_equation(window)
        Z = expected_motion(equation)
        plain = weighted_equations(equation, V, kind, instruments=Z)
        return cls._of(window, equation, V, Z, plain)

    @classmethod
    def _of(
        cls,
        window: Window,
        equation: ModalEquation,
        V: FloatArray,
        Z: FloatArray | None,
        plain: TrialEquations,
    ) -> Model:
        solved = solve_equations(plain)
        theta, covariance, peaks = solved.parameters, solved.covariance, Peaks.of(window)
        columns = columns_of(window, equation, Z, theta, peaks)
        used = np.asarray(window.usable)
        equation = by_course(equation)
        return cls(equation, V, Z, plain, theta, covariance, columns, peaks, used)

    def _with_inner(self, window: Window, free_wrist: bool) -> Model:
        """Add the fits of inner modes of a hand in space, and the likeliest mode as a column."""
        setting = InnerSetting(
            window,
            self.equation,
            self.weight,
            self.instruments,
            self.equations,
            self.parameters,
        )
        fits = setting.fits(free_wrist)
        mode, direction = fits.best
        n = half_sphere(INNER_DIRECTIONS)[direction]
        along = np.tensordot(setting.column(fits.modes[mode]), n, axes=(1, 0))
        columns = {**self.columns, "inner": n[None, :, None] * along[:, None]}
        # errors by trials relative to those by the noise's covariance: one ratio for all modes
        expected = np.diag(np.linalg.inv(self.equations.A.sum(axis=0)))
        measured = float(np.sqrt(np.median(np.diag(self.covariance) / np.abs(expected))))
        wider = measured * t_factor(self.equation.trials - 1) / t_factor(np.inf)
        return replace(self, columns=columns, inner=fits.wider(wider))

    def left(self, column: str | None = None) -> float:
        """Weighted sum of squared residuals, with one departure in the fit or without any.

        The expected motion is used if there is one: the noise of the measured motion must not count
        for or against a departure.
        """
        theta = self.parameters if column is None else self._solved(column)[0]
        p, Z = len(self.parameters), self.instruments
        motion = self.equation.motion if Z is None else Z.reshape(self.equation.motion.shape)
        r = replace(self.equation, motion=motion).residual(theta[:p])
        if column is not None:
            r = r - theta[p] * self.columns[column].reshape(len(r), -1)
        return float(((r @ self.weight) * r).sum())

    def departure(self, column: str, beside: str | None = None) -> Departure:
        """Size k of one departure, with or without a second departure (`beside`) in the model."""
        parameters, covariance, dof, total = self._solved(column, beside)
        p = len(self.parameters)
        k, error = float(parameters[p]), max(float(np.sqrt(covariance[p, p])), 1e-300)
        expected = float(np.sqrt(abs(np.linalg.inv(total)[p, p])))
        of_B = family(column) in ("delay", "friction")
        rows = slice(p // 3, 2 * p // 3) if of_B else slice(2 * p // 3, p)
        # the fit without this departure, but with the second one if there is one
        plain = self.parameters if beside is None else self._solved(beside)[0]
        own, estimate = plain[rows], parameters[rows]
        share = float((own - estimate) @ own / (own @ own)) / k if k else 0.0
        precision = float(np.sqrt(own @ self.covariance[rows, rows] @ own)) / float(own @ own)
        return Departure(k, error, expected, share, precision, dof, LEVEL[kind_of(column)])

    def shift(self, column: str) -> FloatArray:
        """Error of M, B and K (3 d^2,) for one unit of a departure."""
        parameters = self._solved(column)[0]
        k = float(parameters[-1])
        return (self.parameters - parameters[:-1]) / k if k else np.zeros(len(self.parameters))

    def _solved(self, column: str, beside: str | None = None) -> _Solved:
        """M, B, K and k (and the size of `beside`), covariance, dof and normal matrix, cached."""
        if (column, beside) not in self._solutions:
            self._solutions[column, beside] = self._solve(column, beside)
        return self._solutions[column, beside]

    @cached_property
    def _solutions(self) -> dict[tuple[str, str | None], _Solved]:
        """Cache of the solutions: checks and intervals need the same ones."""
        return {}

    def _solve(self, column: str, beside: str | None) -> _Solved:
        columns = [column] if beside is None else [column, beside]
        p, T, products = len(self.parameters), self.equation.trials, self._products
        at = [products.names.index(name) for name in columns]
        size = p + len(columns)
        A, b = np.empty((T, size, size)), np.empty((T, size))
        A[:, :p, :p], b[:, :p] = self.equations.A, self.equations.b
        A[:, p:, :p], A[:, :p, p:] = products.zVW[:, at], products.ZVz[:, at].mT
        A[:, p:, p:], b[:, p:] = products.zVz[:, at][:, :, at], products.zVy[:, at]
        names = (*self.equations.names, *columns)
        units = (*self.equations.units, *("" for _ in columns))
        # [[Z^T V W, Z^T V z], [z^T V W, z^T V z]] (p + 1, p + 1) [theta; k] = [Z^T V y; z^T V y]
        solved = solve_equations(TrialEquations(A, b, names, units))
        return solved.parameters, solved.covariance, solved.dof, A.sum(axis=0)

    @cached_property
    def _products(self) -> DepartureProducts:
        """Products of all columns with the weight."""
        return products_of(self.equation, self.weight, self.instruments, self.columns)

    def numbers(self) -> tuple[FloatArray, FloatArray]:
        """Estimated sizes of all departures and their standard errors, (c,) each."""
        return numbers_of([self.departure(name) for name in ALL_COLUMNS])

    @property
    def found_noise(self) -> NoiseModel:
        """The noise that was estimated from the window.

        Raises EstimationError: the weight came from elsewhere.
        """
        if self.noise is None:
            raise EstimationError("a fit with a weight of its own has estimated no noise")
        return self.noise

    def knowledge(self) -> Knowledge:
        """Information of the trials, by the noise estimated from them.

        The expected motion is used if there is one: a trial's own noise is no information.
        """
        equation, Z = self.equation, self.instruments
        if Z is not None:
            equation = replace(equation, motion=Z.reshape(equation.motion.shape))
        by_trial = _knowledge(equation, self.weight, self.columns, self.peaks)
        return reduce(add, by_trial)


def numbers_of(departures: Sequence[Departure]) -> tuple[FloatArray, FloatArray]:
    """Sizes and standard errors (c,) of departures, with one common measure of the noise.

    The measure of a single column comes from few trials only; the tails are those of t.
    """
    measured = float(np.median([departure.error / departure.expected for departure in departures]))
    rough = np.array([t_factor(departure.dof) for departure in departures]) / t_factor(np.inf)
    error = measured * rough * np.array([departure.expected for departure in departures])
    return np.array([departure.size for departure in departures]), error


def pooled(models: Sequence[Model], column: str, beside: str | None = None) -> Departure:
    """One departure over all conditions, weighted by its expected precision in each.

    Standard errors from few trials are rough: as weights they would make the mean look more certain
    than it is, and so would a single one of them as its error. The degrees of freedom are
    Satterthwaite's.
    """
    departures = [model.departure(column, beside) for model in models]
    weight = np.array([departure.expected**-2 for departure in departures])
    weight /= weight.sum()
    # var(sum_i w_i k_i) = sum_i w_i^2 error_i^2
    parts = (weight * [departure.error for departure in departures]) ** 2
    return Departure(
        size=float(weight @ [departure.size for departure in departures]),
        error=float(np.sqrt(parts.sum())),
        expected=float(np.sum([departure.expected**-2 for departure in departures])) ** -0.5,
        share=float(weight @ [departure.share for departure in departures]),
        known=float(np.median([departure.known for departure in departures])),
        dof=float(parts.sum() ** 2 / (parts**2 @ [1 / departure.dof for departure in departures])),
        level=LEVEL[kind_of(column)],
    )


def inner_of(models: Sequence[Model], elbow: Elbow | None) -> Inner | None:
    """Inner mode estimated from all conditions together; None with fewer than three axes.

    `elbow`: stated by the user.
    """
    fits = [model.inner for model in models if model.inner is not None]
    return averaged_inner(together(fits), elbow) if fits else None


def beside_inner(limb: Inner | None) -> str | None:
    """Column that is kept in the model while departures are tested, or None.

    The column is that of an inner mode: what the mode explains is no departure.
    `limb`: its mode counts if its posterior probability is above a half.
    """
    return "inner" if limb is not None and limb.probability > 0.5 else None


def knowledge_by_trial(
    window: Window, weight: FloatArray, theta: FloatArray, peaks: Peaks | None = None
) -> list[Knowledge]:
    """Information of each planned trial about M, B, K and the departures.

    Parameters
    ----------
    window : Window
        Their motion and force, without noise.
    weight : (d n, d n)
        Inverse covariance of the noise in the rows of the equation.
    theta : (3 d^2,)
        M (with the handle), B and K that are expected, row by row.
    peaks : Peaks, optional
        Peaks that the sizes of the departures are shares of; those of other trials, to add their
        information.

    Returns
    -------
    list of Knowledge
    """
    equation = modal_equation(window)
    peaks = peaks or Peaks.of(window)
    columns = columns_of(window, equation, None, theta, peaks)
    return _knowledge(equation, weight, columns, peaks)


def _knowledge(
    equation: ModalEquation, weight: FloatArray, columns: Mapping[str, FloatArray], peaks: Peaks
) -> list[Knowledge]:
    """Information of each trial about M, B, K and the departures' columns (T, d, n)."""
    products = products_of(equation, weight, None, columns)
    A = weighted_equations(equation, weight, "hand").A
    return [
        Knowledge(information, products.names, 1.0, peaks).ordered(ALL_COLUMNS)
        for information in information_by_trial(A, products)
    ]
