"""Arguments of `simulate_elbow`: what they may be, and what follows from them."""

from __future__ import annotations

from typing import Final, Literal, get_args

import numpy as np

from armimpedance.core.errors import InputError
from manipulandum_sim.elbow.device import RATE_HZ, Limits, NoiseLevel
from manipulandum_sim.elbow.emg import Electrodes

TorqueColumn = Literal["interaction", "commanded"]

#: A trial stopped before this is no recording, s.
LEAST_S: Final = 1.0
#: Longest trial, s.
LONGEST_S: Final = 600.0


def electrodes_of(
    noise: NoiseLevel, hum_V: float | None, hum_hz: float, noise_V: float | None, crosstalk: float
) -> Electrodes:
    """The electrodes of a level of noise, where nothing else is asked for."""
    usual = Electrodes() if noise != "none" else Electrodes(0.0, 0.0, artefact=0.0)
    return Electrodes(
        usual.noise_V if noise_V is None else noise_V,
        usual.hum_V if hum_V is None else hum_V,
        hum_hz,
        usual.artefact,
        crosstalk,
    )


def check(
    repetitions: int,
    duration_s: float,
    seed: int,
    noise: NoiseLevel,
    torque: TorqueColumn,
    frequency_hz: float,
    delay_s: float,
) -> None:
    """Raise for an argument that makes no recording."""
    if noise not in get_args(NoiseLevel):
        raise InputError(f"no noise level {noise!r}", expected=", ".join(get_args(NoiseLevel)))
    if torque not in get_args(TorqueColumn):
        raise InputError(f"no torque {torque!r}", expected=" or ".join(get_args(TorqueColumn)))
    if not (isinstance(repetitions, int) and repetitions >= 1):
        raise InputError(f"{repetitions} repetitions", expected="1 or more")
    if seed < 0:
        raise InputError(f"seed {seed}", expected="0 or more")
    if not (np.isfinite(duration_s) and LEAST_S <= duration_s <= LONGEST_S):
        raise InputError(f"trials of {duration_s} s", expected=f"{LEAST_S:g} to {LONGEST_S:g} s")
    if not 0 < frequency_hz <= RATE_HZ / 20:
        raise InputError(f"{frequency_hz} Hz", expected=f"more than 0, at most {RATE_HZ / 20:g} Hz")
    if not 0 <= delay_s <= LEAST_S:
        raise InputError(f"an activation delay of {delay_s} s", expected=f"0 to {LEAST_S:g} s")


def check_muscles(test: str, four_muscles: bool) -> None:
    """Raise where four muscles are asked for in a test that records two."""
    if four_muscles and test != "calibration":
        raise InputError(f"four muscles in the test {test}", expected="the test calibration")


def limits_of(velocity: float, torque: float) -> Limits:
    """The limits at which a trial ends; raise for limits that are none."""
    if not (velocity > 0 and torque > 0):
        raise InputError(f"limits of {velocity} rad/s and {torque} N m", expected="above 0")
    return Limits(velocity, torque)
