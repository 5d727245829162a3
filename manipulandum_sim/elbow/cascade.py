"""A joint of two pathways in a stiff position servo: intrinsic, and a reflex with a course.

``tau = I theta'' + B(t) theta' + K(t) theta + G(t) f(t) + v + offset(t)``, where f is the joint's
velocity of `delay_s` ago, linear or rectified, behind a critically damped low-pass. The angle is
imposed, so nothing is fed back and the torque is exact at every sample.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
import pandas as pd

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.records import Recording, Subject
from manipulandum_sim.elbow.bench import noisy
from manipulandum_sim.elbow.device import RATE_HZ
from manipulandum_sim.elbow.servo import coloured

#: A constant, or a function of time: (S,) s -> (S,).
Course = float | Callable[[FloatArray], FloatArray]
Side = Literal["both", "positive", "negative"]

#: Low-passes of the imposed angle and of the subject's own torque: Hz, order.
ANGLE_HZ: Final = (6.0, 3)
OWN_HZ: Final = (2.0, 1)


@dataclass(frozen=True)
class Reflex:
    """The reflex pathway of `simulate_cascade`.

    Attributes
    ----------
    gain : Course
        N m s/rad.
    delay_s : float
    cutoff_hz : float
        Of the low-pass, whose poles are all alike.
    order : {1, 2}
    side : {"both", "positive", "negative"}
        Which velocities it answers.
    """

    gain: Course
    delay_s: float = 0.04
    cutoff_hz: float = 6.0
    order: Literal[1, 2] = 2
    side: Side = "positive"


@dataclass(frozen=True)
class CascadeTruth:
    """Truth of T equal trials of S samples: inertia, courses (S,), torque without noise (T, S)."""

    I: float  # noqa: E741
    B: FloatArray
    K: FloatArray
    G: FloatArray
    torque: FloatArray


def simulate_cascade(
    inertia: float,
    viscosity: Course,
    stiffness: Course,
    reflex: Reflex | None = None,
    *,
    offset: Course = 0.0,
    own_Nm: float = 0.0,
    angle_rms: float = 0.03,
    duration_s: float = 60.0,
    trials: int = 1,
    snr_db: float | tuple[float | None, float | None] | None = 30.0,
    seed: int = 0,
) -> tuple[Recording, CascadeTruth]:
    """Random angles imposed on a joint whose intrinsic and reflex parts have courses.

    Parameters
    ----------
    inertia : float
        kg m^2.
    viscosity, stiffness : float, or functions of time
        N m s/rad, N m/rad.
    reflex : Reflex, optional
    offset : float, or a function of time
        Torque that the subject holds, N m on the limb.
    own_Nm : float
        Root mean square of a further torque of the subject's own, low-passed at 2 Hz.
    angle_rms : float
        rad.
    duration_s : float
    trials : int
        All with the same courses, each with an angle of its own: realizations.
    snr_db : float, (torque, angle) or None
        White noise, dB of power.
    seed : int

    Returns
    -------
    (Recording, CascadeTruth)
        Kind "joint", position imposed, interaction torque by the limb (minus the one on it).

    Raises
    ------
    InputError
        Sizes that cannot be.
    """
    if not (inertia > 0 and angle_rms > 0 and duration_s > 0 and trials >= 1 and own_Nm >= 0):
        raise InputError(
            f"inertia {inertia}, angle {angle_rms} rad, {trials} trials of {duration_s} s",
            expected="positive numbers",
        )
    samples = round(duration_s * RATE_HZ)
    time = np.arange(samples) / RATE_HZ
    B, K, held = (_course(c, time) for c in (viscosity, stiffness, offset))
    G = _course(reflex.gain if reflex else 0.0, time)
    generators = [np.random.default_rng(s) for s in np.random.SeedSequence(seed).spawn(trials)]
    angles, torques = [], []
    for rng in generators:
        period = samples + round(4 * RATE_HZ)
        s = 2j * np.pi * np.fft.rfftfreq(period, 1 / RATE_HZ)
        theta = coloured(rng, s, period, *ANGLE_HZ) * angle_rms / (1 + s * 0.004) ** 2
        x, v, a = (np.fft.irfft(theta * s**k, period)[:samples] for k in range(3))
        torque = inertia * a + B * v + K * x + held
        if reflex is not None:
            torque += G * _answer(np.fft.irfft(theta * s, period), s, reflex)[:samples]
        if own_Nm:
            torque += own_Nm * np.fft.irfft(coloured(rng, s, period, *OWN_HZ), period)[:samples]
        angles.append(x)
        torques.append(torque)
    levels = snr_db if isinstance(snr_db, tuple) else (snr_db, snr_db)
    exact = np.stack(torques)
    torque, angle = (
        noisy(c, d, generators) for c, d in zip((exact, np.stack(angles)), levels, strict=True)
    )
    return _recording(torque, angle, time), CascadeTruth(inertia, B, K, G, exact)


def _recording(torque: FloatArray, angle: FloatArray, time: FloatArray) -> Recording:
    """Torque on the limb and angle, (trials, samples)."""
    trials, samples = torque.shape
    return Recording(
        kind="joint",
        sample_rate_hz=RATE_HZ,
        trials=pd.DataFrame({"trial": range(1, trials + 1), "condition": "servo"}),
        offsets=samples * np.arange(trials + 1),
        time_s=np.tile(time, trials),
        position=angle.reshape(-1, 1),
        force=-torque.reshape(-1, 1),
        perturbation="stochastic",
        torque="interaction",
        imposed="position",
        subject=Subject(id="cascade"),
        provenance=("simulated joint of two pathways in a position servo",),
    )


def _course(given: Course, time_s: FloatArray) -> FloatArray:
    return np.array(
        np.broadcast_to(given(time_s) if callable(given) else given, time_s.shape), float
    )


def _answer(rate: FloatArray, s: np.ndarray, reflex: Reflex) -> FloatArray:
    """The low-passed velocity of a while ago over a whole period, (S,)."""
    sided = {"both": rate, "positive": np.maximum(rate, 0), "negative": np.minimum(rate, 0)}
    lag = (1 + s / (2 * np.pi * reflex.cutoff_hz)) ** -float(reflex.order)
    late = np.fft.rfft(sided[reflex.side]) * lag * np.exp(-s * reflex.delay_s)
    return np.asarray(np.fft.irfft(late, len(rate)))
