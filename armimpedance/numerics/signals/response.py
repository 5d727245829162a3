"""From raw windows to what is fitted: smoothed, differentiated, offset and ramp removed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from armimpedance.core.arrays import FloatArray, by_axis, frozen
from armimpedance.core.errors import InputError
from armimpedance.core.records import Response, Window
from armimpedance.numerics.signals.differentiate import Kernels, operator, spline_kernels

# Removing what the limb did on its own: an offset and a ramp, from both sides of the equation.
#
# With a virtual position that drifts at constant velocity (25), the impedance equation holds for
# any linear operator that annihilates an offset and a ramp, applied to position, velocity,
# acceleration **and** force. Two such operators:
#
# - `end_operator`, ``P s = s - s(t0) - r (s(tf) - s(t0))``, ``r = (t - t0)/(tf - t0)``: exact for
#   whatever motion remains at tf, but it hangs on the noise of two samples;
# - ``P s = s - Q Q^T s`` with `ramp_basis` Q, the least-squares projection, which uses the whole
#   window.
#
# The source corrects the force alone (29), `correct_force_only`: exact only where displacement,
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
        If there are fewer than three lags: nothing would be left.
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


#: Support of the smoothing kernel (s). Measured in simulation (docs/evidence/estimate.md): at 20 um
#: encoder steps narrower kernels bias M and K, wider ones gain nothing.
KERNEL_S = 0.16
#: The fit runs from this long before the onset to this long after the end (s).
PAD_S = 0.07
#: Shorter supports than this are refused: encoder steps would be all that is left (s).
SHORTEST_KERNEL_S = 0.03
#: Rows of a fit per support of the kernel: what passes a B-spline of degree 5 lies below
#: 6 / support (37 Hz at 0.16 s), so that twice six rows and one more lose nothing.
ROWS_PER_KERNEL = 13
#: So many rows are made together: more see more samples that are none of their own.
_TOGETHER = 9


@dataclass(frozen=True)
class Span:
    """Which kernel is used and which samples of the window are its centres."""

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
    """Kernel and centres for a window: the defaults, narrowed where the records are short.

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
    wanted = kernel_s / 2 + pad_s
    if room < wanted:
        kernel_s *= max(room / wanted, 0.25)
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
            expected=f"at least {wanted * 1e3:.0f} ms of rest before and after it",
        )
    return Span(kernels, centres, stride, notes)


def respond(window: Window, span: Span | None = None, *, keep_drift: bool = False) -> Response:
    """Apply one linear operator to position and force, its derivatives to position.

    ``x = P (phi * X)``, ``x' = P (phi' * X)``, ``x'' = P (phi'' * X)``, ``f = P (phi * F)``:
    phi the smoothing kernel, P the projection that removes an offset and a ramp per trial
    (24)-(26). The impedance equation holds between them exactly as between X and F, for any
    motion that is left at the window's end and any constant-velocity drift.

    Parameters
    ----------
    window : Window
    span : Span, optional
        Default: `choose_span`.
    keep_drift : bool
        Leave offset and ramp in: for drawing, not for a fit.

    Returns
    -------
    Response
    """
    span = span or choose_span(window)
    lag, d = window.lag_s[span.centres], window.axes
    basis = ramp_basis(lag)

    banded = _operators(span.kernels, tuple(span.centres.tolist()), len(window.lag_s))

    def apply(weights: int, signal: FloatArray) -> list[FloatArray]:
        # All axes, trials and kernels at once, (d T, S) (S, w C), a few neighbouring rows a time
        smoothed = np.empty((d, len(signal) // d, weights, len(lag)))
        for rows, near, operators in banded:
            wanted = operators[:weights].reshape(-1, operators.shape[2])
            part = signal[:, near] @ wanted.T
            smoothed[..., rows] = part.reshape(d, -1, weights, operators.shape[1])
        if not keep_drift:
            # P s = s - Q (Q^T s): (d, T, w, C) = (d, T, w, 2) (2, C)
            smoothed -= (smoothed @ basis) @ basis.T
        frozen(smoothed)
        return [smoothed[:, :, i].transpose(1, 2, 0) for i in range(weights)]

    moved = by_axis(window.position)
    # Positions are referenced first: the sums lose no digits to the distance from the shoulder.
    moved -= moved[:, :1].copy()
    displacement, velocity, acceleration = apply(3, moved)
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
    """What smooths and what differentiates once and twice, (3, rows, near samples), in pieces.

    A piece holds a few rows, and of the samples only those that these rows see. The groups of a
    recording have the same window as a rule.
    """
    at, weights = np.array(centres), (kernels.smooth, kernels.first, kernels.second)
    whole = np.stack([operator(each, at, samples) for each in weights])
    pieces = []
    for first in range(0, len(at), _TOGETHER):
        rows = slice(first, first + _TOGETHER)
        near = slice(int(at[rows][0]) - kernels.half, int(at[rows][-1]) + kernels.half + 1)
        pieces.append((rows, near, frozen(whole[:, rows, near].copy())))
    return tuple(pieces)
