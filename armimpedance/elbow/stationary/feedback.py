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
from armimpedance.elbow.stationary.band import Band, Bins, Complex
from armimpedance.elbow.stationary.least_squares import LeastSquares, least_squares
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


def delayed_feedback(
    band: Band, values: FloatArray, unexplained: float
) -> tuple[Feedback, str | None]:
    """The best delay on the grid up to `HIGHEST_HZ`, and a warning where it leaves clearly less.

    Parameters
    ----------
    band : Band
    values : (3,)
        I, B, K, whose noise weighs the frequencies.
    unexplained : float
        Part of the angle's power that they do not explain.
    """
    low = [b.of_lines(b.frequency_hz <= HIGHEST_HZ) for b in band.trials]
    band = replace(band, trials=tuple(low))
    weights = [b.weight(b.impedance(values)) for b in band.trials]

    def fit_of(delay_s: float | None) -> LeastSquares:
        return least_squares(band, [_columns(bins, delay_s) for bins in band.trials], weights)

    joint, rows = fit_of(None).squares, band.rows
    late, delay = min(((fit_of(float(d)), float(d)) for d in DELAYS_S), key=lambda f: f[0].squares)
    tiny = np.finfo(float).tiny
    bic = rows * float(np.log(max(joint, tiny) / max(late.squares, tiny))) - 3 * float(np.log(rows))
    gain = 1 - late.squares / joint if joint > 0 else 0.0
    feedback = Feedback(delay, gain, bic, late.parameters[:3], late.parameters[3:])
    return feedback, _warning(feedback, unexplained)


def _warning(feedback: Feedback, unexplained: float) -> str | None:
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


def _columns(bins: Bins, delay_s: float | None) -> Complex:
    """What I, B, K and the late answer's B_r, K_r multiply, and last the torque."""
    own = bins.powers * bins.angle[:, None]
    if delay_s is not None:
        own = np.concatenate([own, own[:, 1:] * np.exp(-bins.s * delay_s)[:, None]], axis=1)
    return np.column_stack([own, bins.torque])
