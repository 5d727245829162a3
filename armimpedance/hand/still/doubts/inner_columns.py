"""The columns of modes inside the limb: what moves while the hand is held.

`inner` has the equations. A free wrist adds a mass m that the hand carries along while it is slow,
``m n n^T x_slow''``: forearm and hand turn about a handle on a ball joint with a few Hz. Taken for
the limb's own it makes K too small along the soft axes. M and B of such a limb are those of slow
motion.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.records import Window
from armimpedance.hand.still.weighing.modal import ModalEquation

#: Axes from which on a limb has joints that the hand does not show.
FEWEST_AXES: Final = 3
#: Natural frequencies (Hz) that are tried, one damping ratio for all, and how many directions.
INNER_HZ: Final = (1.2, 1.8, 2.7, 4.0)
INNER_DAMPING: Final = 0.5
INNER_DIRECTIONS: Final = 24
#: Those of a mass that a free wrist carries along while it is slow.
WRIST_HZ: Final = (3.0, 5.0, 8.0)
#: In the name of such a mass' column.
CARRIED: Final = "carried"


def inner_columns(
    window: Window, equation: ModalEquation, theta: FloatArray, free_wrist: bool
) -> dict[str, FloatArray]:
    """The columns (T, d, n) of inner modes along many directions; none in fewer than three axes."""
    d = equation.axes
    if d < FEWEST_AXES:
        return {}
    used = window.usable
    x = window.position[used] - window.position_at_onset[used][:, None]
    rate = window.sample_rate_hz
    mass, _, scale = (float(np.trace(part)) / d for part in theta.reshape(3, d, d))
    signals = {f"inner {hz}": scale * (x - _slow(x, hz, rate)[0]) for hz in INNER_HZ}
    if free_wrist:
        signals |= {f"inner {hz} {CARRIED}": mass * _carried(x, hz, rate) for hz in WRIST_HZ}
    columns = {}
    for name, signal in signals.items():
        late = np.tensordot(signal, equation.modes.smooth, axes=(1, 1))
        for i, n in enumerate(half_sphere(INNER_DIRECTIONS)):
            along = np.tensordot(late, n, axes=(1, 0))
            columns[f"{name} {i}"] = n[None, :, None] * along[:, None]
    return columns


def half_sphere(count: int) -> FloatArray:
    """Unit vectors evenly over half a sphere: a spiral of the golden angle.

    Parameters
    ----------
    count : int

    Returns
    -------
    (count, 3)
    """
    steps = np.arange(count) + 0.5
    z, turn = steps / count, np.pi * (1 + np.sqrt(5.0)) * steps
    level = np.sqrt(1 - z**2)
    return np.stack([level * np.cos(turn), level * np.sin(turn), z], axis=1)


def _slow(x: FloatArray, hz: float, rate_hz: float) -> tuple[FloatArray, FloatArray]:
    """What a mode at rest makes of a displacement (T, S, d), and its rate of change.

    A low-pass of the second order.
    """
    w = 2 * np.pi * hz
    A = np.array([[0.0, 1.0], [-(w**2), -2 * INNER_DAMPING * w]])
    values, vectors = np.linalg.eig(A)
    step = ((vectors * np.exp(values / rate_hz)) @ np.linalg.inv(vectors)).real
    push = np.linalg.solve(A, step - np.eye(2)) @ np.array([0.0, w**2])
    out, state = np.zeros((2, *x.shape)), np.zeros((2, len(x), x.shape[2]))
    for n in range(1, x.shape[1]):
        middle = (x[:, n] + x[:, n - 1]) / 2
        state = np.tensordot(step, state, axes=1) + push[:, None, None] * middle
        out[:, :, n] = state
    return out[0], out[1]


def _carried(x: FloatArray, hz: float, rate_hz: float) -> FloatArray:
    """The second derivative of what `_slow` makes, from the mode's equation."""
    w, (place, speed) = 2 * np.pi * hz, _slow(x, hz, rate_hz)
    return np.asarray(w**2 * (x - place) - 2 * INNER_DAMPING * w * speed)
