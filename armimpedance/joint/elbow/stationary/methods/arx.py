"""ARX as in the source, on filtered and decimated samples: least squares in discrete time.

``y(t) = -a1 y(t-1) - a2 y(t-2) + b1 u(t-nk) + ... + e(t)``. Measured angles are on both sides, so
their noise biases the estimate unless a filter removed it first. For a torque without steps the
bilinear structure holds with ``b = b1 (1, 2, 1)``: three numbers are fitted for three parameters.
At a low rate the three b of nb = 3 are fitted freely, to absorb the frequency warping.
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

#: Samples per period of the band's edge below which the three b are fitted freely.
WARPED: Final = 20


def solve(prepared: PreparedSamples, band: Band) -> Estimate:
    """Least squares, bilinear structure; the intervals include the bias due to sensor noise.

    Raises InputError: samples that were neither filtered nor decimated, with noise that would bias
    the result strongly.
    Raises EstimationError: the fitted poles or gain are not a joint's.
    Raises NotIdentifiableError: the record does not allow the coefficients to be separated.
    """
    free = prepared.sample_rate_hz < WARPED * prepared.band_hz
    # If the device reacts to the subject, output error is biased as well.
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
    """Widen the intervals by the bias that is predicted, or seen against the reference.

    The prediction includes sensor noise only. The subject's own torque is noise of the equation
    too, and moves least squares away from the reference: output error or, if the perturbation is
    recorded, instruments.
    """
    values = estimate.parameters.values
    observed = values / reference - 1
    predicted = np.zeros(3) if bias is None else bias
    sd = estimate.parameters.sd / values
    unforeseen = np.abs(observed) > np.abs(predicted) + t_factor(estimate.parameters.dof) * sd
    off = np.where(unforeseen, observed, predicted)
    warnings: tuple[str, ...] = ()
    if bias is None or (np.abs(off) > LARGEST).any():
        message = in_words(None if bias is None and not unforeseen.any() else off)
        why = "noise of the equation" if unforeseen.any() else "noise of the sensors and the rate"
        warnings = (
            f"least squares suffers from {why}: {message}; the intervals allow for it, methods iv "
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
