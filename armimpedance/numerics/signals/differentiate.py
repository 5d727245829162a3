"""One differentiator for all columns and the force, by kernels and by splines.

A B-spline ``phi`` of compact support is convolved with every signal. Its kernel is differentiated
instead of the noisy signal, ``phi * X'' = phi'' * X``. Force and displacement pass through the same
``phi``, so that ``M X'' + B X' + K X = -F`` holds after it exactly as before it. No sample outside
the kernel's support is used: there are no filter transients at the ends. As an integral over each
support, this is the weak form of the equation with ``phi`` as test function.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import comb
from typing import Annotated, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.errors import InputError
from armimpedance.numerics.signals.filters import lowpass

# B-splines with integer knots, for kernels and test functions.
#
# They are computed by the recursion over degrees, which adds only positive terms. SciPy's general
# splines give the same up to rounding, but importing them takes longer than estimating a session.


def cardinal_spline(places: ArrayLike, degree: int, order: int = 0) -> FloatArray:
    """Values of the B-spline with knots 0, 1, ..., degree + 1, or of one of its derivatives.

    `places`: any numbers; outside the knots the spline is zero.
    `order`: order of the derivative, at most `degree` - 1.
    """
    x = np.asarray(places, dtype=np.float64)
    # the derivative of order m is the m-th difference of the spline of degree less m
    parts = [(-1) ** k * comb(order, k) * _spline(x - k, degree - order) for k in range(order + 1)]
    return np.asarray(sum(parts))


def _spline(x: FloatArray, degree: int) -> FloatArray:
    pieces = [((x >= k) & (x < k + 1)).astype(np.float64) for k in range(degree + 1)]
    for p in range(1, degree + 1):
        # pieces[k] becomes the spline of degree p that begins at k
        pieces = [
            ((x - k) * pieces[k] + (k + p + 1 - x) * pieces[k + 1]) / p
            for k in range(len(pieces) - 1)
        ]
    return pieces[0]


SPLINE_DEGREE = 5


@dataclass(frozen=True, eq=False)
class Kernels(FrozenRecord):
    """A sampled smoothing kernel and its first two derivatives.

    Attributes
    ----------
    smooth, first, second : (2 h + 1,)
        Weights on the samples ``-h … h`` around a centre: sums of ``weight * sample`` give the
        smoothed value and its derivatives in units of 1, 1/s, 1/s^2.
    """

    smooth: Annotated[FloatArray, "w"]
    first: Annotated[FloatArray, "w"]
    second: Annotated[FloatArray, "w"]

    @property
    def half(self) -> int:
        """Half the support, in samples."""
        return len(self.smooth) // 2


@lru_cache(maxsize=32)
def spline_kernels(width_s: float, sample_rate_hz: float) -> Kernels:
    """Kernels from a B-spline of degree 5 whose support is about `width_s`.

    The kernels are cached, since every group of a recording uses the same.

    The knots are at samples, so that sampled sums equal the integrals, and polynomials up to degree
    3 are differentiated without error.

    Parameters
    ----------
    width_s : float
        Support in s; rounded to ``degree + 1`` whole knot intervals, at least two samples each.
    sample_rate_hz : float

    Raises
    ------
    InputError
        If the width or the rate is not positive.
    """
    if not (width_s > 0 and sample_rate_hz > 0):
        raise InputError(f"kernel width {width_s} s at {sample_rate_hz} Hz", expected="both > 0")
    spacing = max(2, round(width_s * sample_rate_hz / (SPLINE_DEGREE + 1)))
    half = spacing * (SPLINE_DEGREE + 1) // 2
    places = np.arange(2 * half + 1) / spacing
    weights = [cardinal_spline(places, SPLINE_DEGREE, order) / spacing**order for order in range(3)]
    total = weights[0].sum()
    # Correlation with phi instead of convolution: an odd derivative changes its sign.
    return Kernels(
        weights[0] / total,
        -weights[1] / total * sample_rate_hz,
        weights[2] / total * sample_rate_hz**2,
    )


def operator(weights: NDArray[np.float64], centres: NDArray[np.int64], samples: int) -> FloatArray:
    """Banded matrix (centres, samples) that applies `weights` around each centre."""
    half = len(weights) // 2
    matrix = np.zeros((len(centres), samples))
    for row, centre in enumerate(centres):
        matrix[row, centre - half : centre + half + 1] = weights
    return matrix


def derivatives(signal: FloatArray, sample_rate_hz: float) -> tuple[FloatArray, FloatArray]:
    """First and second central differences of signals (T, S, d) along time, as the source does.

    Only the method `paper` and plots of raw data use them: at 1 kHz the steps of an encoder become
    accelerations larger than the arm's.

    Parameters
    ----------
    signal : (T, S, d)
    sample_rate_hz : float

    Returns
    -------
    first, second : (T, S, d)
    """
    first = np.gradient(signal, 1.0 / sample_rate_hz, axis=1)
    return first, np.gradient(first, 1.0 / sample_rate_hz, axis=1)


# Smoothing and derivatives of motion with few samples per movement.
#
# At the 30 frames/s of motion capture a central difference loses 3 % of a 2 Hz swing's velocity.
# The output of the zero-phase filter is therefore interpolated by a spline of degree 5, and the
# spline is differentiated.

#: Fewest samples for an acceleration.
FEWEST: Final = 16


def smoothed_derivatives(
    signal: FloatArray, sample_rate_hz: float, cutoff_hz: float | None, *, order: int = 2
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Low-pass a signal (zero-phase Butterworth) and return it with its first two derivatives.

    Parameters
    ----------
    signal : (S, ...)
        One trial, equally spaced along the first axis.
    sample_rate_hz : float
    cutoff_hz : float or None
        None: no filter.
    order : int
        Order of the filter, which runs forward and backward.

    Returns
    -------
    signal, first, second : (S, ...)

    Raises
    ------
    InputError
        Too few samples, or a cut-off beyond the Nyquist frequency.
    """
    import numpy as np
    from scipy.interpolate import make_interp_spline

    if len(signal) < FEWEST:
        raise InputError(f"{len(signal)} samples in a trial", expected=f"{FEWEST} or more")
    raw = np.asarray(signal, dtype=np.float64)
    smooth = lowpass(raw, cutoff_hz, sample_rate_hz, order=order, axis=0)
    time = np.arange(len(smooth)) / sample_rate_hz
    spline = make_interp_spline(time, smooth, k=SPLINE_DEGREE)
    return smooth, spline(time, nu=1), spline(time, nu=2)
