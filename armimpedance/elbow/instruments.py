"""Instruments: columns that follow the motion but none of its noise.

``sum Z^T (y - X p) = 0``, Z the lags of a simulated angle. Where the recording holds the device's
perturbation the angle is that which a joint of second order, limb and device together, makes of
it: neither the sensors' noise nor the subject's own torque, to which the measured one reacts, is
in it. Else it is simulated from the measured torque, whose noise inside the band remains. Model,
instruments and the filter that makes the noise of the rows white are refined in turn (P. C.
Young, Recursive Estimation and Time-Series Analysis, 2nd ed. 2011, chapter 7).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from armimpedance.elbow.band import Band, band_of, start_values
from armimpedance.elbow.discrete import DiscreteModel, joint_model
from armimpedance.elbow.estimate import (
    Estimate,
    Rows,
    Solved,
    ramp_and_start,
    settled,
    solve_rows,
    without,
)
from armimpedance.elbow.lagged import SHAPE, column_names, lagged, to_estimate
from armimpedance.elbow.output_error import fit_band
from armimpedance.elbow.preparation import Prepared
from armimpedance.errors import EstimationError
from armimpedance.records import FloatArray

ROUNDS: Final = 60
#: So many rounds start from what the one before found.
_FREE_ROUNDS: Final = 4


def solve(prepared: Prepared, band: Band) -> Estimate:
    """Refined instruments, bilinear structure.

    Raises
    ------
    EstimationError
        The fitted poles or gain are no joint's, or the rounds do not settle.
    """
    rate = prepared.sample_rate_hz
    values, driver = start_values(band), driver_of(prepared)
    for number in range(ROUNDS):
        solved = _round(prepared, driver, values, whitening(band, values))
        estimate = to_estimate(solved, rate, "tustin")
        if settled(estimate, values):
            return estimate
        values = next_values(values, estimate.values, number)
    raise EstimationError(
        f"the instruments do not settle within {ROUNDS} rounds: is the perturbation "
        "strong enough? try method output-error"
    )


def _round(prepared: Prepared, driver: Driver, values: FloatArray, white: FloatArray) -> Solved:
    rate = prepared.sample_rate_hz
    whitener = joint_model(white, rate)
    model = joint_model(values if driver.values is None else driver.values, rate)
    rows = []
    for row in range(prepared.n_trials):
        whole, edge = prepared.samples_of(row), prepared.edge
        torque, angle = prepared.torque[whole], prepared.angle[whole]
        drive = torque if driver.torque is None else driver.torque[whole]
        inner = slice(edge, len(torque) - edge)
        table = lagged(angle[inner], torque[inner], "tustin")
        clean = simulated(model, drive)[inner]
        # A(q) makes the torque of the angle: its third lag is as good as a torque's column.
        curve = clean[2:] - 2 * clean[1:-1] + clean[:-2]
        instruments = np.column_stack([clean[1:-1], clean[1:-1] - clean[:-2], curve])
        columns = np.column_stack([table.X, instruments, table.y, ramp_and_start(len(table.y))])
        filtered = weighed(whitener, columns)
        X, Z, y = without(filtered[:, 7:], filtered[:, :3], filtered[:, 3:6], filtered[:, 6])
        rows.append(Rows(X, Z, y, len(y) / rate))
    return solve_rows(rows, column_names(SHAPE["tustin"]))


@dataclass(frozen=True)
class Driver:
    """What the simulated angle is made from, and by what.

    Attributes
    ----------
    torque : (N,) or None
        The perturbation, prepared; None = the measured torque.
    values : (3,) or None
        I, B, K of limb and device together, under the perturbation; None = the limb's own.
    """

    torque: FloatArray | None = None
    values: FloatArray | None = None


def driver_of(prepared: Prepared) -> Driver:
    """The perturbation and what it moves, where it was recorded."""
    if prepared.perturbation is None or prepared.source.perturbation is None:
        return Driver()
    commanded = replace(prepared.source, torque=prepared.source.perturbation)
    under = replace(band_of(replace(prepared, source=commanded)), torque_noise=0.0)
    try:
        values = fit_band(under, start_values(under))
    except EstimationError:
        # A device that is no joint of second order: the limb's own model still follows it.
        return Driver(prepared.perturbation)
    return Driver(prepared.perturbation, values)


def next_values(before: FloatArray, found: FloatArray, number: int) -> FloatArray:
    """Where the next round starts: half way, after the first rounds, should they swing."""
    return np.asarray(np.sqrt(before * found)) if number >= _FREE_ROUNDS else found


def simulated(model: DiscreteModel, torque: FloatArray) -> FloatArray:
    """The angle (S,) that a torque (S,) makes, from rest."""
    from scipy.signal import lfilter

    return np.asarray(lfilter(model.numerator, model.denominator, torque))


def weighed(model: DiscreteModel, columns: FloatArray) -> FloatArray:
    """Rows (S, p) through ``A(1)/A(q)`` from rest: a triangular matrix on both sides, exact."""
    from scipy.signal import lfilter

    gain = float(model.denominator.sum())
    return np.asarray(lfilter([gain], model.denominator, columns, axis=0))


def whitening(band: Band, values: FloatArray) -> FloatArray:
    """The I, B, K (3,) of the filter ``1/(I s^2 + B s + K)`` that makes the equation's noise white.

    Its power ``s_theta^2 |Z|^2 + s_tau^2`` is ``s_theta^2 |I s^2 + B' s + K'|^2`` with
    ``K'^2 = K^2 + (s_tau / s_theta)^2`` and ``B'^2 = B^2 + 2 I (K' - K)``. Without a floor of the
    angle its own error is weighed, K' = K.
    """
    if band.angle_noise == 0:
        return values
    inertia, viscosity, stiffness = values
    stiffer = np.sqrt(stiffness**2 + band.torque_noise / band.angle_noise)
    more = np.sqrt(viscosity**2 + 2 * inertia * (stiffer - stiffness))
    return np.array([inertia, more, stiffer])
