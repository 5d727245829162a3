"""Output error: the angle that the torque makes, against the measured one, both noises weighed."""

from __future__ import annotations

import numpy as np

from armimpedance.elbow.result import NAMES, UNITS
from armimpedance.elbow.stationary.band import Band, in_time
from armimpedance.elbow.stationary.estimate import Estimate, estimate_of
from armimpedance.elbow.stationary.joint_fit import fit_band, linearised
from armimpedance.elbow.stationary.method import Method
from armimpedance.elbow.stationary.preparation import Prepared
from armimpedance.elbow.stationary.rows import Rows, solve_rows


def solve(prepared: Prepared, band: Band) -> Estimate:
    """Gauss-Newton on ln I, ln B, ln K (see `joint_fit`).

    Raises
    ------
    EstimationError
        It does not settle, or the torque has the wrong sign.
    """
    del prepared
    values = fit_band(band)
    rows = []
    for bins in band.trials:
        J, e = linearised(bins, values)
        series = in_time(np.column_stack([J, -e]))
        rows.append(Rows(series[:, :3], series[:, :3], series[:, 3], bins.seconds))
    solved = solve_rows(rows, NAMES)
    # d(I, B, K) = diag(I, B, K) d(logarithms)
    return estimate_of(solved.transformed(values, np.diag(values), NAMES, UNITS))


METHOD = Method(
    "output-error",
    "simulated against measured angle, noise of both channels weighed",
    5.0,
    "R. Pintelon, J. Schoukens, System Identification (2012), chapter 9",
    solve,
)
