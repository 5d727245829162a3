"""Joints, devices and persons of our own, written apart from the simulators of the toolkit.

Linear ones are solved line by line: all signals are periodic over a time longer than the record,
``(I s^2 + B s + K + (R + Q s) e^(-s d) / (1 + s m)^n) theta = tau + v`` with s = i omega, tau the
torque of the device on the limb and v the person's own; the device ``tau = p - Z_d theta`` adds the
perturbation p. The non-linear ones are integrated by Runge's and Kutta's step, all records side by
side.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
from broken.cell import Made, seeds_of

from armimpedance.core.records import Recording, Subject

RATE_HZ = 1000.0
#: The signals repeat after so many seconds more than the record lasts.
AROUND_S = 2.384


@dataclass(frozen=True)
class Joint:
    """A limb, what holds it, and how both are recorded; SI units.

    Attributes
    ----------
    I, B, K : float
    reflex, delay_s : float
        Torque per delayed angle, N m/rad.
    reflex_rate : float
        Torque per delayed velocity, N m s/rad.
    muscle_s, muscle_order : float, int
        Time constant and order of the low-pass by which muscle follows its reflex.
    device : (inertia, viscosity, stiffness) or None
        None: the torque is imposed; infinite stiffness: the angle is.
    rms_Nm, rms_rad, cutoff_hz : float
        Of the imposed torque or angle.
    own_Nm : float
        Rms of the person's own torque, slow (1 Hz).
    late_s : float
        By which the angle's channel lags behind the torque's.
    snr_db : float
        Of both channels.
    tells : bool
        Whether the perturbation (or the commanded angle) is recorded.
    """

    I: float = 0.07  # noqa: E741
    B: float = 1.2
    K: float = 20.0
    reflex: float = 0.0
    delay_s: float = 0.055
    reflex_rate: float = 0.0
    muscle_s: float = 0.0
    muscle_order: int = 2
    device: tuple[float, float, float] | None = None
    rms_Nm: float = 1.0
    rms_rad: float = 0.04
    cutoff_hz: float = 10.0
    own_Nm: float = 0.0
    late_s: float = 0.0
    snr_db: float = 30.0
    tells: bool = True
    duration_s: float = 10.0
    trials: int = 1

    @property
    def truth(self) -> dict[str, float]:
        """What `elbow` prints."""
        return {"I": self.I, "B": self.B, "K": self.K}

    def record(self, index: int, stream: str = "joint") -> Made:
        """One record; the same numbers for every joint of the same stream and index."""
        rng = seeds_of(stream, index)
        samples = round(self.duration_s * RATE_HZ)
        around = samples + round(AROUND_S * RATE_HZ)
        parts = [self._trial(rng, around)[:, :samples] for _ in range(self.trials)]
        tau, theta, told = np.concatenate(parts, axis=1)
        return Made(recorded(self, tau, theta, told, samples), self.truth)

    def _trial(self, rng: np.random.Generator, n: int) -> np.ndarray:
        """Torque on the limb, angle, what was imposed, (3, n), noise added."""
        s = 2j * np.pi * np.fft.rfftfreq(n, 1 / RATE_HZ)
        muscle = np.exp(-s * self.delay_s) / (1 + s * self.muscle_s) ** self.muscle_order
        limb = self.I * s**2 + self.B * s + self.K + (self.reflex + self.reflex_rate * s) * muscle
        pushed, own = noise(rng, s, self.cutoff_hz), self.own_Nm * noise(rng, s, 1.0, order=1)
        if self.device is not None and np.isinf(self.device[2]):
            theta = told = self.rms_rad * pushed
            tau = limb * theta - own
        else:
            inertia, viscosity, stiffness = self.device or (0.0, 0.0, 0.0)
            held = inertia * s**2 + viscosity * s + stiffness
            told = self.rms_Nm * pushed
            theta = (told + own) / (limb + held)
            tau = told - held * theta
        theta = theta * np.exp(-s * self.late_s)
        clear = np.stack([np.fft.irfft(x, n) for x in (tau, theta, told)])
        level = 10 ** (-self.snr_db / 20) * clear[:2].std(axis=1, keepdims=True)
        clear[:2] += level * rng.standard_normal((2, n))
        return np.asarray(clear)


def noise(rng: np.random.Generator, s: np.ndarray, cutoff_hz: float, order: int = 4) -> np.ndarray:
    """Spectrum of periodic noise of unit rms behind a Butterworth low-pass."""
    n = 2 * (len(s) - 1)
    white = np.fft.rfft(rng.standard_normal(n))
    shape = 1 / np.sqrt(1 + (np.abs(s) / (2 * np.pi * cutoff_hz)) ** (2 * order))
    made = white * shape
    made[0] = 0
    return np.asarray(made / np.fft.irfft(made, n).std())


def recorded(
    joint: Joint, tau: np.ndarray, theta: np.ndarray, told: np.ndarray, samples: int
) -> Recording:
    """The recording of equal trials, torque by the limb."""
    trials = len(tau) // samples
    by_angle = joint.device is not None and np.isinf(joint.device[2])
    name = "q1_command_rad" if by_angle else "tau1_perturbation_Nm"
    return Recording(
        kind="joint",
        sample_rate_hz=RATE_HZ,
        trials=pd.DataFrame({"trial": range(1, trials + 1), "condition": "held"}),
        offsets=samples * np.arange(trials + 1),
        time_s=np.tile(np.arange(samples) / RATE_HZ, trials),
        position=theta[:, None],
        force=-tau[:, None],
        perturbation="stochastic",
        torque="interaction",
        subject=Subject(id="own plant"),
        extra={name: told} if joint.tells else {},
    )


def linear(joint: Joint, stream: str = "joint") -> Any:
    """A maker of records of a linear joint."""
    return lambda indices: [joint.record(i, stream) for i in indices]


@dataclass(frozen=True)
class Bent:
    """What makes a joint non-linear or restless; the torque is imposed.

    Attributes
    ----------
    cubic : float
        N m/rad^3, added to the elastic torque.
    friction : float
        N m, ``friction tanh(rate / .02)``.
    swing : float
        K goes up and down by this part at .2 Hz.
    step : float
        K steps up by this part half-way.
    one_way : float
        N m s/rad: a reflex that answers rising angles alone, by the joint's delay and muscle.
    """

    cubic: float = 0.0
    friction: float = 0.0
    swing: float = 0.0
    step: float = 0.0
    one_way: float = 0.0


def bent(joint: Joint, how: Bent, stream: str = "joint") -> Any:
    """A maker of records of a non-linear joint; K and B are those of small motions at the start."""

    def make(indices: Sequence[int]) -> list[Made]:
        samples = round(joint.duration_s * RATE_HZ)
        n = samples + round(AROUND_S * RATE_HZ)
        rngs = [seeds_of(stream, i) for i in indices]
        s = 2j * np.pi * np.fft.rfftfreq(n, 1 / RATE_HZ)
        pushed = [joint.rms_Nm * noise(r, s, joint.cutoff_hz) for r in rngs]
        own = [joint.own_Nm * noise(r, s, 1.0, order=1) for r in rngs]
        told, driven = (
            np.stack([np.fft.irfft(x, n) for x in spectra], axis=1)
            for spectra in (pushed, [p + o for p, o in zip(pushed, own, strict=True)])
        )
        theta = integrate(joint, how, driven)
        kept = slice(n - samples, n)
        tau, theta, told = told[kept], theta[kept], told[kept]
        level = 10 ** (-joint.snr_db / 20)
        made = []
        for k, rng in enumerate(rngs):
            seen = [
                x[:, k] + level * x[:, k].std() * rng.standard_normal(samples) for x in (tau, theta)
            ]
            record = recorded(replace(joint, trials=1), *seen, told[:, k], samples)
            made.append(Made(record, joint.truth, courses(joint, how)))
        return made

    return make


def stiffness_at(joint: Joint, how: Bent, time_s: np.ndarray) -> np.ndarray:
    """K over the record's own clock."""
    stepped = how.step * (time_s >= joint.duration_s / 2)
    return joint.K * (1 + how.swing * np.sin(2 * np.pi * 0.2 * time_s) + stepped)


def courses(joint: Joint, how: Bent) -> np.ndarray:
    """K at the record's samples."""
    return stiffness_at(joint, how, np.arange(round(joint.duration_s * RATE_HZ)) / RATE_HZ)


def integrate(joint: Joint, how: Bent, driven: np.ndarray) -> np.ndarray:
    """Angles (n, T) under torques (n, T), two steps a sample."""
    n, h = len(driven), 0.5 / RATE_HZ
    clock = np.arange(2 * n + 2) * h - (n / RATE_HZ - joint.duration_s)
    K = stiffness_at(joint, how, clock)
    finer = np.repeat(driven, 2, axis=0)
    finer[1:-1:2] = (driven[:-1] + driven[1:]) / 2
    theta, rate = np.zeros(driven.shape[1]), np.zeros(driven.shape[1])
    out, rates = np.empty_like(driven), np.zeros_like(driven)
    late, answer = round(joint.delay_s * RATE_HZ), np.zeros((2, driven.shape[1]))
    follows = np.exp(-h / joint.muscle_s) if joint.muscle_s else 0.0

    def pull(k: int, push: np.ndarray, x: np.ndarray, v: np.ndarray) -> np.ndarray:
        against = joint.B * v + (K[k] + how.cubic * x * x) * x
        if how.friction:
            against = against + how.friction * np.tanh(v / 0.02)
        if how.one_way:
            against = against + answer[1]
        return np.asarray((push - against) / joint.I)

    for k in range(n):
        out[k], rates[k] = theta, rate
        heard = how.one_way * np.maximum(rates[k - late], 0.0)
        j = 2 * k
        for at in (j, j + 1):
            for stage, into in enumerate((heard, answer[0].copy())):
                answer[stage] = into + follows * (answer[stage] - into)
            push, after = finer[at], finer[min(at + 1, 2 * n - 1)]
            half = (push + after) / 2
            a1 = pull(at, push, theta, rate)
            a2 = pull(at, half, theta + h / 2 * rate, rate + h / 2 * a1)
            v2 = rate + h / 2 * a1
            a3 = pull(at, half, theta + h / 2 * v2, rate + h / 2 * a2)
            v3 = rate + h / 2 * a2
            a4 = pull(at + 1, after, theta + h * v3, rate + h * a3)
            theta = theta + h / 6 * (rate + 2 * v2 + 2 * v3 + rate + h * a3)
            rate = rate + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
    return out


def naive_joint(made: Made) -> dict[str, float]:
    """I, B, K by least squares of the torque's spectrum over the angle's, .5 to 10 Hz."""
    record = made.record
    sums, right = np.zeros((3, 3)), np.zeros(3)
    for first, last in zip(record.offsets, record.offsets[1:], strict=False):
        taper = np.hanning(last - first)
        theta, tau = (
            np.fft.rfft(taper * (x - x.mean()))
            for x in (record.position[first:last, 0], -record.force[first:last, 0])
        )
        hertz = np.fft.rfftfreq(last - first, 1 / record.sample_rate_hz)
        inside = (hertz > 0.5) & (hertz < 10)
        s = 2j * np.pi * hertz[inside]
        columns = np.stack([s**2, s, np.ones_like(s)], axis=1) * theta[inside, None]
        sums += (columns.conj().T @ columns).real
        right += (columns.conj().T @ tau[inside]).real
    return dict(zip("IBK", np.linalg.solve(sums, right), strict=True))
