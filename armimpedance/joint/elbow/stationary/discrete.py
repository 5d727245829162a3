"""Convert I, B and K to a difference equation and back, exactly.

The source prints the model as ``y = q^-nk B(q)/A(q) u`` (5), which is the noise-free output-error
form, and its difference equation (7)-(8) lacks the noise term that makes it ARX. Since it is fitted
by least squares, ``A(q) y(t) = B(q) u(t - nk) + e(t)`` with white e is meant.

Two structures describe a joint. "zoh": torque is held between samples, nb = 2, nk = 1. "tustin":
``s = 2/T (1 - q^-1)/(1 + q^-1)``, nb = 3, nk = 0, for torque without steps at a decimated rate.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal, get_args

import numpy as np

from armimpedance.core.arrays import FloatArray, frozen_array
from armimpedance.core.errors import EstimationError, InputError, check_number
from armimpedance.joint.elbow.elbow_result import NAMES, UNITS
from armimpedance.joint.elbow.stationary.estimate import (
    Estimate,
    Rows,
    Solved,
    estimate_of,
    ramp,
    solve_rows,
    without,
)
from armimpedance.joint.elbow.stationary.preparation import PreparedSamples

Structure = Literal["zoh", "tustin"]

#: Number of coefficients of B(q), and the delay nk of the first.
INPUTS: Final = {"zoh": 2, "tustin": 3}
DELAY: Final = {"zoh": 1, "tustin": 0}
#: A pole this near to zero decays within a sample: its logarithm is meaningless.
_AT_ZERO: Final = 1e-12


@dataclass(frozen=True)
class DiscreteModel:
    """Difference equation ``y(t) + a1 y(t-1) + a2 y(t-2) = b1 u(t-nk) + b2 u(t-nk-1) + ...``.

    `a` (2,), `b` (2,) for "zoh" with nk = 1, (3,) for "tustin" with nk = 0.
    """

    a: FloatArray
    b: FloatArray
    rate_hz: float
    structure: Structure

    def __post_init__(self) -> None:
        _check(self.rate_hz, self.structure)
        put = object.__setattr__
        put(self, "a", frozen_array(self.a, "a", (2,)))
        put(self, "b", frozen_array(self.b, "b", (INPUTS[self.structure],)))

    @property
    def nk(self) -> int:
        """Delay from torque to angle, in samples."""
        return DELAY[self.structure]

    @property
    def numerator(self) -> FloatArray:
        """Coefficients of q^0, q^-1, ...: `b` after nk zeros."""
        return np.concatenate([np.zeros(self.nk), self.b])

    @property
    def denominator(self) -> FloatArray:
        """Coefficients 1, a1, a2."""
        return np.concatenate([[1.0], self.a])

    @property
    def poles(self) -> np.ndarray:
        """Both roots of ``z^2 + a1 z + a2``, complex."""
        mean, square = self._mean_and_square()
        root = np.sqrt(complex(square))
        return np.array([mean + root, mean - root])

    def _mean_and_square(self) -> tuple[float, float]:
        """Mean of the poles, and the square of half their difference."""
        mean = -float(self.a[0]) / 2
        return mean, mean * mean - float(self.a[1])


def to_discrete(
    I: float,  # noqa: E741
    B: float,
    K: float,
    rate_hz: float,
    structure: Structure = "zoh",
) -> DiscreteModel:
    """Difference equation of ``tau = I theta'' + B theta' + K theta`` (3).

    `I`, `B`, `K`: kg m^2, N m s/rad, N m/rad; positive.
    Raises InputError: an impossible parameter, rate or structure.
    """
    _check(rate_hz, structure)
    if not (np.isfinite([I, B, K]).all() and min(I, B, K) > 0):
        raise InputError(f"I {I:g}, B {B:g}, K {K:g}", expected="three positive numbers")
    if structure == "tustin":
        c = 2 * rate_hz
        leading = I * c * c + B * c + K
        a = np.array([2 * (K - I * c * c), I * c * c - B * c + K]) / leading
        return DiscreteModel(a, np.array([1.0, 2.0, 1.0]) / leading, rate_hz, structure)
    return _held(I, B, K, rate_hz)


def joint_model(
    values: FloatArray, rate_hz: float, structure: Structure = "tustin"
) -> DiscreteModel:
    """Difference equation of I, B, K (3,), see `to_discrete`."""
    inertia, viscosity, stiffness = (float(v) for v in values)
    return to_discrete(inertia, viscosity, stiffness, rate_hz, structure)


def _held(I: float, B: float, K: float, rate_hz: float) -> DiscreteModel:  # noqa: E741
    from scipy.linalg import expm

    T = 1 / rate_hz
    # State (theta, T theta') and the held torque: all entries of order one and below.
    M = np.array([[0.0, 1.0, 0.0], [-K * T * T / I, -B * T / I, T * T / I], [0.0, 0.0, 0.0]])
    # [Phi Gamma] of x(t+1) = Phi (2, 2) x(t) + Gamma (2,) u(t)
    E = expm(M)
    Phi, Gamma = E[:2, :2], E[:2, 2]
    trace, determinant = -Phi[0, 0] - Phi[1, 1], float(np.exp(-B * T / I))
    second = (Phi @ Gamma)[0] + trace * Gamma[0]
    return DiscreteModel(
        np.array([trace, determinant]), np.array([Gamma[0], second]), rate_hz, "zoh"
    )


def to_continuous(model: DiscreteModel) -> FloatArray:
    """I, B, K (3,) of a difference equation: its poles give B/I and K/I, its gain at rest 1/K.

    Raises EstimationError: a joint cannot have these poles or this gain: unstable, on the negative
    real axis or at zero, where the logarithm has no value, or I, B or K not positive. The message
    names the case and gives advice.
    """
    _refuse_poles(model)
    values = _continuous(model)
    if not (np.isfinite(values).all() and (values > 0).all()):
        shown = ", ".join(f"{n} {v:.3g}" for n, v in zip("IBK", values, strict=True))
        raise EstimationError(
            f"the discrete model is no joint: {shown} (all must be positive); is the torque "
            "that on the limb, and does the joint move enough? try another method"
        )
    return values


def jacobian(model: DiscreteModel) -> FloatArray:
    """Derivative (3, 2 + nb) of I, B, K by (a1, a2, b1, ...), for the delta method.

    Raises EstimationError: as `to_continuous`.
    """
    values = to_continuous(model)
    b_sum = float(model.b.sum())
    square, rate, d_square, d_rate = _ratios(model)
    zeros = np.zeros(len(model.b))
    d_K = np.concatenate([[1 / b_sum] * 2, np.full(len(model.b), -values[2] / b_sum)])
    d_square, d_rate = np.concatenate([d_square, zeros]), np.concatenate([d_rate, zeros])
    # I = K / w^2, B = (B/I) I
    d_I = d_K / square - values[0] / square * d_square
    return np.stack([d_I, rate * d_I + values[0] * d_rate, d_K])


def _continuous(model: DiscreteModel) -> FloatArray:
    b_sum = float(model.b.sum())
    if abs(b_sum) < np.finfo(float).tiny:
        raise EstimationError("the discrete model has no gain at rest: K cannot be estimated")
    square, rate, _, _ = _ratios(model)
    with np.errstate(all="ignore"):
        # Numbers that no joint can have may overflow here; they are refused later.
        K = np.float64(1 + float(model.a.sum())) / b_sum
        I = K / square  # noqa: E741
        return np.array([I, rate * I, K])


def _ratios(model: DiscreteModel) -> tuple[float, float, FloatArray, FloatArray]:
    """Ratios ``w^2 = K/I`` and ``B/I``, and their derivatives (2,) by a1, a2."""
    a1, a2 = (float(v) for v in model.a)
    if model.structure == "tustin":
        c, end = 2 * model.rate_hz, 1 - a1 + a2
        square, rate = c * c * (1 + a1 + a2) / end, 2 * c * (1 - a2) / end
        d_square = np.array([c * c + square, c * c - square]) / end
        return square, rate, d_square, np.array([rate, -2 * c - rate]) / end
    f = model.rate_hz
    mean, half_square = model._mean_and_square()
    # ln z = l +- delta; L = delta over half of the poles' difference, smooth for equal poles
    l = np.log(a2) / 2  # noqa: E741
    half = np.sqrt(abs(half_square))
    if half == 0:
        L, product = 1 / mean, l * l
    elif half_square < 0:
        delta = np.arctan2(half, mean)
        L, product = delta / half, l * l + delta * delta
    else:
        L = np.arctanh(half / mean) / half
        product = np.log(mean + half) * np.log(a2 / (mean + half))
    d_square = f * f * np.array([L, (l + mean * L) / a2])
    return f * f * product, -2 * f * l, d_square, np.array([0.0, -f / a2])


def _refuse_poles(model: DiscreteModel) -> None:
    poles = model.poles
    shown = ", ".join(_shown(z) for z in poles)
    advice = "filter both channels, decimate less or more, or take another method"
    a1, a2 = (float(v) for v in model.a)
    # Jury's test: both poles inside the unit circle, without the rounding of a root.
    if not (a2 < 1 and 1 + a1 + a2 > 0 and 1 - a1 + a2 > 0):
        raise EstimationError(f"the fitted model is unstable (poles {shown}): {advice}")
    on_axis = (np.abs(poles.imag) == 0) & (poles.real <= 0) | (np.abs(poles) < _AT_ZERO)
    if on_axis.any():
        raise EstimationError(
            f"a pole on the negative real axis or at zero ({_shown(poles[on_axis][0])}) is no "
            f"joint's at {model.rate_hz:g} Hz, its logarithm has no value: {advice}"
        )


def _shown(z: complex) -> str:
    return f"{z.real:.4g}" if z.imag == 0 else f"{z.real:.4g}{z.imag:+.4g}i"


def _check(rate_hz: float, structure: str) -> None:
    if structure not in get_args(Structure):
        raise InputError(f"no structure {structure!r}", expected="zoh or tustin")
    check_number(rate_hz, f"a rate of {rate_hz} Hz", above=0)


# Lagged columns of a difference equation, its model, and I, B, K from a fit to them.

#: b (nb,) = SHAPE (nb, columns) @ fitted.
SHAPE: Final = {"zoh": np.eye(2), "tustin": np.array([[1.0], [2.0], [1.0]])}
FREE: Final = {"zoh": np.eye(2), "tustin": np.eye(3)}


@dataclass(frozen=True)
class Lagged:
    """Rows of one trial before nuisance terms are removed: y (S,) and lagged columns X (S, p)."""

    X: FloatArray
    y: FloatArray


def lagged(
    angle: FloatArray, torque: FloatArray, structure: Structure, shape: FloatArray
) -> Lagged:
    """Columns ``y(t)`` and ``[-y(t-1), -y(t-2), u ...]`` for t from the third sample on.

    `angle`, `torque` (S,).
    `shape` (nb, columns): `SHAPE` or `FREE` of the structure.
    """
    now, back_1, back_2 = angle[2:], angle[1:-1], angle[:-2]
    inputs = np.column_stack([torque[2:], torque[1:-1], torque[:-2]])[:, DELAY[structure] :]
    # U (S, columns) = [u(t-nk) u(t-nk-1) ...] (S, nb) shape (nb, columns)
    U = inputs @ shape
    return Lagged(np.column_stack([-back_1, -back_2, U]), now)


def model_of(
    parameters: FloatArray, rate_hz: float, structure: Structure, shape: FloatArray
) -> DiscreteModel:
    """Difference equation of fitted parameters."""
    return DiscreteModel(parameters[:2], shape @ parameters[2:], rate_hz, structure)


def solve_structure(
    prepared: PreparedSamples, structure: Structure, *, free: bool = False
) -> Estimate:
    """Least squares in one of the two structures, its b in their proportions or `free`.

    Raises EstimationError: the fitted poles or gain are not a joint's.
    Raises NotIdentifiableError: the record does not allow the coefficients to be separated.
    """
    shape = (FREE if free else SHAPE)[structure]
    rows = []
    for row in range(prepared.n_trials):
        inside = prepared.inside(row)
        table = lagged(prepared.angle[inside], prepared.torque[inside], structure, shape)
        X, y = without(ramp(len(table.y)), table.X, table.y)
        rows.append(Rows(X, X, y, len(y) / prepared.sample_rate_hz))
    names = ("a1", "a2", *(f"b{j + 1}" for j in range(shape.shape[1])))
    return _to_estimate(solve_rows(rows, names), prepared.sample_rate_hz, structure, shape)


def _to_estimate(
    solved: Solved, rate_hz: float, structure: Structure, shape: FloatArray
) -> Estimate:
    """I, B, K and their covariances by the delta method."""
    model = model_of(solved.parameters.values, rate_hz, structure, shape)
    # D (3, p) = d(I, B, K)/d(a, b) (3, 2 + nb) d(a, b)/d(fitted) (2 + nb, p)
    chain = np.zeros((2 + len(model.b), len(solved.parameters)))
    chain[:2, :2], chain[2:, 2:] = np.eye(2), shape
    D = jacobian(model) @ chain
    return estimate_of(solved.transformed(to_continuous(model), D, NAMES, UNITS), discrete=model)


def simulated(model: DiscreteModel, torque: FloatArray) -> FloatArray:
    """Angle (S,) under a torque (S,), from rest."""
    from scipy.signal import lfilter

    return np.asarray(lfilter(model.numerator, model.denominator, torque))
