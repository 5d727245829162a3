"""The impedance equation at every line, by instruments and weighed by the noise.

At each line, with y = -F, u = (a, v, x, exp(-s t) x) and s = i w,

    y = [M B K R] u + w,       y, w (d,), u (q,), [M B K R] (d, q)

w is what the person does of her own accord and what the sensors add. The explained motion z of
each line is free of it, so that

    sum Re (z* S^-1 (y - [M B K R] u)) = 0,      S the spectrum of w,

holds in closed loop, whether the robot imposes position or force. A force that is recorded later
than the motion by T adds one more column, -s y.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.hand.random.explained import Explained
from armimpedance.hand.random.lines import Complex, Lines

#: The noise's spectrum is a mean over this half width (Hz), or over so many lines to each axis.
NOISE_WIDTH_HZ: Final = 0.75
NOISE_LINES: Final = 8


@dataclass(frozen=True, eq=False)
class Equations:
    """``A theta = b`` of one delay; theta are the rows of [M B K R], then T.

    Attributes
    ----------
    A : (p, p)
        Instruments times regressors.
    b : (p,)
    meat : (p, p)
        Instruments times instruments: the covariance of the equations.
    """

    A: FloatArray
    b: FloatArray
    meat: FloatArray


def equations_at(
    lines: Lines, explained: Explained, weight: Complex, delay_s: float | None
) -> Equations:
    """The equations with a reflex of one delay, or without.

    Parameters
    ----------
    lines : Lines
    explained : Explained
    weight : (L, d, d) complex
        Inverse of the noise's spectrum.
    delay_s : float or None
    """
    kernel = None if delay_s is None else np.exp(-lines.s * delay_s)
    return with_kernel(lines, explained, weight, kernel)


def with_kernel(
    lines: Lines, explained: Explained, weight: Complex, kernel: Complex | None
) -> Equations:
    """The equations with R by any ``kernel(s)`` (L, 1) in place of ``exp(-s t)``, or without."""
    s, d = lines.s, lines.axes
    u = [lines.motion[2], lines.motion[1], lines.motion[0]]
    z = [s**2 * explained.motion, s * explained.motion, explained.motion]
    if kernel is not None:
        u, z = [*u, kernel * lines.motion[0]], [*z, kernel * explained.motion]
    U, Z = np.hstack(u), np.hstack(z)
    y, y_told = -lines.force, -explained.force
    lag, lag_told = -s * y, -s * y_told
    q = U.shape[1]
    p = d * q + 1
    A, meat = np.empty((p, p)), np.empty((p, p))
    for target, right, last in ((A, U, lag), (meat, Z, lag_told)):
        # sum over lines of Re z_a* W_ij u_c, (i a, j c)
        outer = (Z.conj()[:, :, None] * right[:, None]).reshape(len(Z), -1)
        block = (weight.reshape(len(Z), -1).T @ outer).real.reshape(d, d, q, q)
        target[:-1, :-1] = 2 * block.transpose(0, 2, 1, 3).reshape(p - 1, -1)
        target[:-1, -1] = _against(Z, weight, last)
        target[-1, :-1] = _against(right, np.swapaxes(weight, 1, 2), lag_told.conj(), conj=False)
        target[-1, -1] = _weighed(lag_told, weight, last)
    b = np.append(_against(Z, weight, y), _weighed(lag_told, weight, y))
    n = lines.widening
    return Equations(A / n, b / n, meat / n)


def _against(left: Complex, weight: Complex, right: Complex, *, conj: bool = True) -> FloatArray:
    """``2 Re sum left_a* W_ij right_j`` (i a,)."""
    turned = (weight @ right[..., None])[..., 0]
    first = left.conj() if conj else left
    return np.asarray(2 * (turned.T @ first).real.ravel())


def _weighed(left: Complex, weight: Complex, right: Complex) -> float:
    """``2 Re sum left_i* W_ij right_j``."""
    return float(2 * (left.conj() * (weight @ right[..., None])[..., 0]).real.sum())


def residual(lines: Lines, theta: FloatArray, delay_s: float | None) -> Complex:
    """``y + T s y - [M B K R] u`` at every line, (L, d)."""
    d = lines.axes
    u = [lines.motion[2], lines.motion[1], lines.motion[0]]
    if delay_s is not None:
        u = [*u, np.exp(-lines.s * delay_s) * lines.motion[0]]
    y = -lines.force
    whole = theta[:-1].reshape(d, -1)
    return np.asarray(y + theta[-1] * lines.s * y - np.hstack(u) @ whole.T)


def noise_weight(lines: Lines, left: Complex) -> Complex:
    """Inverse (L, d, d) of the residual's spectrum, a running mean that leaves out the line."""
    L, d = left.shape
    half = max(NOISE_WIDTH_HZ, NOISE_LINES * d / lines.per_hz / 2)
    first = np.searchsorted(lines.frequency_hz, lines.frequency_hz - half)
    last = np.searchsorted(lines.frequency_hz, lines.frequency_hz + half, side="right")
    outer = left[:, :, None] * left.conj()[:, None]
    sums = np.concatenate([np.zeros((1, d, d), complex), np.cumsum(outer, axis=0)])
    count = (last - first - 1)[:, None, None]
    S = (sums[last] - sums[first] - outer) / count
    scale = np.trace(S, axis1=1, axis2=2).real[:, None, None]
    S = S + (1e-9 * scale + 1e-30) * np.eye(d)
    # the inverse of a mean of n is too large by n / (n - d)
    return np.asarray((count - d) / count * np.linalg.inv(S))
