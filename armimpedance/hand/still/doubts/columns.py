"""One more column z for each departure from ``M x'' + B x' + K x = y``, y = -f.

- delay: a force that comes late by k seconds, ``z = -y'``;
- reflex: an answer to the displacement of d seconds before, ``z = K x(t - d)``;
- amplitude: a stiffness that changes with the deflection, ``z = K x |x|^2 / A^2``;
- friction: a force that has the sign of the velocity, ``z = F v / |v|``;
- voluntary: somebody pushes along the disturbance from d seconds on, ``z = F u s(t - d)``, s a ramp
  from 0 to 1 and u the direction.

F is the response's median peak, so that k is a part of it.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.records import Window
from armimpedance.hand.still.weighing.modal import ModalEquation
from armimpedance.numerics.signals import delayed

#: Delays of a reflex that are tried (s).
REFLEX_S: Final = (0.035, 0.045, 0.055, 0.065, 0.080, 0.100)
#: Nobody pushes back on purpose earlier; who does is there after RISES_S (s).
VOLUNTARY_S: Final = (0.10, 0.13, 0.16)
RISES_S: Final = 0.15
#: Names of the columns of one departure, the same with different delays.
COLUMNS: Final = {
    "delay": ("delay",),
    "reflex": tuple(f"reflex {late}" for late in REFLEX_S),
    "amplitude": ("amplitude",),
    "friction": ("friction",),
    "voluntary": tuple(f"voluntary {late}" for late in VOLUNTARY_S),
}
#: Span over which the speed is taken (s), and the part of its peak below which nothing slides.
_SPAN_S: Final = 0.021
_SLOW: Final = 0.05


def family(column: str) -> str:
    """The departure that a column belongs to."""
    return column.split()[0]


def late_s(column: str) -> float:
    """The delay in a column's name, s."""
    return float(column.split()[1])


def columns_of(
    window: Window, equation: ModalEquation, Z: FloatArray | None, theta: FloatArray
) -> tuple[dict[str, FloatArray], float]:
    """The columns z (T, d, n) of all departures, and the median peak displacement (m, rad).

    Parameters
    ----------
    window : Window
    equation : ModalEquation
        The window's, T usable trials of d axes in n modes.
    Z : (T, 3 d, n) or None
        Motion free of its noise.
    theta : (3 d^2,)
        M, B, K of the plain fit.
    """
    d, used, smooth = equation.axes, window.usable, equation.modes.smooth
    M_B_K = theta.reshape(3, d, d)
    x = window.position[used] - window.position_at_onset[used][:, None]
    squared = (x**2).sum(axis=2, keepdims=True)
    way = float(np.sqrt(np.median(squared.max(axis=(1, 2)))))

    def in_modes(signal: FloatArray) -> FloatArray:
        # (T, S, d) against the modes (n, S): (T, d, n)
        return np.asarray(np.tensordot(signal, smooth, axes=(1, 1)))

    def bears(displacement: FloatArray) -> FloatArray:
        # K (d, d) times the modes (T, d, n) of a displacement
        return np.asarray(M_B_K[2] @ in_modes(displacement))

    columns = {"amplitude": bears(x * squared / way**2)}
    for name, late in zip(COLUMNS["reflex"], REFLEX_S, strict=True):
        before = delayed(x.transpose(0, 2, 1), late * window.sample_rate_hz)
        columns[name] = bears(before.transpose(0, 2, 1))
    # [M B K] (d, 3 d) times the motion (3 d, n), free of its own noise where Z is
    force = M_B_K.transpose(1, 0, 2).reshape(d, 3 * d) @ (equation.regressors if Z is None else Z)
    columns["delay"] = -force @ (equation.modes.first @ smooth.T).T
    pushes = window.force[used] - window.force_at_onset[used][:, None]
    peak = float(np.median(np.linalg.norm(pushes, axis=2).max(axis=1)))
    columns["friction"] = in_modes(peak * _sliding(x, window.sample_rate_hz))
    furthest = squared[:, :, 0].argmax(axis=1)
    u = x[np.arange(len(x)), furthest]
    u = u / np.maximum(np.linalg.norm(u, axis=1, keepdims=True), 1e-300)
    for name, late in zip(COLUMNS["voluntary"], VOLUNTARY_S, strict=True):
        ramp = np.clip((window.lag_s - late) / RISES_S, 0, 1)
        columns[name] = in_modes(peak * ramp[None, :, None] * u[:, None, :])
    return columns, way


def _sliding(x: FloatArray, rate_hz: float) -> FloatArray:
    """Direction of the velocity of a displacement (T, S, d); small where it is slow."""
    span = min(2 * round(_SPAN_S * rate_hz / 2) + 1, x.shape[1] - (x.shape[1] + 1) % 2)
    v = _slopes(x, max(span, 3) // 2)
    speed = np.linalg.norm(v, axis=2, keepdims=True)
    slow = _SLOW * speed.max(axis=1, keepdims=True)
    return np.asarray(v / np.sqrt(speed**2 + slow**2 + 1e-300))


def _slopes(x: FloatArray, half: int) -> FloatArray:
    """Slopes of (T, S, d) a sample, by parabolas over 2 `half` + 1 samples; those at the ends too.

    What Savitzky and Golay do; SciPy's takes most of a second to import.
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
