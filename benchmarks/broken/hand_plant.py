"""A hand of our own on a manipulandum: linear or not, reflexes, a person who answers, any motion.

The robot is stiff: it imposes a bump, the hand's force follows from the motion alone. Written apart
from the simulators of the toolkit.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import pandas as pd
from broken.cell import Made, seeds_of

from armimpedance.core.conventions import element_names
from armimpedance.core.records import Recording, Subject

RATE_HZ = 1000.0
M = np.array([[1.731, -0.655], [-0.655, 1.001]])
B = np.array([[8.63, -6.40], [-6.40, 13.86]])
K = np.array([[104.8, -74.4], [-74.4, 179.3]])
HANDLE_KG = 0.164
PLACE_M = (-0.14, 0.43)
REST_S, AFTER_S = 0.35, 0.3


@dataclass(frozen=True)
class Hand:
    """What the hand does beside the linear law, and what the robot does; SI units.

    Attributes
    ----------
    amplitude_m, duration_s, returns : float, float, bool
    reflex, delay_s : float
        Part of K that answers late.
    reflex_rate_s, muscle_s : float
        The same of the velocity, times K; and the time constant of the muscle, critically damped
        of second order, through which both answer.
    cubic : float
        N/m per square metre, along the displacement.
    friction_N : float
        ``friction v / |v|``, of handle or seat.
    answers_N, from_s : float
        Somebody pushes back along the bump, rising within .15 s from this time after the onset.
    drift_N_s : float
        The sensor's.
    jitter_s : float
        Error of the onsets in the table (sd).
    heavier : float
        Times the limb's inertia.
    in_sets : bool
        All conditions in each set, as a session is made; else one condition after the other.
    """

    amplitude_m: float = 0.005
    duration_s: float = 0.3
    returns: bool = True
    reflex: float = 0.0
    delay_s: float = 0.055
    reflex_rate_s: float = 0.0
    muscle_s: float = 0.0
    cubic: float = 0.0
    friction_N: float = 0.0
    answers_N: float = 0.0
    from_s: float = 0.12
    jitter_s: float = 0.0
    sets: int = 2
    conditions: tuple[str, ...] = ("relaxed",)
    stiffer: tuple[float, ...] = field(default=(1.0,))
    heavier: float = 1.0
    in_sets: bool = False

    @property
    def truth(self) -> dict[str, float]:
        """Elements of M (without the handle), B and K."""
        names = [n for symbol in "MBK" for n in element_names(symbol, 2)]
        values = np.concatenate([self.heavier * M.ravel(), B.ravel(), K.ravel()])
        return dict(zip(names, map(float, values), strict=True))

    def record(self, index: int, stream: str = "hand") -> Made:
        """One session; the same noise for every hand of this stream and index."""
        rng = seeds_of(stream, index)
        t = np.arange(-REST_S, self.duration_s + AFTER_S, 1 / RATE_HZ)
        trials, labels = 8 * self.sets, []
        positions, forces, angles = [], [], []
        for name, factor in zip(self.conditions, self.stiffer, strict=True):
            for trial in range(trials):
                angle = trial * np.pi / 4
                u = np.array([np.cos(angle), np.sin(angle)])
                x, f = self._trial(rng, t, u, factor)
                positions.append(x)
                forces.append(f)
                angles.append(45.0 * (trial % 8))
                labels.append(name)
        count, n = len(labels), len(t)
        onset = REST_S + self.jitter_s * rng.standard_normal(count)
        table = pd.DataFrame(
            {
                "trial": np.arange(1, count + 1),
                "condition": labels,
                "set": np.arange(count) // 8 + 1,
                "direction_deg": angles,
                "onset_s": onset,
                "end_s": onset + self.duration_s,
            }
        )
        record = Recording(
            kind="hand",
            sample_rate_hz=RATE_HZ,
            trials=table,
            offsets=n * np.arange(count + 1),
            time_s=np.tile(np.arange(n) / RATE_HZ, count),
            position=np.concatenate(positions),
            force=np.concatenate(forces),
            handle_mass_kg=HANDLE_KG,
            shoulder_m=np.zeros(2),
            subject=Subject("own hand", 70.0, 1.75, 0.31, 0.35),
        )
        return Made(self._in_sets(record) if self.in_sets else record, self.truth)

    def _in_sets(self, record: Recording) -> Recording:
        """The trials set by set, numbered anew."""
        each = len(record.trials) // len(self.conditions)
        order = np.argsort(np.arange(record.n_trials) % each // 8, kind="stable")
        record = record.select(order)
        count = np.arange(record.n_trials)
        both = count // (8 * len(self.conditions)) + 1
        return replace(record, trials=record.trials.assign(trial=count + 1, set=both))

    def _trial(
        self, rng: np.random.Generator, t: np.ndarray, u: np.ndarray, factor: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Position and force (S, 2), encoder and sensor included."""
        x, v, a = (self.amplitude_m * s for s in bump(t, self.duration_s, self.returns))
        before = self.amplitude_m * bump(t - self.delay_s, self.duration_s, self.returns)
        late = through_muscle(
            self.reflex * before[0] + self.reflex_rate_s * before[1], self.muscle_s
        )
        answer = self.answers_N * np.clip((t - self.from_s) / 0.15, 0, 1)
        along = self.cubic * x**3 + self.friction_N * np.tanh(v / 1e-3) + answer
        limb = np.outer(a, self.heavier * M @ u + HANDLE_KG * u)
        limb += np.outer(v, np.sqrt(factor) * B @ u)
        limb += np.outer(x + late, factor * K @ u)
        force = -limb - np.outer(along, u) + unsteady(rng, t)
        position = np.outer(x, u) + PLACE_M + rng.uniform(0, 2e-5, 2)
        force += rng.normal(0, 0.03, force.shape)
        return np.round(position / 2e-5) * 2e-5, np.round(force / 0.05) * 0.05


def bump(t: np.ndarray, duration: float, returns: bool = True) -> np.ndarray:
    """Minimum-jerk way out and back (or out alone): displacement, velocity, acceleration."""
    half = duration / 2 if returns else duration
    out = step(t / half)
    back = step((t - half) / half) if returns else np.zeros_like(out)
    return np.asarray((out - back) / np.array([1, half, half**2])[:, None])


def step(p: np.ndarray) -> np.ndarray:
    """Minimum-jerk step from 0 to 1 with its derivatives, (3, S)."""
    p = np.clip(p, 0, 1)
    return np.stack(
        [
            10 * p**3 - 15 * p**4 + 6 * p**5,
            30 * p**2 - 60 * p**3 + 30 * p**4,
            60 * p - 180 * p**2 + 120 * p**3,
        ]
    )


def through_muscle(signal: np.ndarray, muscle_s: float) -> np.ndarray:
    """A nerve's signal (S,) as the muscle's force follows it, from rest."""
    from scipy.signal import lfilter

    share = 1.0 if muscle_s == 0 else 1 - np.exp(-1 / (RATE_HZ * muscle_s))
    for _ in range(2):
        signal = lfilter([share], [1, share - 1], signal)
    return np.asarray(signal)


def unsteady(rng: np.random.Generator, t: np.ndarray) -> np.ndarray:
    """Tremor at 9 Hz (.08 N) and slow voluntary force (.25 N, .4 s), (S, 2)."""
    from scipy.signal import lfilter

    phase = rng.uniform(0, 2 * np.pi, 2)
    tremor = 0.08 * np.sqrt(2) * np.sin(2 * np.pi * 9.0 * t[:, None] + phase)
    keep = np.exp(-1 / (RATE_HZ * 0.4))
    white = rng.normal(0, 0.25, (len(t), 2))
    white[1:] *= np.sqrt(1 - keep**2)
    return np.asarray(tremor + lfilter([1.0], [1.0, -keep], white, axis=0))
