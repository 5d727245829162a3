"""How fast may B and K vary? Errors of the time-varying methods over the frequency, on a bench."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import ArmImpedanceError, InputError
from armimpedance.joint.elbow import VARYING_METHODS, VaryingImpedance, identify_varying
from armimpedance_figures.ruiz2011.bench import JOINTS, Joint, Varying, varying_draws

FREQUENCIES_HZ: Final = (0.3, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 4.0)
DRAWS: Final = 3
SNR_DB: Final = 40.0
NAMES: Final = ("B", "K")
#: Method "emg" with the activations themselves in place of amplitudes from EMG.
EXACT: Final = "emg without noise"
METHODS: Final = ("windows", "quadratic", "smoother", "spline", "emg", EXACT)


@dataclass(frozen=True)
class FrequencyStudy:
    """Relative rms errors over time of one joint.

    Attributes
    ----------
    joint : Joint
    frequencies_hz : (F,)
    error : mapping str -> (F, D, 2)
        By method, of B and of K, for D draws; NaN where the method refused the record.
    snr_db : float
    """

    joint: Joint
    frequencies_hz: FloatArray
    error: dict[str, FloatArray]
    snr_db: float

    @property
    def draws(self) -> int:
        """Records of each frequency."""
        return next(iter(self.error.values())).shape[1]

    def median(self, method: str) -> FloatArray:
        """Over the draws, (F, 2); NaN where half of them or more were refused."""
        refused = np.isnan(self.error[method])
        ranked = np.where(refused, np.inf, self.error[method])
        middle = np.median(ranked, axis=1)
        return np.where(np.isfinite(middle), middle, np.nan)

    def refused(self, method: str) -> FloatArray:
        """How many draws of each frequency the method refused, (F,)."""
        return np.isnan(self.error[method]).any(axis=2).sum(axis=1)


def study(experiment: str, *, subject: str, seed: int, sets: int) -> tuple[FrequencyStudy, ...]:
    """Both joints; subject and sets, of other experiments, play no part.

    Raises
    ------
    InputError
        An unknown experiment.
    """
    del subject, sets
    if experiment != "elbow_frequency":
        raise InputError(f"no experiment {experiment!r}", expected="elbow_frequency")
    return tuple(study_joint(joint, seed) for joint in JOINTS)


def study_joint(
    joint: Joint,
    seed: int,
    *,
    frequencies_hz: tuple[float, ...] | None = None,
    draws: int | None = None,
    snr_db: float = SNR_DB,
    methods: tuple[str, ...] = METHODS,
) -> FrequencyStudy:
    """Every method on the same records of a joint.

    Raises
    ------
    InputError
        An unknown method.
    """
    for method in set(methods) - {EXACT}:
        VARYING_METHODS.named(method)
    chosen, count = frequencies_hz or FREQUENCIES_HZ, draws or DRAWS
    error = {method: np.full((len(chosen), count, 2), np.nan) for method in methods}
    for f, frequency in enumerate(chosen):
        records = varying_draws(joint, frequency, draws=count, snr_db=snr_db, seed=seed + f)
        for d, record in enumerate(records):
            for method in methods:
                error[method][f, d] = _error_or_nan(record, method)
    return FrequencyStudy(joint, np.array(chosen), error, snr_db)


def identified(record: Varying, method: str) -> VaryingImpedance:
    """B and K over time by one of `METHODS`."""
    if method == EXACT:
        return identify_varying(record.samples, method="emg", amplitude=record.activation)
    if VARYING_METHODS.named(method).needs != "amplitude":
        return identify_varying(record.samples, method=method)
    return identify_varying(
        record.samples,
        method=method,
        amplitude=record.amplitude,
        amplitude_sd=record.amplitude_sd,
    )


def error_of(record: Varying, found: VaryingImpedance) -> FloatArray:
    """``sqrt(mean over time ((found - true) / true)^2)`` of B and of K, (2,)."""
    parts = []
    for name in NAMES:
        true = np.interp(found.time_s, *record.truth(name))
        parts.append(np.sqrt(np.mean((getattr(found, name) / true - 1) ** 2)))
    return np.array(parts)


def _error_or_nan(record: Varying, method: str) -> FloatArray:
    try:
        return error_of(record, identified(record, method))
    except ArmImpedanceError:
        return np.full(len(NAMES), np.nan)
