"""Instruments: columns that follow the motion but none of its noise.

``sum Z^H W (Tau - X p) = 0`` over the coefficients of the band, ``X = [s^2 s 1] Theta``: the
equation of motion in continuous time (see `band`), without hold or bilinear warping, at whatever
rate the samples come. Where the recording holds the device's perturbation, Z is made of the angle
that a joint of second order, limb and device together, makes of it: neither the sensors' noise
nor the subject's own torque, to which the measured one reacts, is in it. Else it is made of the
measured torque, whose noise inside the band remains. Model, instruments and weights are refined
in turn (P. C. Young, Recursive Estimation and Time-Series Analysis, 2nd ed. 2011, chapters 7, 8;
with a reference signal in the frequency domain: R. Pintelon, J. Schoukens, System Identification,
2nd ed. 2012, chapter 9).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from armimpedance.arrays import FloatArray
from armimpedance.elbow.result import NAMES
from armimpedance.elbow.stationary.band import (
    Band,
    Bins,
    Complex,
    band_of,
    impedance,
    in_time,
    real_rows,
    start_values,
    without_torque_noise,
)
from armimpedance.elbow.stationary.estimate import (
    Estimate,
    Rows,
    Solved,
    estimate_of,
    settled,
    solve_rows,
    without,
)
from armimpedance.elbow.stationary.output_error import fit_band
from armimpedance.elbow.stationary.preparation import Prepared
from armimpedance.elbow.stationary.residual_spectrum import with_residual
from armimpedance.errors import EstimationError

ROUNDS: Final = 60
#: So many rounds start from what the one before found.
_FREE_ROUNDS: Final = 4
#: How often the residual's spectrum is estimated anew, and rounds of instruments before each.
SPECTRA: Final = 2
_FIRST_ROUNDS: Final = 6
#: A parameter that a round finds at or below zero starts the next at this part of what it was.
_SHRUNK: Final = 0.1


def solve(prepared: Prepared, band: Band) -> Estimate:
    """Refined instruments.

    Raises
    ------
    EstimationError
        I, B or K is not positive, or the rounds do not settle.
    """
    driver = driver_of(prepared)
    return refined(lambda values: _round(band, driver, values), start_values(band))


def weighed_band(prepared: Prepared, floors: Band) -> Band:
    """The band, weighed by the sensors' floors and by what a first pass leaves of the torque.

    `floors`, of `band.band_of`, come back themselves where nothing is left beyond chance.

    Raises
    ------
    EstimationError
        The torque has the wrong sign.
    NotIdentifiableError
        The motion does not tell I, B and K apart.
    """
    band, driver, values = floors, driver_of(prepared), start_values(floors)
    for _ in range(SPECTRA):
        for _ in range(_FIRST_ROUNDS):
            values = _positive(_round(band, driver, values).parameters, values)
        band = with_residual(band, values, floors)
        if band is floors:
            break
    return band


def refined(solve_from: Callable[[FloatArray], Solved], start: FloatArray) -> Estimate:
    """Rounds of instruments, each from what the one before found, until they settle.

    Raises
    ------
    EstimationError
        I, B or K is not positive at the end, or the rounds do not settle.
    """
    values = start
    for number in range(ROUNDS):
        solved = solve_from(values)
        if settled(solved, values) or (number > _FREE_ROUNDS and (solved.parameters <= 0).any()):
            return estimate_of(solved)
        found = _positive(solved.parameters, values)
        # Half way, after the first rounds, should they swing.
        values = np.sqrt(values * found) if number >= _FREE_ROUNDS else found
    raise EstimationError(
        f"the instruments do not settle within {ROUNDS} rounds: is the perturbation "
        "strong enough? try method output-error"
    )


def _positive(found: FloatArray, before: FloatArray) -> FloatArray:
    return np.maximum(found, _SHRUNK * before)


def _round(band: Band, driver: Driver, values: FloatArray) -> Solved:
    rows = []
    for row, bins in enumerate(band.trials):
        weight = np.sqrt(2 / bins.noise_power(impedance(bins, values)))
        clean = driver.angle(row, bins, values)
        columns = np.column_stack(
            [bins.powers * bins.angle[:, None], bins.powers * clean[:, None], bins.torque]
        )
        ends = real_rows(bins.ends * weight[:, None])
        series = in_time(without(ends, real_rows(columns * weight[:, None]))[0])
        rows.append(Rows(series[:, :3], series[:, 3:6], series[:, 6], bins.seconds))
    return solve_rows(rows, NAMES)


@dataclass(frozen=True)
class Driver:
    """What the angle of the instruments is made from, and by what.

    Attributes
    ----------
    band : Band or None
        With the perturbation for the torque; None = the measured torque.
    values : (3,) or None
        I, B, K of limb and device together, under the perturbation; None = the limb's own.
    """

    band: Band | None = None
    values: FloatArray | None = None

    def angle(self, row: int, bins: Bins, limb: FloatArray) -> Complex:
        """Of trial `row`, (n,); `limb` is I, B, K (3,) so far."""
        torque = bins.torque if self.band is None else self.band.trials[row].torque
        return np.asarray(torque / impedance(bins, limb if self.values is None else self.values))


def driver_of(prepared: Prepared) -> Driver:
    """The perturbation and what it moves, where it was recorded."""
    if prepared.source.perturbation is None:
        return Driver()
    source = replace(prepared.source, torque=prepared.source.perturbation)
    under = without_torque_noise(band_of(replace(prepared, source=source)))
    try:
        return Driver(under, fit_band(under, start_values(under)))
    except EstimationError:
        # A device that is no joint of second order: the limb's own model still follows it.
        return Driver(under)
