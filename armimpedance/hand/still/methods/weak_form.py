"""Method `weak_form`: the impedance equation multiplied by test functions free of drift.

With phi a B-spline of degree 7 inside the window, psi = phi'' is smooth, vanishes with its first
four derivatives at the ends of its support and is orthogonal to 1 and t. Integrated by parts,

    M sum psi'' x - B sum psi' x + K sum psi x = - sum psi f        for every test function psi,

holds for any motion, and an offset and a ramp of the force (a virtual position at constant
velocity) drop out of every row exactly: no signal is differentiated or corrected.

Method `exact` is closely related. It convolves the signals with a spline at many places and then
projects an offset and a ramp out of each trial's smoothed rows, which makes all rows of a trial
depend on each other. Here each row is free of the drift, there are as many rows as the window has
knots, and no projection is needed. The psi overlap; combined so that their B-spline coefficients
are orthonormal, they weight the signal evenly over the window. (Without that, or orthonormal as
functions, they emphasise high frequencies, where the signal is mostly encoder steps: K comes out
tens of percent low with narrow supports.)
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated

import numpy as np
from scipy.linalg import solve_triangular

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.conventions import Kind
from armimpedance.core.errors import InputError
from armimpedance.core.records import Response, Window
from armimpedance.hand.still.prepared import NO_LINEAR_LIMB, Method, Prepared, impedance_factors

#: Support of the B-splines of degree 5 that the test functions combine (s). Measured on the linear
#: limb, RMSE of M/B/K in %, nominal and sensor noise: 0.04 s 2.0/3.0/8.7 and 1.2/.11/2.8 (encoder
#: steps bias it), 0.08 s 1.6/3.0/8.2 and .12/.11/.30, 0.16 s 1.5/2.9/7.7 and .09/.11/.25.
SUPPORT_S = 0.16
DEGREE = 5
#: Fewer test functions than this per trial cannot separate M, B and K.
FEWEST = 8


@dataclass(frozen=True, eq=False)
class TestFunctions(FrozenRecord):
    """Products of the rows with a signal x are the projections of x, x' and x'' on psi.

    `smooth`, `first`, `second` (n, S): psi, -psi', psi'' on the samples.
    """

    __test__ = False  # not a test case, whatever its name

    smooth: Annotated[FloatArray, "n s"]
    first: Annotated[FloatArray, "n s"]
    second: Annotated[FloatArray, "n s"]


def prepare(window: Window, kind: Kind) -> Prepared:
    """Factors of the weak form for one group of trials, and notes on how.

    Raises InputError: if the window is too short for eight test functions.
    """
    return weak_rows(window, kind, SUPPORT_S)


def weak_rows(window: Window, kind: Kind, support_s: float) -> Prepared:
    """Factors of the weak form with a given support.

    Raises InputError: the same cases as in `prepare`.
    """
    samples, rate = len(window.lag_s), window.sample_rate_hz
    spacing = _spacing(samples, rate, support_s)
    tests = drift_free_splines(samples, rate, spacing)
    used = (DEGREE + 1) * spacing / rate
    notes: tuple[str, ...] = (f"{len(tests.smooth)} test functions from splines of {used:.3f} s",)
    if used < 0.75 * support_s:
        notes += (f"records too short for a support of {support_s:g} s",)
    response = against(tests, window, spacing)
    # The drift is gone from the rows, not projected out of them: no degree of freedom is lost.
    return Prepared(impedance_factors(response, kind, nuisance_per_trial=0), notes=notes)


def _spacing(samples: int, rate: float, support_s: float) -> int:
    """Samples between knots: as requested, but narrower if the window is short."""
    widest = (samples - 1) // (FEWEST + DEGREE + 2)
    if widest < 2:
        raise InputError(
            f"a window of {samples} samples at {rate:g} Hz",
            expected=f"at least {2 * (FEWEST + DEGREE + 2) + 1} samples for test functions",
        )
    return min(max(2, round(support_s * rate / (DEGREE + 1))), widest)


@lru_cache(maxsize=64)
def drift_free_splines(samples: int, sample_rate_hz: float, spacing: int) -> TestFunctions:
    """Test functions over a window with knots `spacing` samples apart.

    Knots fall on samples: then the sums of psi and t psi vanish as the integrals do, to rounding.
    """
    from scipy.interpolate import BSpline

    degree = DEGREE + 2
    count = (samples - 1) // spacing - degree
    first_knot = ((samples - 1) - (count + degree) * spacing) // 2
    spline = BSpline.basis_element(spacing * np.arange(degree + 2), extrapolate=False)
    lag = np.arange(samples) - first_knot - spacing * np.arange(count)[:, None]
    # in units of the knots' distance, so that psi is a second difference of splines of degree 5
    rows = [
        spacing**2 * (-sample_rate_hz) ** order * np.nan_to_num(spline.derivative(order + 2)(lag))
        for order in range(3)
    ]
    # coefficients D (n, n + 2) on splines of degree 5; D D^T = L L^T, L^-1 D has orthonormal rows
    D = np.zeros((count, count + 2))
    for k in range(count):
        D[k, k : k + 3] = 1.0, -2.0, 1.0
    L = np.linalg.cholesky(D @ D.T)
    return TestFunctions(*(solve_triangular(L, row, lower=True) for row in rows))


def against(tests: TestFunctions, window: Window, spacing: int) -> Response:
    """Products of the test functions with both sides of the equation, one row each."""
    samples, d = len(window.lag_s), window.axes

    def sums(rows: FloatArray, signal: FloatArray) -> FloatArray:
        # (n, S) (S, T d)
        flat = rows @ signal.transpose(1, 0, 2).reshape(samples, -1)
        return np.asarray(flat.reshape(len(rows), -1, d).transpose(1, 0, 2))

    # subtract the first position, so that the sums lose no digits
    position = window.position - window.position[:, :1]
    centre = np.arange(len(tests.smooth), dtype=np.float64) * (spacing / window.sample_rate_hz)
    return Response(
        sample_rate_hz=window.sample_rate_hz / spacing,
        lag_s=np.asarray(centre, np.float64),
        displacement=sums(tests.smooth, position),
        velocity=sums(tests.first, position),
        acceleration=sums(tests.second, position),
        force=sums(tests.smooth, window.force),
        trial=window.trial,
        usable=window.usable,
    )


METHOD = Method(
    assumes="as exact; noise of the position is small against the motion over 0.16 s",
    reference="test functions orthogonal to offset and ramp",
    prepare=prepare,
    differs=f"{NO_LINEAR_LIMB}, or noise of the position is large",
)
