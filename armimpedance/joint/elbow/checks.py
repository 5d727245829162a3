"""Can these samples be used? One clear line where they cannot, before anything is fitted."""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.joint.elbow.result import ChannelSnr
from armimpedance.joint.elbow.samples import JointSamples

SHORTEST_S: Final = 2.0
#: A value at the extreme for longer than this is clipped (s).
CLIPPED_S: Final = 0.01
#: ... if it is also that many times as frequent as its neighbour: a smooth peak of a quantised
#: signal stays at its top level some 2.4 times as long as at the one below.
HEAPED: Final = 8.0
#: A value that does not change for longer than this belongs to a stuck sensor (s).
STUCK_S: Final = 0.5
#: No joint moves about its operating point by more than this (rad, rms): a value in degrees does.
LARGEST_RMS_RAD: Final = 1.0
#: The signal to noise of a record of some seconds is read off to about this (dB).
SNR_SLACK_DB: Final = 0.5


def check_samples(samples: JointSamples) -> None:
    """Refuse what no method can use.

    Raises
    ------
    InputError
        A trial that is too short, a constant channel, a stuck or a clipped sensor, angles that
        cannot be radians.
    """
    rate = samples.sample_rate_hz
    seconds = np.diff(samples.offsets) / rate
    if seconds.min() < SHORTEST_S:
        row = int(seconds.argmin())
        raise InputError(
            f"trial {samples.trials[row]} lasts {seconds[row]:.2f} s",
            expected=f"{SHORTEST_S:g} s or more",
        )
    for row, trial in enumerate(samples.trials):
        inside = samples.samples_of(row)
        _check_channel(samples.torque[inside], rate, f"torque of trial {trial}")
        _check_channel(samples.angle[inside], rate, f"angle of trial {trial}")
        _check_radians(samples.angle[inside], trial)
        if samples.perturbation is not None and np.ptp(samples.perturbation[inside]) == 0:
            raise InputError(
                f"the perturbation of trial {trial} does not vary",
                expected="one that does, or none",
            )


def _check_radians(angle: FloatArray, trial: str) -> None:
    rms = float(angle.std())
    if rms > LARGEST_RMS_RAD:
        raise InputError(
            f"units: the angle of trial {trial} moves by {rms:.3g} rad rms",
            expected=f"radians, less than {LARGEST_RMS_RAD:g} rms; are these degrees?",
        )


def check_snr(snr: ChannelSnr, lowest_db: float, method: str) -> None:
    """Refuse a channel whose signal to noise is below a method's limit.

    Raises
    ------
    InputError
        Which channel, how many dB, what the limit is and what would help.
    """
    for name, level in (("torque", snr.torque_db), ("angle", snr.angle_db)):
        if level is None or level >= lowest_db - SNR_SLACK_DB:
            continue
        if not np.isfinite(level):
            raise InputError(
                f"the {name} holds noise alone", expected="a joint that is perturbed and moves"
            )
        helps = "a stronger perturbation"
        if lowest_db > 5 and level >= 5 - SNR_SLACK_DB:
            helps = f"method iv or output-error, or {helps}"
        raise InputError(
            f"signal to noise of the {name} is {level:.1f} dB, below what method {method} needs",
            expected=f"{lowest_db:g} dB or more; {helps} would help",
        )


def _check_channel(values: FloatArray, rate: float, where: str) -> None:
    low, high = float(values.min()), float(values.max())
    if low == high:
        hint = "the joint does not move" if where.startswith("angle") else "no perturbation"
        raise InputError(f"{where} is {low:g} throughout: {hint}", expected="a varying channel")
    for extreme in (low, high):
        at = values == extreme
        # Cheap first: a continuous signal meets its extreme once.
        if at.sum() <= CLIPPED_S * rate or longest_run(at) <= CLIPPED_S * rate:
            continue
        if at.sum() > HEAPED * _neighbours(values, extreme):
            raise InputError(
                f"{where} stays at its extreme, {extreme:g}, for "
                f"{1e3 * longest_run(at) / rate:.0f} ms: the sensor is clipped",
                expected="samples within the sensor's range",
            )
    still = longest_run(np.diff(values) == 0) / rate
    if still > STUCK_S:
        raise InputError(
            f"{where} does not change for {still:.2f} s: the sensor is stuck",
            expected="a channel that moves throughout",
        )


def longest_run(equal: np.ndarray) -> int:
    """Length of the longest run of True in (S,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], equal.astype(np.int8), [0]])))
    return int((edges[1::2] - edges[::2]).max()) if len(edges) else 0


def _neighbours(values: FloatArray, extreme: float) -> int:
    """How many samples have the value next to the extreme."""
    others = values[values != extreme]
    nearest = others[np.abs(others - extreme).argmin()]
    return int((values == nearest).sum())
