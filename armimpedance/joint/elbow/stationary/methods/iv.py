"""Refined instruments in continuous time, over the frequencies of the band (see `instruments`)."""

from __future__ import annotations

from armimpedance.joint.elbow.stationary.band import Band
from armimpedance.joint.elbow.stationary.estimate import Estimate
from armimpedance.joint.elbow.stationary.instruments import (
    driver_of,
    refined,
    round_of,
    start_values,
)
from armimpedance.joint.elbow.stationary.methods import ElbowMethod
from armimpedance.joint.elbow.stationary.preparation import PreparedSamples


def solve(prepared: PreparedSamples, band: Band) -> Estimate:
    """Estimate with refined instruments.

    Raises EstimationError: I, B or K is not positive, or the rounds do not converge.
    """
    del prepared
    driver = driver_of(band)
    return refined(lambda values: round_of(band, driver, values), start_values(band))


METHOD = ElbowMethod(
    "iv",
    "refined instruments in continuous time, from the device's perturbation if recorded",
    5.0,
    "P. C. Young, Recursive Estimation and Time-Series Analysis (2011), chapters 7, 8",
    solve,
)
