"""One differentiator for every column and the force alike: smoothing kernels and their derivatives.

A B-spline ``phi`` of compact support is convolved with every signal; the derivatives fall on the
kernel instead of on the noise, ``phi * X'' = phi'' * X``. Force and displacement pass through the
same ``phi``, so that ``M X'' + B X' + K X = -F`` holds after it exactly as before it, and no
sample outside the kernel's support is touched: there are no filter transients at the ends. Read
as an integral over each support it is the weak form of the equation with ``phi`` as test function.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.errors import InputError
from armimpedance.numerics.signals.cardinal import cardinal_spline

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

    Every group of a recording asks for the same ones; they cannot change, so they are remembered.

    The knots fall on samples: then sampled sums reproduce what the integrals promise, and
    polynomials up to degree 3 are differentiated without error.

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

    Only the method `paper` and plots of raw data use them: at 1 kHz they turn encoder steps into
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
