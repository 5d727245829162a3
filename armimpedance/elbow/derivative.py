"""Filtered derivatives with instruments: the equation of motion itself, in continuous time.

One smoothing kernel gives the angle, its two derivatives and the torque, so that the equation
holds after it exactly as before it. The noise of the derivatives, which biases least squares,
is kept out by instruments: derivatives of a simulated angle (see `instruments`).
"""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.elbow.band import Band, start_values
from armimpedance.elbow.discrete import joint_model
from armimpedance.elbow.estimate import (
    Estimate,
    Rows,
    Solved,
    ramp_and_start,
    settled,
    solve_rows,
    without,
)
from armimpedance.elbow.instruments import (
    ROUNDS,
    Driver,
    driver_of,
    next_values,
    simulated,
    weighed,
    whitening,
)
from armimpedance.elbow.preparation import Prepared, without_ramp
from armimpedance.elbow.result import NAMES
from armimpedance.errors import EstimationError
from armimpedance.records import FloatArray
from armimpedance.signals.differentiate import Kernels, spline_kernels

#: Support of the kernel in periods of the band's upper edge.
KERNEL_PERIODS: Final = 0.6


def solve(prepared: Prepared, band: Band) -> Estimate:
    """Instruments for ``tau = I theta'' + B theta' + K theta`` (3) after one kernel.

    Raises
    ------
    EstimationError
        I, B or K is not positive, or the rounds do not settle.
    """
    values, driver = start_values(band), driver_of(prepared)
    kernels = spline_kernels(KERNEL_PERIODS / prepared.band_hz, prepared.source.sample_rate_hz)
    for number in range(ROUNDS):
        solved = _round(prepared, kernels, driver, values, whitening(band, values))
        estimate = Estimate(
            solved.parameters,
            solved.covariance,
            solved.classical,
            solved.dof,
            solved.n,
            solved.conditioning,
        )
        if settled(estimate, values):
            return estimate
        values = next_values(values, estimate.values, number)
    raise EstimationError(
        f"the instruments do not settle within {ROUNDS} rounds: is the perturbation "
        "strong enough? try method output-error"
    )


def _round(
    prepared: Prepared, kernels: Kernels, driver: Driver, values: FloatArray, white: FloatArray
) -> Solved:
    samples, keep = prepared.source, prepared.decimation
    rate = samples.sample_rate_hz
    whitener = joint_model(white, rate)
    model = joint_model(values if driver.values is None else driver.values, rate)
    rows = []
    for row in range(samples.n_trials):
        inside = samples.samples_of(row)
        torque, angle = without_ramp(np.stack([samples.torque[inside], samples.angle[inside]]))
        clean = torque
        if samples.perturbation is not None:
            clean = without_ramp(samples.perturbation[inside])
        X, Z = _columns(angle, kernels), _columns(simulated(model, clean), kernels)
        y = _smoothed(torque, kernels.smooth)
        columns = weighed(whitener, np.column_stack([X, Z, y, ramp_and_start(len(y))]))[::keep]
        X, Z, y = without(columns[:, 7:], columns[:, :3], columns[:, 3:6], columns[:, 6])
        rows.append(Rows(X, Z, y, len(y) * keep / rate))
    return solve_rows(rows, NAMES)


def _columns(angle: FloatArray, kernels: Kernels) -> FloatArray:
    """theta'', theta', theta, (S, 3)."""
    weights = (kernels.second, kernels.first, kernels.smooth)
    return np.column_stack([_smoothed(angle, w) for w in weights])


def _smoothed(signal: FloatArray, weights: FloatArray) -> FloatArray:
    """Correlation with the kernel where it lies inside the trial."""
    return np.convolve(signal, weights[::-1], mode="valid")
