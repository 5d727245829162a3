"""How much noise may there be? Errors of I, B and K by the stationary methods, on a bench."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import ArmImpedanceError, InputError
from armimpedance.joint.elbow import JointSamples, estimate_joint, from_recording, least_squares_arx
from armimpedance_figures.ruiz2011.bench import DURATION_S, JOINTS, Joint
from manipulandum_sim.elbow import simulate_bench

SNRS_DB: Final = (-10.0, -5.0, 0.0, 5.0, 10.0, 15.0, 20.0, 30.0, 45.0, 60.0)
DRAWS: Final = 12
#: The limit that the source sets to the relative error.
WITHIN: Final = 0.10
RAW: Final = "raw arx"
#: In the order of the drawing.
METHODS: Final = ("arx", "iv", "output-error", "derivative")


@dataclass(frozen=True)
class SnrStudy:
    """Relative errors of one joint.

    Attributes
    ----------
    joint : Joint
    snrs_db : (S,)
        Of torque and of angle, each.
    error : mapping str -> (S, D, 3)
        By method, of I, B and K, for D draws; NaN where no joint came out.
    """

    joint: Joint
    snrs_db: FloatArray
    error: dict[str, FloatArray]

    @property
    def draws(self) -> int:
        """Records of each level of noise."""
        return next(iter(self.error.values())).shape[1]

    def rms(self, method: str) -> FloatArray:
        """Over the draws, (S, 3); a draw without a joint counts as an error of 100 %."""
        return np.sqrt((np.nan_to_num(self.error[method], nan=1.0) ** 2).mean(axis=1))

    def failed(self, method: str) -> FloatArray:
        """Draws without a joint, (S,)."""
        return np.isnan(self.error[method]).any(axis=2).sum(axis=1)

    def lowest_db(self, method: str) -> FloatArray:
        """Lowest SNR from which on the rms stays within `WITHIN`, of I, B, K (3,); NaN: none."""
        good = np.logical_and.accumulate((self.rms(method) <= WITHIN)[::-1])[::-1]
        first = np.where(good.any(axis=0), good.argmax(axis=0), 0)
        return np.where(good.any(axis=0), self.snrs_db[first], np.nan)


def _raw(samples: JointSamples) -> FloatArray:
    """The source's model as printed, nb = 2 and nk = 1, on samples as they are."""
    raw = least_squares_arx(samples, "zoh", cutoff_hz=None, decimation=1, free=True)
    return raw.values


def _by(name: str) -> Callable[[JointSamples], FloatArray]:
    """A method without the limits that the command sets to the SNR."""

    def solve(samples: JointSamples) -> FloatArray:
        return estimate_joint(samples, name).values

    return solve


SOLVERS: Final = MappingProxyType({RAW: _raw, **{name: _by(name) for name in METHODS}})


def study(experiment: str, *, subject: str, seed: int, sets: int) -> tuple[SnrStudy, ...]:
    """Both joints; subject and sets, of other experiments, play no part.

    Raises
    ------
    InputError
        An unknown experiment.
    """
    del subject, sets
    if experiment != "elbow_snr":
        raise InputError(f"no experiment {experiment!r}", expected="elbow_snr")
    return tuple(study_joint(joint, seed) for joint in JOINTS)


def study_joint(
    joint: Joint,
    seed: int,
    *,
    snrs_db: tuple[float, ...] | None = None,
    draws: int | None = None,
    methods: tuple[str, ...] = tuple(SOLVERS),
) -> SnrStudy:
    """Every method on the same records; the same torques and noise, larger or smaller, at all SNRs.

    Raises
    ------
    InputError
        An unknown method.
    """
    unknown = sorted(set(methods) - set(SOLVERS))
    if unknown:
        raise InputError(f"unknown method {unknown[0]!r}", expected=", ".join(SOLVERS))
    levels, count = snrs_db or SNRS_DB, draws or DRAWS
    recording, _ = simulate_bench(*joint.values, duration_s=DURATION_S, trials=count, seed=seed)
    error = {method: np.full((len(levels), count, 3), np.nan) for method in methods}
    for d, rng in enumerate(np.random.default_rng([seed, 2]).spawn(count)):
        clean = from_recording(recording.select(np.array([d])))
        white = rng.standard_normal((2, len(clean.torque)))
        for s, snr_db in enumerate(levels):
            samples = _noisy(clean, white, snr_db)
            for method in methods:
                error[method][s, d] = _error_or_nan(samples, method, joint)
    return SnrStudy(joint, np.array(levels), error)


def _noisy(clean: JointSamples, white: FloatArray, snr_db: float) -> JointSamples:
    """White noise on both channels, dB of power over the whole band."""
    part = 10 ** (-snr_db / 20)
    return replace(
        clean,
        torque=clean.torque + part * clean.torque.std() * white[0],
        angle=clean.angle + part * clean.angle.std() * white[1],
    )


def _error_or_nan(samples: JointSamples, method: str, joint: Joint) -> FloatArray:
    try:
        return SOLVERS[method](samples) / joint.values - 1
    except ArmImpedanceError:
        return np.full(3, np.nan)
