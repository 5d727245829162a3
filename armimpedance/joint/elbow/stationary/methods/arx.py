"""ARX as the source does it, on filtered and decimated samples: least squares in discrete time.

``y(t) = -a1 y(t-1) - a2 y(t-2) + b1 u(t-nk) + ... + e(t)``. Measured angles stand on both sides:
their noise biases the estimate unless a filter took it away first. For torque without steps the
bilinear structure holds with ``b = b1 (1, 2, 1)``, so that three numbers are fitted for three; the
three b of nb = 3 can be left free, as at a low rate, where they take up what it warps.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.joint.elbow.stationary.band import Band
from armimpedance.joint.elbow.stationary.discrete import solve_structure
from armimpedance.joint.elbow.stationary.estimate import Estimate
from armimpedance.joint.elbow.stationary.methods import ElbowMethod, iv, output_error
from armimpedance.joint.elbow.stationary.noise_bias import LARGEST, in_words, predicted_bias
from armimpedance.joint.elbow.stationary.preparation import PreparedSamples
from armimpedance.numerics.regression import t_factor

#: Below so many samples per period of the band's edge the three b are left free.
WARPED: Final = 20


def solve(prepared: PreparedSamples, band: Band) -> Estimate:
    """Least squares, bilinear structure; the interval holds the bias that sensors' noise makes.

    Raises InputError: samples that were neither filtered nor decimated, and noise that would decide
    the outcome.
    Raises EstimationError: the fitted poles or gain are no joint's.
    Raises NotIdentifiableError: the record does not tell the coefficients apart.
    """
    free = prepared.sample_rate_hz < WARPED * prepared.band_hz
    # Where the device reacts to the subject, output error is off as well.
    trusted = output_error if band.source == "torque" else iv
    reference = trusted.solve(prepared, band).parameters.values
    bias = predicted_bias(prepared, band, reference, "tustin", free=free)
    large = bias is None or bool((np.abs(bias) > LARGEST).any())
    if large and prepared.cutoff_hz is None and prepared.decimation == 1:
        raise InputError(
            f"arx on raw samples at {prepared.sample_rate_hz:g} Hz: noise of the sensors would "
            f"give {in_words(bias)}",
            expected="a low-pass or decimation (automatic by default), or method iv or "
            "output-error",
        )
    estimate = solve_structure(prepared, "tustin", free=free)
    return _with_bias(estimate, bias, reference)


def _with_bias(estimate: Estimate, bias: FloatArray | None, reference: FloatArray) -> Estimate:
    """Intervals that hold what is known to be off, predicted or seen against the reference.

    The prediction knows the sensors' noise only; the subject's own torque is noise of the equation
    too and moves least squares away from what output error, or instruments where the perturbation
    is recorded, find in the same record.
    """
    values = estimate.parameters.values
    seen = values / reference - 1
    predicted = np.zeros(3) if bias is None else bias
    sd = estimate.parameters.sd / values
    unforeseen = np.abs(seen) > np.abs(predicted) + t_factor(estimate.parameters.dof) * sd
    off = np.where(unforeseen, seen, predicted)
    warnings: tuple[str, ...] = ()
    if bias is None or (np.abs(off) > LARGEST).any():
        told = in_words(None if bias is None and not unforeseen.any() else off)
        why = "noise of the equation" if unforeseen.any() else "noise of the sensors and the rate"
        warnings = (
            f"least squares suffers from {why}: {told}; the intervals allow for it, methods iv "
            "and output-error do not have it",
        )
    return estimate.widened(off * values, warnings, bias=tuple(float(b) for b in off))


METHOD = ElbowMethod(
    "arx",
    "least squares in discrete time on filtered, decimated samples",
    15.0,
    "A. F. Ruiz et al. (2011), eqs. (5)-(8)",
    solve,
)
