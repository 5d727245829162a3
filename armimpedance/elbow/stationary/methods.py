"""The table of stationary methods: one record, one file each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from armimpedance.elbow.stationary import arx, derivative, instruments, output_error
from armimpedance.elbow.stationary.band import Band
from armimpedance.elbow.stationary.estimate import Estimate
from armimpedance.elbow.stationary.preparation import Prepared
from armimpedance.errors import look_up


@dataclass(frozen=True)
class Method:
    """A method.

    Attributes
    ----------
    name : str
    description : str
        One line.
    lowest_snr_db : float
        Of torque and of angle, each: I, B and K are within 10 % (rms) of a 10 s record at 1 kHz
        down to here (``benchmarks/elbow_snr.py``). Below it the method refuses.
    reference : str
    identify : function
    """

    name: str
    description: str
    lowest_snr_db: float
    reference: str
    identify: Callable[[Prepared, Band], Estimate]


METHODS: Final = {
    method.name: method
    for method in (
        Method(
            "arx",
            "least squares in discrete time on filtered, decimated samples",
            15.0,
            "A. F. Ruiz et al. (2011), eqs. (5)-(8)",
            arx.solve,
        ),
        Method(
            "iv",
            "refined instruments in continuous time, from the device's perturbation if recorded",
            5.0,
            "P. C. Young, Recursive Estimation and Time-Series Analysis (2011), chapters 7, 8",
            instruments.solve,
        ),
        Method(
            "output-error",
            "simulated against measured angle, noise of both channels weighed",
            5.0,
            "R. Pintelon, J. Schoukens, System Identification (2012), chapter 9",
            output_error.solve,
        ),
        Method(
            "derivative",
            "filtered derivatives in continuous time, with instruments",
            5.0,
            "P. C. Young, Recursive Estimation and Time-Series Analysis (2011), chapter 8",
            derivative.solve,
        ),
    )
}

DEFAULT: Final = "iv"


def method_named(name: str) -> Method:
    """Look up a method.

    Raises
    ------
    InputError
        If there is none of that name; lists those that there are.
    """
    return look_up(METHODS, name, "method")
