"""A joint that a position servo moves: the angle is imposed, and the subject pushes against it.

``I theta'' + B theta' + K theta = tau + v``, tau by the servo on the limb, v the subject's own
torque. A stiff servo imposes the commanded angle behind its lag; one of finite impedance Z_d gives
way, ``tau = Z_d (theta_commanded - theta)``. Solved exactly over frequency for a period more than
twice as long as the trial, of which the trial is a part: nothing in it repeats.
"""

from __future__ import annotations

from typing import Final, Literal

import numpy as np
import pandas as pd

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import command_columns
from armimpedance.core.errors import InputError
from armimpedance.core.records import Recording, Subject
from manipulandum_sim.elbow.bench import BenchTruth, noisy
from manipulandum_sim.elbow.device import RATE_HZ

Imposed = Literal["position", "both"]

#: Edges of the command's and the subject's low-passes, Hz, and their orders.
COMMAND_HZ: Final = (8.0, 2)
OWN_HZ: Final = (2.0, 1)
#: Time constant of the servo's lag, of second order, s.
LAG_S: Final = 0.008


def simulate_servo(
    inertia: float,
    viscosity: float,
    stiffness: float,
    *,
    own_Nm: float = 0.5,
    angle_rms: float = 0.02,
    device: tuple[float, float, float] | None = None,
    command: bool = True,
    told: bool = True,
    duration_s: float = 40.0,
    trials: int = 1,
    snr_db: float | None = 40.0,
    seed: int = 0,
) -> tuple[Recording, BenchTruth]:
    """Random commanded angles at a joint whose subject pushes.

    Parameters
    ----------
    inertia, viscosity, stiffness : float
        Of the limb: kg m^2, N m s/rad, N m/rad.
    own_Nm : float
        Root mean square of the subject's own torque, low-passed at 2 Hz.
    angle_rms : float
        rad, of the commanded angle, low-passed at 8 Hz.
    device : (3,), optional
        I, B, K between the commanded angle and the limb; without it the servo is stiff.
    command : bool
        Whether the commanded angle is recorded.
    told : bool
        Whether the recording says what was imposed.
    duration_s : float
    trials : int
    snr_db : float or None
        White noise on torque and angle, dB of power.
    seed : int

    Returns
    -------
    (Recording, BenchTruth)
        Kind "joint", interaction torque by the limb (minus the one on it).

    Raises
    ------
    InputError
        An impedance, size or duration that cannot be.
    """
    positive = (inertia, viscosity, stiffness, angle_rms, duration_s, trials)
    if not (np.isfinite(positive).all() and min(positive) > 0 and own_Nm >= 0):
        raise InputError(
            f"a joint of {inertia} kg m^2, {viscosity} N m s/rad, {stiffness} N m/rad, own torque "
            f"{own_Nm} N m, {trials} trials of {duration_s} s",
            expected="positive numbers, an own torque of 0 or more",
        )
    limb = (inertia, viscosity, stiffness)
    generators = [np.random.default_rng(s) for s in np.random.SeedSequence(seed).spawn(trials)]
    samples = round(duration_s * RATE_HZ)
    parts = [_trial(g, samples, limb, device, own_Nm, angle_rms) for g in generators]
    commanded, torque, angle = (np.stack(channel) for channel in zip(*parts, strict=True))
    measured = [noisy(channel, snr_db, generators) for channel in (torque, angle)]
    extra = {command_columns("joint", 1)[0]: commanded.ravel()} if command else {}
    imposed: Imposed = "position" if device is None else "both"
    recording = Recording(
        kind="joint",
        sample_rate_hz=RATE_HZ,
        trials=pd.DataFrame({"trial": range(1, trials + 1), "condition": "servo"}),
        offsets=samples * np.arange(trials + 1),
        time_s=np.tile(np.arange(samples) / RATE_HZ, trials),
        position=measured[1].reshape(-1, 1),
        force=-measured[0].reshape(-1, 1),
        perturbation="stochastic",
        torque="interaction",
        imposed=imposed if told else None,
        subject=Subject(id="servo"),
        extra=extra,
        provenance=("simulated joint in a position servo",),
    )
    B, K = np.full(samples, viscosity), np.full(samples, stiffness)
    return recording, BenchTruth(inertia, B, K, torque, angle)


def _trial(
    rng: np.random.Generator,
    samples: int,
    limb: tuple[float, float, float],
    device: tuple[float, float, float] | None,
    own_Nm: float,
    angle_rms: float,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Commanded angle, torque on the limb, angle of one trial, (S,) each."""
    period = 2 * samples + round(4 * RATE_HZ)
    s = 2j * np.pi * np.fft.rfftfreq(period, 1 / RATE_HZ)
    Z, wanted = np.polyval(limb, s), coloured(rng, s, period, *COMMAND_HZ) * angle_rms
    v = coloured(rng, s, period, *OWN_HZ) * own_Nm
    followed = wanted / (1 + s * LAG_S) ** 2
    if device is None:
        theta = followed
    else:
        Zd = np.polyval(device, s)
        theta = (Zd * followed + v) / (Z + Zd)
    first = int(rng.integers(period - samples))
    inside = slice(first, first + samples)
    channels = [np.fft.irfft(x, period)[inside] for x in (wanted, Z * theta - v, theta)]
    return channels[0], channels[1], channels[2]


def coloured(
    rng: np.random.Generator, s: np.ndarray, period: int, edge_hz: float, order: int
) -> np.ndarray:
    """Coefficients of noise behind a Butterworth low-pass, root mean square one over the period."""
    gain = 1 / np.sqrt(1 + (np.abs(s) / (2 * np.pi * edge_hz)) ** (2 * order))
    gain[0] = 0
    noise = gain * np.fft.rfft(rng.standard_normal(period))
    return np.asarray(noise / np.fft.irfft(noise, period).std())
