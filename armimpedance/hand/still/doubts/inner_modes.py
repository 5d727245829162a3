"""Inner modes: impedance of a hand with a joint whose angle the hand's position does not fix.

With one inner coordinate s, its natural frequency w and damping ratio z, the hand's impedance is

    Z(p) = M p^2 + B p + K_h - (b p + k)(b p + k)^T / m (p^2 + 2 z w p + w^2),   p = i omega,

k and b are the effects of a displacement and a velocity of s on the hand (s is chosen such that no
inertia couples them). At rest ``K = K_h - k k^T / (m w^2)``, which is the stiffness to be
estimated. The term in addition to M, B and K is

    S n n^T g(p),   g = 1 - (1 + r p)^2 / (1 + t p + p^2 / w^2),   t = 2 z / w,

n along k, b = r k. If the damping of a joint is in proportion to its stiffness, as that of muscles
is, r = t; if nothing damps between s and the hand, r = 0. A free wrist carries a mass m along while
the hand is slow, ``m n n^T p^2 / (1 + t p + p^2 / w^2)``: forearm and hand turn about a handle on a
ball joint with a few Hz. M and B of such a limb are those of slow motion.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from armimpedance.core.arrays import FloatArray

#: Natural frequencies (Hz), damping ratios and r / t that are tried, and how many directions.
INNER_HZ: Final = (1.5, 2.1, 3.0, 4.2, 6.0)
INNER_DAMPING: Final = (0.2, 0.4, 0.8, 1.6)
COUPLED: Final = (0.0, 1.0)
INNER_DIRECTIONS: Final = 64
#: Natural frequencies (Hz) and damping ratio of the mass that a free wrist carries along in slow
#: motion.
WRIST_HZ: Final = (3.0, 5.0, 8.0)
WRIST_DAMPING: Final = 0.5


@dataclass(frozen=True)
class InnerMode:
    """An inner mode: natural frequency and damping ratio.

    `coupled`: r / t. `carried`: True if a free wrist carries a mass, False for a stiffness.
    """

    hz: float
    damping: float
    coupled: float = 0.0
    carried: bool = False

    @property
    def _parts(self) -> tuple[float, float, float]:
        """g x as a sum of x, of ``x_slow = x / (1 + t p + p^2 / w^2)``, and of its velocity."""
        w = 2 * np.pi * self.hz
        t = 2 * self.damping / w
        if self.carried:
            return w**2, -(w**2), -(w**2) * t
        r = self.coupled * t
        # (1 + r p)^2 = q (1 + t p + p^2 / w^2) + (1 - q) + (2 r - q t) p
        q = (r * w) ** 2
        return 1 - q, -(1 - q), -(2 * r - q * t)

    @property
    def slow(self) -> tuple[float, float]:
        """Slope (s) and curvature (s^2) of g at p = 0: the part of g in B and M of slow motion."""
        if self.carried:
            return 0.0, 1.0
        w = 2 * np.pi * self.hz
        t = 2 * self.damping / w
        r = self.coupled * t
        return t - 2 * r, 1 / w**2 - (r - t) ** 2

    def response(self, p: NDArray[np.complex128]) -> NDArray[np.complex128]:
        """g at complex frequencies p, rad/s."""
        w = 2 * np.pi * self.hz
        direct, place, velocity = self._parts
        slow = 1 / (1 + 2 * self.damping / w * p + (p / w) ** 2)
        return np.asarray(direct + (place + velocity * p) * slow)

    def columns(self, x: FloatArray, smooth: FloatArray, rate_hz: float) -> FloatArray:
        """g x of displacements x (T, S, d) that begin at rest, in modes (n, S): (T, d, n)."""
        S = x.shape[1]
        direct, place, velocity = self._parts
        kernel = self._steps(S, rate_hz) @ np.array([place, velocity])
        midpoints = np.zeros_like(x)
        midpoints[:, 1:] = (x[:, 1:] + x[:, :-1]) / 2
        # sum_t f(t) sum_u h(u) x(t - u) = sum_v x(v) sum_u h(u) f(v + u)
        size = 1 << int(np.ceil(np.log2(2 * S)))
        spectrum = np.fft.rfft(smooth[:, ::-1], size, axis=1) * np.fft.rfft(kernel, size)
        delayed = np.fft.irfft(spectrum, size, axis=1)[:, :S][:, ::-1]
        own = np.tensordot(x, smooth, axes=(1, 1))
        return np.asarray(direct * own + np.tensordot(midpoints, delayed, axes=(1, 1)))

    def _steps(self, count: int, rate_hz: float) -> FloatArray:
        """x_slow and its velocity (count, 2) after an x of 1 that lasts one sample."""
        from scipy.linalg import expm

        w = 2 * np.pi * self.hz
        A = np.array([[0.0, 1.0], [-(w**2), -2 * self.damping * w]])
        step = expm(A / rate_hz)
        state = np.linalg.solve(A, step - np.eye(2)) @ np.array([0.0, w**2])
        out = np.empty((count, 2))
        for i in range(count):
            out[i] = state
            state = step @ state
        return out


INNER_MODES: Final = tuple(
    InnerMode(hz, damping, coupled)
    for hz in INNER_HZ
    for damping in INNER_DAMPING
    for coupled in COUPLED
)
WRIST_MODES: Final = tuple(InnerMode(hz, WRIST_DAMPING, carried=True) for hz in WRIST_HZ)


def modes_of(free_wrist: bool) -> tuple[InnerMode, ...]:
    """The inner modes that are tried."""
    return (*INNER_MODES, *(WRIST_MODES if free_wrist else ()))


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
