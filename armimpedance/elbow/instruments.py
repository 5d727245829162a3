"""Instruments: columns that follow the motion but none of its noise.

``sum Z^T (y - X p) = 0``, Z the columns X of a simulated angle and torque. Where the recording
holds the device's perturbation they are made from that: neither the sensors' noise nor the
subject's own torque, to which the measured one reacts, is in them. Else the angle is simulated
from the measured torque, whose noise inside the band remains. Model, instruments and the filter
that makes the noise of the rows white are refined in turn (P. C. Young, Recursive Estimation and
Time-Series Analysis, 2nd ed. 2011, chapter 7).
"""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.elbow.band import Band, start_values
from armimpedance.elbow.discrete import DiscreteModel, joint_model, to_continuous
from armimpedance.elbow.estimate import Estimate, Rows, Solved, ramp_and_start, solve_rows, without
from armimpedance.elbow.lagged import SHAPE, column_names, lagged, model_of, to_estimate
from armimpedance.elbow.preparation import Prepared
from armimpedance.errors import EstimationError
from armimpedance.records import FloatArray

_ROUNDS: Final = 40
#: A relative change of I, B, K below this has settled.
_SETTLED: Final = 1e-6


def solve(prepared: Prepared, band: Band) -> Estimate:
    """Refined instruments, bilinear structure.

    Raises
    ------
    EstimationError
        The fitted poles or gain are no joint's, or the rounds do not settle.
    """
    rate = prepared.sample_rate_hz
    values = start_values(band)
    for _ in range(_ROUNDS):
        solved = _round(prepared, values, whitening(band, values))
        found = to_continuous(model_of(solved.parameters, rate, "tustin"))
        change = float(np.abs(found / values - 1).max())
        values = found
        if change < _SETTLED:
            return to_estimate(solved, rate, "tustin")
    raise EstimationError(
        f"the instruments do not settle within {_ROUNDS} rounds (last change {change:.1g}): "
        "is the perturbation strong enough? try method output-error"
    )


def _round(prepared: Prepared, values: FloatArray, white: FloatArray) -> Solved:
    rate = prepared.sample_rate_hz
    model, whitener = joint_model(values, rate), joint_model(white, rate)
    rows = []
    for row in range(prepared.n_trials):
        whole, edge = prepared.samples_of(row), prepared.edge
        torque, angle = prepared.torque[whole], prepared.angle[whole]
        clean = torque if prepared.perturbation is None else prepared.perturbation[whole]
        inner = slice(edge, len(torque) - edge)
        table = lagged(angle[inner], torque[inner], "tustin")
        instruments = lagged(simulated(model, clean)[inner], clean[inner], "tustin").X
        columns = np.column_stack([table.X, instruments, table.y, ramp_and_start(len(table.y))])
        filtered = weighed(whitener, columns)
        X, Z, y = without(filtered[:, 7:], filtered[:, :3], filtered[:, 3:6], filtered[:, 6])
        rows.append(Rows(X, Z, y, len(y) / rate))
    return solve_rows(rows, column_names(SHAPE["tustin"]))


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
