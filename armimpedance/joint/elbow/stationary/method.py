"""What the table of stationary methods holds of each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from armimpedance.joint.elbow.stationary.band import Band
from armimpedance.joint.elbow.stationary.estimate import Estimate
from armimpedance.joint.elbow.stationary.preparation import Prepared


@dataclass(frozen=True)
class Method:
    """A method for I, B and K at an operating point.

    Attributes
    ----------
    name : str
    description : str
        One line.
    lowest_snr_db : float
        Lowest signal to noise of torque and of angle: down to here I, B and K of a 10 s record
        at 1 kHz are within 10 % rms (``benchmarks/elbow/snr.py``). Below it the method refuses.
    reference : str
    identify : function
        From the prepared samples and the weighed band.
    """

    name: str
    description: str
    lowest_snr_db: float
    reference: str
    identify: Callable[[Prepared, Band], Estimate]
