"""I, B and K of a band: linear least squares to start from, then output error.

Output error: minimised over I, B, K is ``sum |Z Theta - Tau|^2 / (s_theta^2 |Z|^2 + s_tau^2)`` over
the coefficients of the band. Where the torque has no noise this is the error of the simulated
angle, ``|Theta - Tau / Z|^2``; with noise of both channels it is the maximum of the likelihood
whatever the true motion was (R. Pintelon, J. Schoukens, System Identification, 2nd ed. 2012,
chapter 9).
"""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import EstimationError
from armimpedance.joint.elbow.stationary.band import Band, Bins, Complex, real_rows
from armimpedance.joint.elbow.stationary.rows import without

_STARTS: Final = 6
_STEPS: Final = 60
_HALVINGS: Final = 30
#: A step of the logarithms below this has settled.
_SETTLED: Final = 1e-9
_LONGEST: Final = 1.0


def start_values(band: Band) -> FloatArray:
    """Rough positive I, B, K (3,) by linear least squares, weights from the fit before.

    Raises
    ------
    EstimationError
        The torque takes energy from the joint at all frequencies together: its sign is wrong.
    """
    _refuse_wrong_sign(band)
    columns = [np.column_stack([b.powers * b.angle[:, None], b.torque]) for b in band.trials]
    weights = [b.weight(_rough(b)) for b in band.trials]
    values = np.ones(3)
    for _ in range(_STARTS):
        trials = zip(band.trials, columns, weights, strict=True)
        table = np.concatenate([bins.free(w, c) for bins, c, w in trials])
        scale = np.linalg.norm(table[:, :3], axis=0)
        # X (n, 3) [I B K] (3,) = Tau (n,)
        values = np.linalg.lstsq(table[:, :3] / scale, table[:, 3], rcond=None)[0] / scale
        # A parameter lost in the noise starts small, at a tenth of what would be seen.
        values = np.maximum(values, 0.1 * np.linalg.norm(table[:, 3]) / scale / 10)
        weights = [b.weight(b.impedance(values)) for b in band.trials]
    return np.asarray(values)


def _rough(bins: Bins) -> Complex:
    """|Z| from smoothed powers, (n,)."""
    kernel = np.ones(5) / 5
    torque = np.convolve(np.abs(bins.torque) ** 2, kernel, mode="same")
    angle = np.convolve(np.abs(bins.angle) ** 2, kernel, mode="same")
    return np.sqrt(torque / np.maximum(angle, np.finfo(float).tiny)).astype(complex)


def _refuse_wrong_sign(band: Band) -> None:
    work = sum(float((b.torque * np.conj(b.s * b.angle)).real.sum()) for b in band.trials)
    size = sum(float(np.abs(b.torque * b.s * b.angle).sum()) for b in band.trials)
    if work < -0.1 * size:
        raise EstimationError(
            "B comes out negative: the torque takes energy from the joint; it seems to have the "
            "wrong sign (force_by), or the subject drives the motion"
        )


def fit_band(band: Band) -> FloatArray:
    """I, B, K (3,) of output error, at the minimum nearest to `start_values`.

    Raises
    ------
    EstimationError
        The search does not settle, or the torque has the wrong sign.
    """
    logs = np.log(start_values(band))
    cost = _cost(band, logs)
    for _ in range(_STEPS):
        parts = [linearised(bins, np.exp(logs)) for bins in band.trials]
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
    return sum(float((b.residual(np.exp(logs)) ** 2).sum()) for b in band.trials)


def linearised(bins: Bins, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Derivative (2 n, 3) of the weighed residual by the logarithms, and the residual (2 n,)."""
    Z = bins.impedance(values)
    power, weight = bins.noise_power(Z), bins.weight(Z)
    slope = bins.powers * values
    # d|Z|^2 / d ln p_j = 2 Re(conj(Z) s^j p_j); its factor is the angle's noise alone
    d_power = 2 * bins.angle_noise[:, None] * (np.conj(Z)[:, None] * slope).real
    e = bins.residual(values)
    J = real_rows(slope * (bins.angle * weight)[:, None])
    J = J - 0.5 * e[:, None] * np.concatenate([d_power / power[:, None]] * 2)
    return without(real_rows(bins.ends * weight[:, None]), J)[0], e
