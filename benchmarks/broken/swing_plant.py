"""A forearm let go below an elbow that is held: an equation of our own, filmed with noise.

    J q'' = -(k (q - q_r) + h q' + d |q'| q' + f law(q')) - m g c sin q + own(t)

The law of dry friction is the sign; or more at rest than in motion (``1 + s exp(-|q'| / v_s)``
times the sign); or a bristle that has to be bent before it slides (``z' = q' - |q'| z / z_s``,
``z / z_s`` in place of the sign), as relaxed muscle is stiff over its first degrees. Somebody who
does not quite let go helps or hinders for half a second in every swing.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from broken.cell import Made, seeds_of

from armimpedance.core.motion import MotionRecording
from armimpedance.core.skeleton import GRAVITY_M_S2

sys.path.append(str(Path(__file__).resolve().parents[2] / "tests"))
from swinging_forearm import CENTRE, INERTIA, MASS, SKELETON


@dataclass(frozen=True)
class Forearm:
    """Three swings of 5 s at 60 frames/s.

    Attributes
    ----------
    own_Nm : float
        Peak of the person's own torque, one bump a swing with any sign.
    own_s : float
        How long it lasts.
    drag : float
        d, N m s^2/rad^2: damping that grows with the square of the velocity.
    sticks : float
        s, what friction at rest exceeds that of motion by, a fraction; v_s is .1 rad/s.
    bristle_rad : float
        z_s; 0: the sign.
    """

    k: float = 2.0
    h: float = 0.04
    f: float = 0.02
    q_r: float = 1.0
    own_Nm: float = 0.0
    own_s: float = 0.5
    noise_rad: float = 2e-3
    drag: float = 0.0
    sticks: float = 0.0
    bristle_rad: float = 0.0

    def record(self, index: int) -> Made:
        """One record, and what is true of it."""
        rng = seeds_of("forearm", index)
        frames, trials, rate, fine = 300, 3, 60.0, 16
        step = 1 / (rate * fine)
        q = rng.uniform(-0.4, -0.1, trials)
        state = np.stack([q, np.zeros(trials), np.zeros(trials)])
        begins = rng.uniform(0.2, 2.0, trials)
        size = self.own_Nm * rng.choice([-1.0, 1.0], trials)

        def rate_of(t: float, state: np.ndarray) -> np.ndarray:
            inside = np.clip((t - begins) / self.own_s, 0, 1)
            return self._rates(state, size * np.sin(np.pi * inside) ** 2)

        rows = [q]
        for i in range(fine * (frames - 1)):
            t = i * step
            k1 = rate_of(t, state)
            k2 = rate_of(t + step / 2, state + step / 2 * k1)
            k3 = rate_of(t + step / 2, state + step / 2 * k2)
            k4 = rate_of(t + step, state + step * k3)
            state = state + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
            if (i + 1) % fine == 0:
                rows.append(state[0])
        coordinates = np.zeros((frames * trials, 7))
        coordinates[:, 6] = np.array(rows).T.ravel()
        coordinates[:, 6] += self.noise_rad * rng.standard_normal(frames * trials)
        coordinates[:, [0, 2]] += 3e-4 * rng.standard_normal((frames * trials, 2))
        record = MotionRecording(
            sample_rate_hz=rate,
            trials=pd.DataFrame({"trial": np.arange(trials) + 1, "condition": "swing"}),
            offsets=frames * np.arange(trials + 1),
            time_s=np.tile(np.arange(frames) / rate, trials),
            coordinates=coordinates,
            skeleton=SKELETON,
        )
        return Made(record, {name: getattr(self, name) for name in ("k", "h", "f", "q_r")})

    def _rates(self, state: np.ndarray, own: np.ndarray) -> np.ndarray:
        """Rates (3, T) of angle, velocity and bristle under the person's torque (T,)."""
        q, v, z = state
        sign = np.tanh(v / 0.005) * (1 + self.sticks * np.exp(-np.abs(v) / 0.1))
        if self.bristle_rad:
            sign = z / self.bristle_rad
        passive = self.k * (q - self.q_r) + (self.h + self.drag * np.abs(v)) * v + self.f * sign
        weight = MASS * GRAVITY_M_S2 * CENTRE * np.sin(q)
        bent = v - np.abs(v) * z / self.bristle_rad if self.bristle_rad else 0.0 * z
        return np.stack([v, (own - passive - weight) / (INERTIA + MASS * CENTRE**2), bent])
