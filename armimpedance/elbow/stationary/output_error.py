"""Output error: the angle that the torque makes, against the measured one, both noises weighed.

Minimised over I, B, K is ``sum |Z Theta - Tau|^2 / (s_theta^2 |Z|^2 + s_tau^2)`` over the
coefficients of the band: where the torque has no noise this is the error of the simulated angle,
``|Theta - Tau / Z|^2``; with noise of both channels it is the maximum of the likelihood whatever
the true motion was (R. Pintelon, J. Schoukens, System Identification, 2nd ed. 2012, chapter 9).
"""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.arrays import FloatArray
from armimpedance.elbow.result import NAMES
from armimpedance.elbow.stationary.band import (
    Band,
    Bins,
    impedance,
    in_time,
    real_rows,
    residual_rows,
    start_values,
)
from armimpedance.elbow.stationary.estimate import Estimate, Rows, solve_rows, without
from armimpedance.elbow.stationary.preparation import Prepared
from armimpedance.errors import EstimationError

_STEPS: Final = 60
_HALVINGS: Final = 30
#: A step of the logarithms below this has settled.
_SETTLED: Final = 1e-9
_LONGEST: Final = 1.0


def solve(prepared: Prepared, band: Band) -> Estimate:
    """Gauss-Newton on ln I, ln B, ln K.

    Raises
    ------
    EstimationError
        It does not settle, or the torque has the wrong sign.
    """
    del prepared
    values = fit_band(band, start_values(band))
    rows = []
    for bins in band.trials:
        J, e = _linearised(bins, values)
        series = in_time(np.column_stack([J, -e]))
        rows.append(Rows(series[:, :3], series[:, :3], series[:, 3], bins.seconds))
    solved = solve_rows(rows, NAMES)
    to_SI = np.diag(values)
    # C (3, 3) of I, B, K = diag(p) C (3, 3) of their logarithms diag(p)
    return Estimate(
        values,
        to_SI @ solved.covariance @ to_SI,
        to_SI @ solved.classical @ to_SI,
        solved.dof,
        solved.n,
        solved.conditioning,
        moved=solved.moved @ to_SI,
    )


def fit_band(band: Band, start: FloatArray) -> FloatArray:
    """I, B, K (3,) at the minimum nearest to `start`.

    Raises
    ------
    EstimationError
        The search does not settle.
    """
    logs = np.log(start)
    cost = _cost(band, logs)
    for _ in range(_STEPS):
        parts = [_linearised(bins, np.exp(logs)) for bins in band.trials]
        J, e = (np.concatenate([p[i] for p in parts]) for i in range(2))
        # J (n, 3) step (3,) = -e (n,)
        step = np.linalg.lstsq(J, -e, rcond=None)[0]
        step *= min(1.0, _LONGEST / max(float(np.abs(step).max()), 1e-300))
        for _ in range(_HALVINGS):
            better = _cost(band, logs + step)
            if better <= cost:
                break
            step = step / 2
        else:
            step = np.zeros(3)
            better = cost
        logs, cost = logs + step, better
        if np.abs(step).max() < _SETTLED:
            return np.asarray(np.exp(logs))
    raise EstimationError(
        f"output error does not settle within {_STEPS} steps: the record does not hold I, B and K "
        "of one joint"
    )


def _cost(band: Band, logs: FloatArray) -> float:
    return sum(float((residual_rows(b, np.exp(logs)) ** 2).sum()) for b in band.trials)


def _linearised(bins: Bins, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Derivative (2 n, 3) of the weighted residual by the logarithms, and the residual (2 n,)."""
    Z = impedance(bins, values)
    power = bins.noise_power(Z)
    weight = np.sqrt(2 / power)
    ends = real_rows(bins.ends * weight[:, None])
    slope = bins.powers * values
    # d|Z|^2 / d ln p_j = 2 Re(conj(Z) s^j p_j); its factor is the angle's noise alone
    d_power = 2 * bins.angle_noise[:, None] * (np.conj(Z)[:, None] * slope).real
    e = without(ends, real_rows((Z * bins.angle - bins.torque) * weight))[0]
    J = real_rows(slope * (bins.angle * weight)[:, None])
    J = J - 0.5 * e[:, None] * np.concatenate([d_power / power[:, None]] * 2)
    return without(ends, J)[0], e
