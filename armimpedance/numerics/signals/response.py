"""From raw windows to the fitted signals: smoothed, differentiated, offset and ramp removed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from armimpedance.core.arrays import FloatArray, by_axis, frozen
from armimpedance.core.errors import InputError
from armimpedance.core.records import Response, Window
from armimpedance.numerics.signals.differentiate import Kernels, operator, spline_kernels

# Removal of the limb's own motion: an offset and a ramp, from both sides of the equation.
#
# With a virtual position that drifts at constant velocity (25), the impedance equation holds for
# any linear operator that annihilates an offset and a ramp, applied to position, velocity,
# acceleration **and** force. Two such operators:
#
# - `end_operator`, ``P s = s - s(t0) - r (s(tf) - s(t0))``, ``r = (t - t0)/(tf - t0)``: exact for
#   any motion that remains at tf, but sensitive to the noise of two samples;
# - ``P s = s - Q Q^T s`` with `ramp_basis` Q, the least-squares projection, which uses the whole
#   window.
#
# The source corrects only the force (29), `correct_force_only`: exact only if displacement,
# velocity and acceleration are all zero again at tf.


def ramp_basis(lag_s: FloatArray) -> FloatArray:
    """Orthonormal basis Q (S, 2) of an offset and a ramp; ``P s = s - Q Q^T s`` removes both.

    Parameters
    ----------
    lag_s : (S,)

    Returns
    -------
    (S, 2) array
        Orthonormal columns that span an offset and a ramp.

    Raises
    ------
    InputError
        If there are fewer than three lags: nothing would remain.
    """
    if len(lag_s) < 3:
        raise InputError(f"a window of {len(lag_s)} samples", expected="at least 3")
    centred = lag_s - lag_s.mean()
    basis = np.column_stack([np.ones_like(centred), centred])
    return np.asarray(basis / np.linalg.norm(basis, axis=0))


def end_operator(lag_s: FloatArray, start: int, end: int) -> FloatArray:
    """Matrix (S, S) of ``P s = s - s(t0) - r(t) [s(tf) - s(t0)]`` with samples `start`, `end`."""
    r = (lag_s - lag_s[start]) / (lag_s[end] - lag_s[start])
    operator = np.eye(len(lag_s))
    operator[:, start] -= 1 - r
    operator[:, end] -= r
    return operator


def correct_force_only(force: FloatArray, lag_s: FloatArray, start: int, end: int) -> FloatArray:
    """The source's drift correction (29) on forces (T, S, d), from single samples at t0 and tf.

    ``dF_d = dF - (t - t0)/(tf - t0) dF(tf)``, ``dF = F - F(t0)``.

    Parameters
    ----------
    force : (T, S, d)
    lag_s : (S,)
    start, end : int
        Samples of t0 and tf.

    Returns
    -------
    (T, S, d) array
        Forces without the drift, N.
    """
    return np.matmul(end_operator(lag_s, start, end), force)


#: Support of the smoothing kernel (s). In simulations (docs/evidence/estimate.md) with encoder
#: steps of 20 um, narrower kernels bias M and K, and wider ones are no better.
KERNEL_S = 0.16
#: The fit runs from this long before the onset to this long after the end (s).
PAD_S = 0.07
#: Shortest support that is accepted (s); with a shorter one, encoder steps would dominate.
SHORTEST_KERNEL_S = 0.03
#: Rows of a fit per support of the kernel: a B-spline of degree 5 passes frequencies below
#: 6 / support (37 Hz at 0.16 s), so that twice six rows and one more lose no information.
ROWS_PER_KERNEL = 13
#: Rows that are computed together; with more, each row would include more samples that it ignores.
_TOGETHER = 9


@dataclass(frozen=True)
class Span:
    """Kernels of the smoothing, and the samples of the window at their centres."""

    kernels: Kernels
    centres: np.ndarray
    stride: int
    notes: tuple[str, ...] = ()


def choose_span(
    window: Window,
    *,
    kernel_s: float = KERNEL_S,
    pad_s: float = PAD_S,
    rows_per_kernel: int = ROWS_PER_KERNEL,
) -> Span:
    """Choose kernels and centres for a window: the defaults, narrowed if the records are short.

    Parameters
    ----------
    window : Window
    kernel_s : float
        Support of the smoothing kernel, s.
    pad_s : float
        The fit runs from this long before the onset to this long after the end, s.
    rows_per_kernel : int
        Rows of a fit per support of the kernel.

    Returns
    -------
    Span
        Smoothing kernels, their centres, the stride between rows, and notes on what was narrowed.

    Raises
    ------
    InputError
        If the window is too short for any kernel.
    """
    rate, lag = window.sample_rate_hz, window.lag_s
    duration = float(window.duration_s[window.usable].max())
    room = min(-lag[0], lag[-1] - duration) + 0.5 / rate
    notes: tuple[str, ...] = ()
    needed = kernel_s / 2 + pad_s
    if room < needed:
        kernel_s *= max(room / needed, 0.25)
        pad_s = room - kernel_s / 2
        notes = (
            f"only {max(room, 0) * 1e3:.0f} ms recorded at rest before and after the disturbance: "
            f"smoothing over {kernel_s * 1e3:.0f} ms instead of {KERNEL_S * 1e3:.0f} ms",
        )
    kernels = spline_kernels(kernel_s, rate)
    stride = max(1, round(2 * kernels.half / rows_per_kernel))
    low = max(int(np.searchsorted(lag, -pad_s - 0.25 / rate)), kernels.half)
    high = min(int(np.searchsorted(lag, duration + pad_s + 0.25 / rate)), len(lag) - kernels.half)
    centres = np.arange(low, high, stride, dtype=np.int64)
    if kernel_s < SHORTEST_KERNEL_S or len(centres) < 8:
        raise InputError(
            f"the records hold {len(lag) / rate:.3f} s around each disturbance",
            expected=f"at least {needed * 1e3:.0f} ms of rest before and after it",
        )
    return Span(kernels, centres, stride, notes)


def respond(window: Window, span: Span | None = None, *, keep_drift: bool = False) -> Response:
    """Apply one linear operator to position and force, and its derivatives to position.

    ``x = P (phi * X)``, ``x' = P (phi' * X)``, ``x'' = P (phi'' * X)``, ``f = P (phi * F)``:
    phi the smoothing kernel, P the projection that removes an offset and a ramp per trial
    (24)-(26). The impedance equation holds between them exactly as between X and F, for any
    motion that remains at the window's end and any constant-velocity drift.

    Parameters
    ----------
    window : Window
    span : Span, optional
        Default: `choose_span`.
    keep_drift : bool
        Keep offset and ramp: for plots, not for a fit.

    Returns
    -------
    Response
    """
    span = span or choose_span(window)
    lag, d = window.lag_s[span.centres], window.axes
    basis = ramp_basis(lag)

    banded = _operators(span.kernels, tuple(span.centres.tolist()), len(window.lag_s))

    def apply(weights: int, signal: FloatArray) -> list[FloatArray]:
        # all axes, trials and kernels at once, (d T, S) (S, w C), a few neighbouring rows at a time
        smoothed = np.empty((d, len(signal) // d, weights, len(lag)))
        for rows, near, operators in banded:
            kernels = operators[:weights].reshape(-1, operators.shape[2])
            part = signal[:, near] @ kernels.T
            smoothed[..., rows] = part.reshape(d, -1, weights, operators.shape[1])
        if not keep_drift:
            # P s = s - Q (Q^T s): (d, T, w, C) = (d, T, w, 2) (2, C)
            smoothed -= (smoothed @ basis) @ basis.T
        frozen(smoothed)
        return [smoothed[:, :, i].transpose(1, 2, 0) for i in range(weights)]

    motion = by_axis(window.position)
    # positions are referenced first, so that the distance from the shoulder costs no digits
    motion -= motion[:, :1].copy()
    displacement, velocity, acceleration = apply(3, motion)
    (force,) = apply(1, by_axis(window.force))
    return Response(
        sample_rate_hz=window.sample_rate_hz / span.stride,
        lag_s=lag,
        displacement=displacement,
        velocity=velocity,
        acceleration=acceleration,
        force=force,
        trial=window.trial,
        usable=window.usable,
    )


@lru_cache(maxsize=4)
def _operators(
    kernels: Kernels, centres: tuple[int, ...], samples: int
) -> tuple[tuple[slice, slice, FloatArray], ...]:
    """Operators for smoothing and the first two derivatives, (3, rows, near samples), in pieces.

    A piece has a few rows and only the samples that these rows use. The result is cached, since
    groups of a recording usually have the same window.
    """
    at, weights = np.array(centres), (kernels.smooth, kernels.first, kernels.second)
    whole = np.stack([operator(kernel, at, samples) for kernel in weights])
    pieces = []
    for first in range(0, len(at), _TOGETHER):
        rows = slice(first, first + _TOGETHER)
        near = slice(int(at[rows][0]) - kernels.half, int(at[rows][-1]) + kernels.half + 1)
        pieces.append((rows, near, frozen(whole[:, rows, near].copy())))
    return tuple(pieces)
