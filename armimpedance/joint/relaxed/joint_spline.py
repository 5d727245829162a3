"""Fit joint motion and torque together if the limb's dynamics are not known.

Both channels have errors: the angle q(t) is a spline, and the measured angle and torque,
unfiltered, are the predictions of spline and parameters plus noise. The spline and the parameters
are fitted in turn, each by weighted least squares; the weights come from the residuals of splines.

Near a reversal the sign of the velocity is not known. A hard choice is sometimes wrong, which makes
f too small and h too large. The expected sign, given the error of the spline's velocity, gives no
bias (J. Berkson, J. Am. Stat. Assoc. 45 (1950) 164-180).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import EstimationError, InputError
from armimpedance.joint.relaxed.equations import Equations, Terms, parallel_equations
from armimpedance.joint.relaxed.linear import TwoFits, solve_linear
from armimpedance.joint.relaxed.samples import PassiveSamples

_DEGREE: Final = 5
_MOST_TURNS: Final = 50

#: Number of turns in which samples near a reversal may still change their sign.
_TURNS_OF_SIGN: Final = 5

#: Knots per period of the cut-off, so that the spline follows all that the filter passes. Without a
#: cut-off, for data without noise, there is a knot at every second sample.
_KNOTS_PER_PERIOD: Final = 3.0

#: Converged when no parameter changes by more than this share of its standard error, or its size.
_STILL: Final = 0.01
_STILL_EXACT: Final = 1e-9

#: Number of samples over which the velocity's standard error is averaged: several knots.
_MIDDLE: Final = 50

#: Factor by which the number of pieces falls for each smoother spline that is tried.
_COARSER: Final = 1.4


@dataclass(frozen=True)
class TrialSpline:
    """One trial's measured angle and torque, and the spline's design matrices.

    `q`, `torque` (S,).
    `B`, `B1` sparse (S, c): design matrices of the angle and of its derivative.
    `knots` (c + 6,): seconds from the trial's first sample.
    `qd_sd`: standard error of the spline's velocity, rad/s.
    """

    q: FloatArray
    torque: FloatArray
    B: Any
    B1: Any
    knots: FloatArray
    qd_sd: float

    def motion(self, curve: FloatArray, seconds: FloatArray) -> tuple[FloatArray, ...]:
        """Angle, velocity and acceleration (n,) at any times (n,) of the trial."""
        from scipy.interpolate import BSpline

        spline = BSpline(self.knots, curve, _DEGREE)
        return tuple(spline(seconds, nu=d) for d in range(3))

    def sign(self, qd: FloatArray) -> FloatArray:
        """Expected sign of the spline's velocities (S,)."""
        from scipy.special import erf

        if self.qd_sd == 0:
            return np.sign(qd)
        return np.asarray(erf(qd / (np.sqrt(2) * self.qd_sd)))


def solve_joint_spline(samples: PassiveSamples, terms: Terms) -> TwoFits:
    """Fit motion and torque of a single joint together.

    Raises EstimationError: spline and parameters do not converge.
    Raises InputError: the torque was not measured.
    """
    trials = [trial_spline(samples, s) for s in samples.slices()]
    curves = [_least_squares(t.B, t.q) for t in trials]
    weight = _torque_weight(trials, curves)
    x = solve_linear(parallel_equations(samples, terms), samples.sample_rate_hz)
    parameters = x.classical.parameters
    signs = [t.sign(t.B1 @ c) for t, c in zip(trials, curves, strict=True)]
    for turn in range(_MOST_TURNS):
        curves = [
            _spline_given(t, c, s, parameters, terms, weight)
            for t, c, s in zip(trials, curves, signs, strict=True)
        ]
        if turn < _TURNS_OF_SIGN:
            signs = [t.sign(t.B1 @ c) for t, c in zip(trials, curves, strict=True)]
        fits = solve_linear(_equations(trials, curves, signs, terms), samples.sample_rate_hz)
        change = np.abs(fits.classical.parameters - parameters)
        parameters = fits.classical.parameters
        if (change <= _STILL * fits.classical.sd + _STILL_EXACT * np.abs(parameters)).all():
            return fits
    raise EstimationError(
        f"{samples.joints[0]}: motion and torque did not settle in {_MOST_TURNS} turns"
    )


def trial_spline(samples: PassiveSamples, part: slice) -> TrialSpline:
    """Spline of a trial of a single joint, with knots for the pass band of the samples' filter.

    Raises InputError: the torque was not measured.
    """
    if samples.measured_torque is None:
        raise InputError("no measured torque", expected="samples of a joint recording")
    q, torque = samples.measured_q[part, 0], samples.measured_torque[part, 0]
    pieces = finest = max((len(q) - _DEGREE - 1) // 2, 1)
    if samples.cutoff_hz is not None:
        seconds = (len(q) - 1) / samples.sample_rate_hz
        pieces = min(int(np.ceil(seconds * samples.cutoff_hz * _KNOTS_PER_PERIOD)), finest)
    return _spline(q, torque, samples.sample_rate_hz, pieces)


def smoothest(trial: TrialSpline) -> tuple[TrialSpline, FloatArray]:
    """The trial's spline with the number of knots that predicts best, and its coefficients (c,).

    Generalised cross-validation (P. Craven, G. Wahba, Numer. Math. 31 (1979) 377-403): the noise
    of a velocity grows with the knots to the power of 1.5, that of an acceleration of 2.5.
    """
    count = len(trial.q)
    rate = (count - 1) / trial.knots[-1]
    pieces, best, smooth = len(trial.knots) - 2 * _DEGREE - 1, np.inf, trial
    curve = _least_squares(trial.B, trial.q)
    while pieces >= 1:
        tried = _spline(trial.q, trial.torque, rate, pieces)
        tried_curve = _least_squares(tried.B, trial.q)
        square = float(((trial.q - tried.B @ tried_curve) ** 2).mean())
        score = square / (1 - tried.B.shape[1] / count) ** 2
        if score < best:
            best, smooth, curve = score, tried, tried_curve
        pieces = int(pieces / _COARSER)
    return smooth, curve


def _spline(q: FloatArray, torque: FloatArray, rate_hz: float, pieces: int) -> TrialSpline:
    """Trial with a spline of equal pieces."""
    from scipy.interpolate import BSpline

    seconds = np.arange(len(q)) / rate_hz
    edges = np.linspace(0, seconds[-1], pieces + 1)
    knots = np.concatenate([[0.0] * _DEGREE, edges, [edges[-1]] * _DEGREE])
    B = BSpline.design_matrix(seconds, knots, _DEGREE)
    # B' = D (scaled differences of coefficients) in the basis of one degree less
    spread = knots[_DEGREE + 1 : -1] - knots[1 : -_DEGREE - 1]
    lower = BSpline.design_matrix(seconds, knots[1:-1], _DEGREE - 1)
    B1 = _DEGREE * (lower / spread) @ _differences(B.shape[1])
    return TrialSpline(q, torque, B, B1, knots, _velocity_error(q, B, B1))


def _velocity_error(q: FloatArray, B: Any, B1: Any) -> float:
    """Standard error (rad/s) of the spline's velocity in the middle of a trial."""
    from scipy.sparse.linalg import splu

    count, knots = B.shape
    if count <= knots:
        return 0.0
    middle = B1[count // 2 : count // 2 + _MIDDLE].toarray()
    # var(qd) (n,) = s^2 diag(B1 (B^T B)^-1 B1^T)
    gain = (middle.T * splu((B.T @ B).tocsc()).solve(middle.T)).sum(axis=0).mean()
    residual = q - B @ _least_squares(B, q)
    return float(np.sqrt(gain * (residual @ residual) / (count - knots)))


def _differences(count: int) -> Any:
    from scipy.sparse import diags_array

    return diags_array(
        [-np.ones(count - 1), np.ones(count - 1)], offsets=[0, 1], shape=(count - 1, count)
    )


def _least_squares(B: Any, y: FloatArray) -> FloatArray:
    from scipy.sparse.linalg import spsolve

    # c (c,) from B^T B c = B^T y, B (S, c) banded and well conditioned
    return np.asarray(spsolve((B.T @ B).tocsc(), B.T @ y))


def _torque_weight(trials: list[TrialSpline], curves: list[FloatArray]) -> float:
    """Variance of the angle's noise over the torque's, each from the residual of a spline."""
    angle = torque = 0.0
    for trial, curve in zip(trials, curves, strict=True):
        angle += float(((trial.q - trial.B @ curve) ** 2).sum())
        smooth = trial.B @ _least_squares(trial.B, trial.torque)
        torque += float(((trial.torque - smooth) ** 2).sum())
    return angle / torque if torque > 0 else 0.0


def _spline_given(
    trial: TrialSpline,
    curve: FloatArray,
    sign: FloatArray,
    x: FloatArray,
    terms: Terms,
    weight: float,
) -> FloatArray:
    """Spline (c,) that fits angle and torque best for given signs (S,) and parameters (p,)."""
    from scipy.sparse.linalg import spsolve

    q, qd = trial.B @ curve, trial.B1 @ curve
    predicted = terms.matrix(q, qd, sign) @ x
    # torque about the present curve: G (S, c) = d tau/dq B + h B1
    slope = np.full(len(q), x[0])
    for name, power in (("K", 2), ("C", 3)):
        if name in terms.columns:
            size = x[terms.columns.index(name)]
            slope = slope + power * size * (q - terms.reference) ** (power - 1)
    G = trial.B.multiply(slope[:, None]).tocsr() + x[1] * trial.B1
    normal = trial.B.T @ trial.B + weight * (G.T @ G)
    right = trial.B.T @ trial.q + weight * (G.T @ (trial.torque - predicted + G @ curve))
    return np.asarray(spsolve(normal.tocsc(), right))


def _equations(
    trials: list[TrialSpline], curves: list[FloatArray], signs: list[FloatArray], terms: Terms
) -> Equations:
    W, Y = [], []
    for trial, curve, sign in zip(trials, curves, signs, strict=True):
        q, qd = trial.B @ curve, trial.B1 @ curve
        W.append(terms.matrix(q, qd, sign))
        Y.append(trial.torque[:, None])
    return Equations(terms.columns, terms.column_units, tuple(W), tuple(Y))
