"""What the sensors' noise would do to ARX by least squares, told before it is fitted.

At 1 kHz the lagged angles differ by less than their noise. With noise-free columns X0 and noise of
variance D per row the estimate tends to ``(X0^T X0 + n D)^-1 X0^T y0``: X0 comes from a fit that
stands the noise, D from the floors of the channels.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.elbow.arx import lagged, model_of
from armimpedance.elbow.band import Band
from armimpedance.elbow.discrete import Structure, joint_model, to_continuous
from armimpedance.elbow.instruments import simulated
from armimpedance.elbow.preparation import Prepared, without_ramp
from armimpedance.elbow.result import NAMES
from armimpedance.errors import EstimationError, InputError
from armimpedance.records import FloatArray
from armimpedance.signals.filters import lowpass

LARGEST: Final = 0.1


def predicted_bias(
    prepared: Prepared, band: Band, values: FloatArray, structure: Structure = "tustin"
) -> FloatArray | None:
    """Relative error of I, B, K (3,) at the samples' own rate; None where no joint comes out."""
    samples = prepared.source
    model = joint_model(values, samples.sample_rate_hz, structure)
    inputs = [6.0] if structure == "tustin" else [1.0, 1.0]
    noise = np.array([band.angle_noise] * 2 + [band.torque_noise * k for k in inputs])
    gram, right = np.zeros((len(noise), len(noise))), np.zeros(len(noise))
    for row in range(samples.n_trials):
        torque = without_ramp(samples.torque[samples.samples_of(row)])
        clean = lowpass(torque, prepared.band_hz, samples.sample_rate_hz, axis=0)
        table = lagged(simulated(model, clean), clean, structure)
        # (X0^T X0 + n D) (p, p), X0^T y0 (p,)
        gram += table.X.T @ table.X + len(table.y) * np.diag(noise)
        right += table.X.T @ table.y
    scale = np.sqrt(np.diag(gram))
    found = np.linalg.solve(gram / np.outer(scale, scale), right / scale) / scale
    try:
        return to_continuous(model_of(found, samples.sample_rate_hz, structure)) / values - 1
    except EstimationError:
        return None


def refuse_raw(prepared: Prepared, band: Band, values: FloatArray) -> None:
    """Refuse ARX on samples that were neither filtered nor decimated, where noise decides.

    Raises
    ------
    InputError
        The predicted bias is above 10 %; says how large.
    """
    if prepared.cutoff_hz is not None or prepared.decimation > 1:
        return
    bias = predicted_bias(prepared, band, values)
    if bias is not None and np.abs(bias).max() <= LARGEST:
        return
    told = "no joint at all (its poles or gain are none)"
    if bias is not None:
        told = ", ".join(f"{n} {100 * b:+.0f} %" for n, b in zip(NAMES, bias, strict=True))
    raise InputError(
        f"arx on raw samples at {prepared.sample_rate_hz:g} Hz: noise of the sensors would give "
        f"{told}",
        expected="a low-pass or decimation (automatic if not told), or method iv or output-error",
    )
