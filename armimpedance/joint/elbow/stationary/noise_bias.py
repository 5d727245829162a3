"""Predict the bias of ARX by least squares due to sensor noise, before the fit.

The columns include lagged angles with their noise; at 1 kHz neighbouring angles differ by less than
that. With noise-free columns X0, and noise whose products have the mean D per row (d with the left
side), the estimate tends to ``(X0^T X0 + n D)^-1 (X0^T y0 + n d)``. X0 is simulated with the values
of a fit that is robust to noise, and passes the same filter and decimation; D and d are those of
white noise at the channels' floors after that filter. Frequency warping at the sample rate affects
X0, and is thus part of the predicted bias.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np
from scipy.linalg import toeplitz

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import EstimationError
from armimpedance.joint.elbow.checks import spectra_of
from armimpedance.joint.elbow.elbow_result import NAMES
from armimpedance.joint.elbow.samples import JointSamples
from armimpedance.joint.elbow.stationary.band import Band
from armimpedance.joint.elbow.stationary.discrete import (
    DELAY,
    FREE,
    SHAPE,
    Structure,
    joint_model,
    lagged,
    model_of,
    simulated,
    to_continuous,
)
from armimpedance.joint.elbow.stationary.preparation import PreparedSamples, prepare, without_ramp
from armimpedance.numerics.signals import lowpass

#: Relative bias above which raw samples are refused, and filtered ones give a warning.
LARGEST: Final = 0.1


def predicted_bias(
    prepared: PreparedSamples,
    band: Band,
    values: FloatArray,
    structure: Structure,
    *,
    free: bool = False,
) -> FloatArray | None:
    """Predicted relative error of I, B, K (3,); None if the result is not a joint.

    `band`: gives the noise floors of the channels.
    `values` (3,): assumed I, B, K.
    `structure`, `free`: as in `discrete.solve_structure`.
    """
    shape = (FREE if free else SHAPE)[structure]
    noiseless = _without_noise(prepared, values)
    filtering = prepared.cutoff_hz, prepared.decimation
    clean = prepare(noiseless, spectra_of(noiseless), *filtering)
    D, d = _noise(prepared, band, structure, shape)
    gram, right = np.zeros_like(D), np.zeros_like(d)
    for row in range(prepared.n_trials):
        inside = prepared.inside(row)
        table = lagged(clean.angle[inside], clean.torque[inside], structure, shape)
        # X0^T X0 + n D (p, p), X0^T y0 + n d (p,)
        gram += table.X.T @ table.X + len(table.y) * D
        right += table.X.T @ table.y + len(table.y) * d
    scale = np.sqrt(np.diag(gram))
    fitted = np.linalg.lstsq(gram / np.outer(scale, scale), right / scale, rcond=None)[0] / scale
    try:
        model = model_of(fitted, prepared.sample_rate_hz, structure, shape)
        return np.asarray(to_continuous(model) / values - 1)
    except EstimationError:
        return None


def in_words(bias: FloatArray | None) -> str:
    """Text of the bias for a user."""
    if bias is None:
        return "no joint at all (its poles or gain are none)"
    return "a bias of " + ", ".join(
        f"{n} {100 * b:+.0f} %" for n, b in zip(NAMES, bias, strict=True)
    )


def _without_noise(prepared: PreparedSamples, values: FloatArray) -> JointSamples:
    """Samples with the torque inside the band, and the angle simulated from I, B, K."""
    samples = prepared.source
    model = joint_model(values, samples.sample_rate_hz)
    torques, angles = [], []
    for row in range(samples.n_trials):
        torque = without_ramp(samples.torque[samples.samples_of(row)])
        torques.append(lowpass(torque, prepared.band_hz, samples.sample_rate_hz, axis=0))
        angles.append(simulated(model, torques[-1]))
    return replace(
        samples, torque=np.concatenate(torques), angle=np.concatenate(angles), perturbation=None
    )


def _noise(
    prepared: PreparedSamples, band: Band, structure: Structure, shape: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Mean products of the columns' noise per row: D (p, p), and with the left side d (p,)."""
    memory = _memory(prepared)
    angle, torque = band.angle_noise * memory, band.torque_noise * memory
    p, count = 2 + shape.shape[1], 3 - DELAY[structure]
    D, d = np.zeros((p, p)), np.zeros(p)
    D[:2, :2] = toeplitz(angle[:2])
    D[2:, 2:] = shape.T @ toeplitz(torque[:count]) @ shape
    d[:2] = -angle[1:3]
    return D, d


def _memory(prepared: PreparedSamples) -> FloatArray:
    """Autocovariance (3,) at the first lags of unit white noise after filter and decimation."""
    if prepared.cutoff_hz is None:
        return np.array([1.0, 0.0, 0.0])
    rate, keep = prepared.source.sample_rate_hz, prepared.decimation
    half = int(10 * rate / prepared.cutoff_hz) + 3 * keep
    impulse = np.zeros(2 * half + 1)
    impulse[half] = 1.0
    response = lowpass(impulse, prepared.cutoff_hz, rate, axis=0)
    return np.array(
        [float(response[: len(response) - k] @ response[k:]) for k in (0, keep, 2 * keep)]
    )
