"""Does the limb answer the motion late? A reflex: ``+ exp(-s d) (B_r s + K_r)`` beside I, B, K.

What a stretch reflex or a voluntary answer adds to the torque comes some tens of milliseconds
after the motion. No transfer function of low order is like it: it takes stiffness away at one
frequency and adds it at another, and the K of a joint of second order is then a mean that depends
on the band. Fitted for each delay of a grid by linear least squares with the weights of the joint.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from armimpedance.arrays import FloatArray
from armimpedance.elbow.stationary.band import Band, Bins, Complex, impedance, real_rows
from armimpedance.elbow.stationary.estimate import without
from armimpedance.elbow.stationary.orders import BIC_GAIN, ENOUGH, SQUARES_GAIN

#: From a short-latency reflex with its muscle's rise to a voluntary answer, s.
DELAYS_S: Final = np.arange(3, 16) / 100
#: Muscles follow no faster: above, what is no joint is soft tissue or the device.
HIGHEST_HZ: Final = 20.0


@dataclass(frozen=True)
class Feedback:
    """The delay that leaves least.

    Attributes
    ----------
    delay_s : float
    gain : float
        Part of the weighted squares of a joint of second order that it takes away.
    bic_gain : float
        By which its BIC is lower.
    values : (3,)
        I, B, K beside it.
    answer : (2,)
        B_r, K_r.
    """

    delay_s: float
    gain: float
    bic_gain: float
    values: FloatArray
    answer: FloatArray


def delayed_feedback(band: Band, values: FloatArray) -> Feedback:
    """The best delay on the grid, weights at I, B, K (3,), up to `HIGHEST_HZ`."""
    band = _below(band)
    joint = _left(band, values, None)[1]
    found = [(_left(band, values, float(d)), float(d)) for d in DELAYS_S]
    (parameters, squares), delay = min(found, key=lambda f: f[0][1])
    rows = sum(2 * len(b.s) - b.ends.shape[1] for b in band.trials)
    tiny = np.finfo(float).tiny
    bic = rows * float(np.log(max(joint, tiny) / max(squares, tiny))) - 3 * float(np.log(rows))
    gain = 1 - squares / joint if joint > 0 else 0.0
    return Feedback(delay, gain, bic, parameters[:3], parameters[3:])


def feedback_warning(feedback: Feedback, unexplained: float) -> str | None:
    """A sentence where a late answer leaves clearly less, at a delay inside the grid."""
    inside = DELAYS_S[0] < feedback.delay_s < DELAYS_S[-1]
    clear = feedback.bic_gain >= BIC_GAIN and feedback.gain >= SQUARES_GAIN
    if unexplained < ENOUGH or not (inside and clear):
        return None
    return (
        f"an answer to the motion after {1e3 * feedback.delay_s:.0f} ms (a reflex) leaves "
        f"{100 * feedback.gain:.0f} % less below {HIGHEST_HZ:g} Hz, with K "
        f"{feedback.values[2]:.3g} beside it: K depends on the band"
    )


def _below(band: Band) -> Band:
    """Its lines up to `HIGHEST_HZ`."""
    trials = []
    for bins in band.trials:
        low = bins.frequency_hz <= HIGHEST_HZ
        trials.append(bins.of_lines(low))
    return replace(band, trials=tuple(trials))


def _left(band: Band, values: FloatArray, delay_s: float | None) -> tuple[FloatArray, float]:
    """Parameters and weighted squares left."""
    tables = []
    for bins in band.trials:
        weight = np.sqrt(2 / bins.noise_power(impedance(bins, values)))
        columns = np.column_stack([_columns(bins, delay_s), bins.torque]) * weight[:, None]
        tables.append(without(real_rows(bins.ends * weight[:, None]), real_rows(columns))[0])
    table = np.concatenate(tables)
    X, y = table[:, :-1], table[:, -1]
    scale = np.linalg.norm(X, axis=0)
    # X (n, 3 or 5) [I B K B_r K_r] = Tau (n,)
    parameters = np.linalg.lstsq(X / scale, y, rcond=None)[0] / scale
    return parameters, float(((y - X @ parameters) ** 2).sum())


def _columns(bins: Bins, delay_s: float | None) -> Complex:
    own = bins.powers * bins.angle[:, None]
    if delay_s is None:
        return own
    late = np.exp(-bins.s * delay_s)[:, None]
    return np.concatenate([own, own[:, 1:] * late], axis=1)
