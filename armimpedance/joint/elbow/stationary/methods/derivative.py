"""Filtered derivatives with instruments: the equation of motion itself, in continuous time.

The same smoothing kernel is applied to the angle, its two derivatives and the torque, so that the
equation still holds exactly. The noise of the derivatives, which would bias least squares, is kept
out by instruments: derivatives of a simulated angle (see `instruments`).
"""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.joint.elbow.elbow_result import NAMES, UNITS
from armimpedance.joint.elbow.stationary.band import Band, Bins, in_time, real_rows
from armimpedance.joint.elbow.stationary.discrete import joint_model, simulated
from armimpedance.joint.elbow.stationary.estimate import (
    Estimate,
    Rows,
    Solved,
    ramp,
    solve_rows,
    without,
)
from armimpedance.joint.elbow.stationary.instruments import Driver, driver_of, refined, start_values
from armimpedance.joint.elbow.stationary.methods import ElbowMethod
from armimpedance.joint.elbow.stationary.preparation import PreparedSamples, without_ramp
from armimpedance.numerics.signals import Kernels, spline_kernels

#: Support of the kernel in periods of the band's upper edge.
KERNEL_PERIODS: Final = 0.6


def solve(prepared: PreparedSamples, band: Band) -> Estimate:
    """Solve ``tau = I theta'' + B theta' + K theta`` (3) with instruments, after one kernel.

    Raises EstimationError: I, B or K is not positive, or the rounds do not converge.
    """
    kernels = spline_kernels(KERNEL_PERIODS / prepared.band_hz, prepared.source.sample_rate_hz)
    driver = driver_of(band)
    measured = [_measured(prepared, row, kernels) for row in range(prepared.n_trials)]
    return refined(
        lambda values: _round(prepared, band, kernels, measured, driver, values),
        start_values(band),
    )


def _measured(prepared: PreparedSamples, row: int, kernels: Kernels) -> FloatArray:
    """theta'', theta', theta and torque after the kernel, (S, 4)."""
    samples = prepared.source
    inside = samples.samples_of(row)
    torque, angle = without_ramp(np.stack([samples.torque[inside], samples.angle[inside]]))
    return np.column_stack([_columns(angle, kernels), _smoothed(torque, kernels.smooth)])


def _round(
    prepared: PreparedSamples,
    band: Band,
    kernels: Kernels,
    measured: list[FloatArray],
    driver: Driver,
    values: FloatArray,
) -> Solved:
    samples = prepared.source
    rate = samples.sample_rate_hz
    model = joint_model(values if driver.values is None else driver.values, rate)
    perturbation = samples.perturbation if band.source == "perturbation" else None
    drives = samples.torque if perturbation is None else perturbation
    rows = []
    for row, bins in enumerate(band.trials):
        inside = samples.samples_of(row)
        if driver.simulates:
            clean = simulated(model, without_ramp(drives[inside]))
        else:
            clean = _told(driver, row, bins, without_ramp(samples.angle[inside]), values)
        columns = np.column_stack(
            [measured[row], _columns(clean, kernels), ramp(len(measured[row]))]
        )
        weighed = _weighed(columns, bins, kernels, rate, values)
        X, y, Z = without(weighed[:, 7:], weighed[:, :3], weighed[:, 3], weighed[:, 4:7])
        series = in_time(np.column_stack([X, Z, y]))
        seconds = len(columns) / rate
        rows.append(Rows(series[:, :3], series[:, 3:6], series[:, 6], seconds))
    return solve_rows(rows, NAMES, UNITS)


def _told(
    driver: Driver, row: int, bins: Bins, measured: FloatArray, values: FloatArray
) -> FloatArray:
    """Noise-free angle over time (S,) from the driver, or the measured one corrected if imposed.

    `measured` (S,): the angle without offset and slope.
    """
    count = len(measured)
    within = driver.angle(row, bins, values)
    coefficients = np.zeros(count // 2 + 1, dtype=complex)
    first = round(float(bins.frequency_hz[0]) * bins.seconds)
    added = within - bins.angle if driver.imposed else within
    coefficients[first : first + len(added)] = added * np.sqrt(count)
    series = np.fft.irfft(coefficients, count)
    return np.asarray(measured + series if driver.imposed else series)


def _weighed(
    columns: FloatArray, bins: Bins, kernels: Kernels, rate: float, values: FloatArray
) -> FloatArray:
    """Coefficients of columns (S, p) in the band over the noise's root power, real rows (2 n, p).

    This is the same linear map for all columns, so the equation still holds. The kernel is
    symmetric and scales the noise by its real response, which is divided out.
    """
    count = len(columns)
    frequency = np.fft.rfftfreq(count, 1 / rate)
    low, high = bins.frequency_hz[0], bins.frequency_hz[-1]
    chosen = (frequency >= low * (1 - 1e-9)) & (frequency <= high * (1 + 1e-9))
    f = frequency[chosen]
    lags = np.arange(-kernels.half, kernels.half + 1) / rate
    response = np.cos(2 * np.pi * f[:, None] * lags) @ kernels.smooth
    Z = np.stack([(2j * np.pi * f) ** 2, 2j * np.pi * f, np.ones_like(f)], axis=1) @ values
    angle, torque = (
        np.interp(f, bins.frequency_hz, noise) for noise in (bins.angle_noise, bins.torque_noise)
    )
    weight = np.sqrt(2 / (angle * np.abs(Z) ** 2 + torque)) / response
    whole = np.fft.rfft(columns, axis=0)[chosen] / np.sqrt(count)
    return real_rows(whole * weight[:, None])


def _columns(angle: FloatArray, kernels: Kernels) -> FloatArray:
    """theta'', theta', theta, (S, 3)."""
    weights = (kernels.second, kernels.first, kernels.smooth)
    return np.column_stack([_smoothed(angle, w) for w in weights])


def _smoothed(signal: FloatArray, weights: FloatArray) -> FloatArray:
    """Correlation with the kernel, at samples where it lies inside the trial."""
    return np.convolve(signal, weights[::-1], mode="valid")


METHOD = ElbowMethod(
    "derivative",
    "filtered derivatives in continuous time, with instruments",
    5.0,
    "P. C. Young, Recursive Estimation and Time-Series Analysis (2011), chapter 8",
    solve,
)
