"""A forearm let go below an elbow that is held: an equation of our own, filmed with noise.

    J q'' = -(k (q - q_r) + h q' + f sign(q')) - m g c sin q + own(t)

Somebody who does not quite let go helps or hinders for half a second in every swing.
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
    """

    k: float = 2.0
    h: float = 0.04
    f: float = 0.02
    q_r: float = 1.0
    own_Nm: float = 0.0
    own_s: float = 0.5
    noise_rad: float = 2e-3

    def record(self, index: int) -> Made:
        """One record, and what is true of it."""
        rng = seeds_of("forearm", index)
        frames, trials, rate, fine = 300, 3, 60.0, 16
        step = 1 / (rate * fine)
        q = rng.uniform(-0.4, -0.1, trials)
        v = np.zeros(trials)
        begins = rng.uniform(0.2, 2.0, trials)
        size = self.own_Nm * rng.choice([-1.0, 1.0], trials)
        J = INERTIA + MASS * CENTRE**2

        def faster(t: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
            inside = np.clip((t - begins) / self.own_s, 0, 1)
            own = size * np.sin(np.pi * inside) ** 2
            passive = self.k * (q - self.q_r) + self.h * v + self.f * np.tanh(v / 0.005)
            return (own - passive - MASS * GRAVITY_M_S2 * CENTRE * np.sin(q)) / J

        rows = [q]
        for i in range(fine * (frames - 1)):
            t = i * step
            k1 = faster(t, q, v)
            k2 = faster(t + step / 2, q + step / 2 * v, v + step / 2 * k1)
            k3 = faster(t + step / 2, q + step / 2 * v + step**2 / 4 * k1, v + step / 2 * k2)
            k4 = faster(t + step, q + step * v + step**2 / 2 * k2, v + step * k3)
            q = q + step * v + step**2 / 6 * (k1 + k2 + k3)
            v = v + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
            if (i + 1) % fine == 0:
                rows.append(q)
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
