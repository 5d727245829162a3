"""Methods for I, B and K at an operating point: a file each, with its record `METHOD`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from armimpedance.core.method_table import MethodTable

if TYPE_CHECKING:
    from armimpedance.joint.elbow.stationary.band import Band
    from armimpedance.joint.elbow.stationary.estimate import Estimate
    from armimpedance.joint.elbow.stationary.preparation import PreparedSamples


@dataclass(frozen=True)
class ElbowMethod:
    """A method for I, B and K at an operating point.

    `description`: one line.
    `lowest_snr_db`: lowest signal to noise of torque and of angle for which I, B and K of a 10 s
    record at 1 kHz are within 10 % rms (``benchmarks/elbow/snr.py``). The method refuses records
    below it.
    `identify`: estimates I, B, K from the prepared samples and the weighted band.
    """

    name: str
    description: str
    lowest_snr_db: float
    reference: str
    identify: Callable[[PreparedSamples, Band], Estimate]


#: The methods by their names.
METHODS: Final[MethodTable[ElbowMethod]] = MethodTable(
    "armimpedance.joint.elbow.stationary.methods", "METHOD", "method", default="iv", joint="-"
)
