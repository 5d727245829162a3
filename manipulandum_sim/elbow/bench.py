"""A joint on a bench: torque in, angle out, parameters as one likes, noise of a stated level.

The smallest rig there is, for studies of a method alone: no exoskeleton, no loop, no EMG. The
torque is white noise behind a Butterworth low-pass, as in Ruiz (2011), section 4; the angle is
integrated on a grid four times finer than the samples, so that no hold is built in.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
import pandas as pd

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import perturbation_columns
from armimpedance.core.errors import InputError
from armimpedance.core.records import Recording, Subject
from manipulandum_sim.elbow.device import RATE_HZ

#: A constant, or a function of time: (S,) s -> (S,).
Course = float | Callable[[FloatArray], FloatArray]
FINER: Final = 4
ORDER: Final = 4
#: Seconds before the record in which the motion settles.
RUN_IN_S: Final = 2.0
#: Memory of the subject's own torque, s.
OWN_S: Final = 0.4


@dataclass(frozen=True)
class Departures:
    """By what a joint on the bench departs from one inertia, viscosity and stiffness.

    Attributes
    ----------
    answer : float
        Torque against the deflection of `delay_s` ago, N m/rad: a reflex.
    answer_rate : float
        Torque against the velocity of `delay_s` ago, N m s/rad.
    delay_s : float
    skew_s : float
        By how much the angle is recorded late.
    cubic : float
        Torque against the third power of the deflection, N m/rad^3.
    own_torque : float
        Rms of what the subject adds to the torque that moves the joint, and that no sensor holds,
        N m: an Ornstein-Uhlenbeck process of .4 s.
    """

    answer: float = 0.0
    answer_rate: float = 0.0
    delay_s: float = 0.055
    skew_s: float = 0.0
    cubic: float = 0.0
    own_torque: float = 0.0


@dataclass(frozen=True)
class BenchTruth:
    """Truth of a bench recording of T equal trials of S samples.

    Attributes
    ----------
    I : float
    B, K : (S,)
        Viscosity and stiffness at the samples; every trial has the same.
    torque, angle : (T, S)
        Without noise; the torque on the limb.
    """

    I: float  # noqa: E741
    B: FloatArray
    K: FloatArray
    torque: FloatArray
    angle: FloatArray


def simulate_bench(
    inertia: float,
    viscosity: Course,
    stiffness: Course,
    *,
    duration_s: float = 10.0,
    trials: int = 1,
    snr_db: float | tuple[float, float] | None = None,
    cutoff_hz: float = 10.0,
    torque_rms: float = 1.0,
    seed: int = 0,
    departures: Departures | None = None,
) -> tuple[Recording, BenchTruth]:
    """Random torque on a joint ``I theta'' + B(t) theta' + K(t) theta = tau``.

    Parameters
    ----------
    inertia, viscosity, stiffness : float, or functions of time for the latter two
        kg m^2, N m s/rad, N m/rad; time 0 is the first sample, the run-in before is at time < 0.
    duration_s : float
        Length of a trial.
    trials : int
    snr_db : float, (torque, angle) or None
        White noise is added to each channel at 1 kHz; dB of power, signal over noise, whole band.
    cutoff_hz : float
        Cut-off of the perturbation's low-pass.
    torque_rms : float
        N m.
    seed : int
    departures : Departures, optional
        What else the joint does; nothing by default.

    Returns
    -------
    (Recording, BenchTruth)
        Kind "joint", interaction torque by the limb (minus the one on it); the noise-free torque
        is in the column of the perturbation.

    Raises
    ------
    InputError
        A parameter that no joint has, a duration or cut-off out of range.
    """
    if not (inertia > 0 and duration_s > 0 and trials >= 1 and 0 < cutoff_hz < RATE_HZ / 2):
        raise InputError(
            f"inertia {inertia}, {duration_s} s, {trials} trials, {cutoff_hz} Hz",
            expected="positive numbers, a cut-off below 500 Hz",
        )
    run_in, samples = round(RUN_IN_S * RATE_HZ), round(duration_s * RATE_HZ)
    fine = np.arange(FINER * (run_in + samples)) / (FINER * RATE_HZ) - RUN_IN_S
    seeds = np.random.SeedSequence(seed).spawn(trials)
    generators = [np.random.default_rng(s) for s in seeds]
    torque = np.stack([_low_passed(g, len(fine), cutoff_hz) for g in generators]) * torque_rms
    B, K = _course(viscosity, fine), _course(stiffness, fine)
    departs = departures or Departures()
    own = departs.own_torque * _own_torque(len(fine), trials, seed)
    angle = _integrate(inertia, B, K, torque + own, departs)
    kept = slice(FINER * run_in, None, FINER)
    angle = _recorded_late(angle, departs.skew_s)[:, kept]
    torque, B, K = torque[:, kept], B[kept], K[kept]
    truth = BenchTruth(inertia, B, K, torque, angle)
    levels = snr_db if isinstance(snr_db, tuple) else (snr_db, snr_db)
    noisy_torque = noisy(torque, levels[0], generators)
    noisy_angle = noisy(angle, levels[1], generators)
    return _recorded(noisy_torque, noisy_angle, torque), truth


def _recorded(torque: FloatArray, angle: FloatArray, perturbation: FloatArray) -> Recording:
    """The recording of T trials of S samples from (T, S) channels."""
    trials, samples = torque.shape
    return Recording(
        kind="joint",
        sample_rate_hz=RATE_HZ,
        trials=pd.DataFrame({"trial": range(1, trials + 1), "condition": "bench"}),
        offsets=samples * np.arange(trials + 1),
        time_s=np.tile(np.arange(samples) / RATE_HZ, trials),
        position=angle.reshape(-1, 1),
        force=-torque.reshape(-1, 1),
        perturbation="stochastic",
        torque="interaction",
        subject=Subject(id="bench"),
        extra={perturbation_columns(1)[0]: perturbation.ravel()},
        provenance=("simulated joint on a bench",),
    )


def _course(given: Course, time_s: FloatArray) -> FloatArray:
    values = np.broadcast_to(given(time_s) if callable(given) else given, time_s.shape)
    if not (np.isfinite(values).all() and (values > 0).all()):
        raise InputError("viscosity or stiffness that is not positive", expected="positive numbers")
    return np.array(values, dtype=np.float64)


def _low_passed(rng: np.random.Generator, count: int, cutoff_hz: float) -> FloatArray:
    """White noise through a Butterworth low-pass, unit rms, (count,)."""
    from scipy.signal import butter, sosfilt

    sos = butter(ORDER, cutoff_hz, fs=FINER * RATE_HZ, output="sos")
    run_in = round(5 / cutoff_hz * FINER * RATE_HZ)
    noise = sosfilt(sos, rng.standard_normal(count + run_in))[run_in:]
    return np.asarray(noise / noise.std())


def _own_torque(count: int, trials: int, seed: int) -> FloatArray:
    """An Ornstein-Uhlenbeck process of unit rms at the fine steps, (T, count)."""
    from scipy.signal import lfilter

    rng = np.random.default_rng([seed, 1])
    keep = np.exp(-1 / (OWN_S * FINER * RATE_HZ))
    white = rng.standard_normal((trials, count)) * np.sqrt(1 - keep**2)
    white[:, 0] /= np.sqrt(1 - keep**2)
    return np.asarray(lfilter([1.0], [1.0, -keep], white, axis=1))


def _recorded_late(angle: FloatArray, skew_s: float) -> FloatArray:
    """The angle of a while ago at every other fine step, (T, S); the others stay empty."""
    if skew_s == 0:
        return angle
    from scipy.interpolate import CubicSpline

    at = np.arange(0, angle.shape[1], 2)
    late = np.zeros_like(angle)
    late[:, at] = CubicSpline(at, angle[:, at], axis=1)(at - skew_s * FINER * RATE_HZ)
    return late


def _integrate(
    inertia: float, B: FloatArray, K: FloatArray, torque: FloatArray, departs: Departures
) -> FloatArray:
    """Runge-Kutta of fourth order over pairs of fine steps; (T, S) angle on the fine grid."""
    answers = departs.answer != 0 or departs.answer_rate != 0
    if not answers and departs.cubic == 0:
        return _integrate_linear(inertia, B, K, torque)
    h = 2 / (FINER * RATE_HZ)
    theta, rate = np.zeros(len(torque)), np.zeros(len(torque))
    out, rates = np.zeros_like(torque), np.zeros_like(torque)
    # Past angles stand at every other fine step; between two of them their mean.
    ago = 2 * round(departs.delay_s * FINER * RATE_HZ / 2)

    def late(n: int) -> FloatArray | float:
        if not answers or n < ago + 2:
            return 0.0
        ends = [n - ago] if n % 2 == 0 else [n - ago - 1, n - ago + 1]
        past = [departs.answer * out[:, k] + departs.answer_rate * rates[:, k] for k in ends]
        return np.asarray(sum(past) / len(past))

    for n in range(0, torque.shape[1] - 2, 2):
        out[:, n], rates[:, n] = theta, rate

        def acceleration(half: int, x: FloatArray, v: FloatArray, n: int = n) -> FloatArray:
            at = n + half
            bends = departs.cubic * x**3
            return np.asarray((torque[:, at] - B[at] * v - K[at] * x - bends - late(at)) / inertia)

        theta, rate = _runge_kutta(acceleration, theta, rate, h)
    out[:, torque.shape[1] - 2 :] = theta[:, None]
    return out


def _integrate_linear(
    inertia: float, B: FloatArray, K: FloatArray, torque: FloatArray
) -> FloatArray:
    """The same of a joint without departures: all steps' matrices at once, then a recursion."""
    h, (trials, samples) = 2 / (FINER * RATE_HZ), torque.shape
    firsts = np.arange(0, samples - 2, 2)

    def stepped(given: FloatArray, theta: float, rate: float) -> FloatArray:
        """Response of each step alone to an initial state, (2, q, steps) for torques (q, S)."""

        def acceleration(half: int, x: FloatArray, v: FloatArray) -> FloatArray:
            at = firsts + half
            return np.asarray((given[:, at] - B[at] * v - K[at] * x) / inertia)

        begin = np.zeros((2, len(given), len(firsts)))
        begin += np.array([theta, rate])[:, None, None]
        return np.stack(_runge_kutta(acceleration, begin[0], begin[1], h))

    none = np.zeros((1, samples))
    step = np.concatenate([stepped(none, 1.0, 0.0), stepped(none, 0.0, 1.0)], axis=1)
    pushed = stepped(torque, 0.0, 0.0)
    out, state = np.zeros_like(torque), np.zeros((2, trials))
    for n, Phi, push in zip(
        firsts, np.moveaxis(step, 2, 0), np.moveaxis(pushed, 2, 0), strict=True
    ):
        out[:, n] = state[0]
        # (theta, rate) (2, T) = Phi (2, 2) (theta, rate) + what the torque adds (2, T)
        state = Phi @ state + push
    out[:, samples - 2 :] = state[0][:, None]
    return out


def _runge_kutta(
    acceleration: Callable[[int, FloatArray, FloatArray], FloatArray],
    theta: FloatArray,
    rate: FloatArray,
    h: float,
) -> tuple[FloatArray, FloatArray]:
    """Angle and rate a step later; `acceleration` at its start (0), middle (1) and end (2)."""
    a1 = acceleration(0, theta, rate)
    v2 = rate + h / 2 * a1
    a2 = acceleration(1, theta + h / 2 * rate, v2)
    v3 = rate + h / 2 * a2
    a3 = acceleration(1, theta + h / 2 * v2, v3)
    v4 = rate + h * a3
    a4 = acceleration(2, theta + h * v3, v4)
    theta = theta + h / 6 * (rate + 2 * v2 + 2 * v3 + v4)
    return theta, rate + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)


def noisy(
    signal: FloatArray, snr_db: float | None, generators: list[np.random.Generator]
) -> FloatArray:
    """Signals (T, S) with white noise at a level in dB of power; None: as they are."""
    if snr_db is None:
        return signal
    white = np.stack([g.standard_normal(signal.shape[1]) for g in generators])
    return np.asarray(signal + white * signal.std(axis=1, keepdims=True) * 10 ** (-snr_db / 20))
