"""Output error: simulated against measured signal, weighted by the noise of both channels.

The experiment determines which signal is the output. If the torque is imposed, the torque that the
subject adds moves the joint: like the sensor's noise, it is an error of the angle. If the angle is
imposed, the subject's torque is part of the measured torque only, and the torque is the output.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.joint.elbow.elbow_result import NAMES, UNITS
from armimpedance.joint.elbow.stationary.band import Band, in_time
from armimpedance.joint.elbow.stationary.estimate import Estimate, Rows, estimate_of, solve_rows
from armimpedance.joint.elbow.stationary.instruments import fit_band, linearised, start_values
from armimpedance.joint.elbow.stationary.methods import ElbowMethod
from armimpedance.joint.elbow.stationary.preparation import PreparedSamples

#: Number of rounds in which the output's error is weighted by the previous fit.
_ROUNDS: Final = 2


def solve(prepared: PreparedSamples, band: Band) -> Estimate:
    """Estimate by Gauss-Newton on ln I, ln B, ln K (see `instruments.fit_band`).

    Raises EstimationError: it does not converge, or the torque has the wrong sign.
    """
    del prepared
    if band.source == "torque":
        values = start_values(band)
        for _ in range(_ROUNDS):
            angle_is_output = _with_angle_as_output(band, values)
            values = fit_band(angle_is_output)
        band = angle_is_output
    else:
        values = fit_band(band)
    rows = []
    for bins in band.trials:
        J, e = linearised(bins, values)
        series = in_time(np.column_stack([J, -e]))
        rows.append(Rows(series[:, :3], series[:, :3], series[:, 3], bins.seconds))
    solved = solve_rows(rows, NAMES)
    # d(I, B, K) = diag(I, B, K) d(logarithms)
    return estimate_of(solved.transformed(values, np.diag(values), NAMES, UNITS))


def _with_angle_as_output(band: Band, values: FloatArray) -> Band:
    """Band in which torque noise beyond the sensor's is counted as an error of the angle."""
    trials = []
    for bins in band.trials:
        # S_v of the torque is S_v / |Z|^2 of the angle, Z that of I, B, K (3,)
        more = np.maximum(bins.torque_noise - band.torque_noise, 0.0)
        of_angle = bins.angle_noise + more / np.abs(bins.impedance(values)) ** 2
        trials.append(replace(bins, torque_noise=bins.torque_noise - more, angle_noise=of_angle))
    return replace(band, trials=tuple(trials))


METHOD = ElbowMethod(
    "output-error",
    "simulated against measured angle or torque, noise of both channels weighed",
    5.0,
    "R. Pintelon, J. Schoukens, System Identification (2012), chapter 9",
    solve,
)
