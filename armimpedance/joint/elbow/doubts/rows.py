"""The equation of motion about a model so far, as regression on columns without noise.

With instruments ``X_c``, the columns of the motion that the record's source explains, and the
residual e of the measured columns X, the rows ``y = e + X_c p`` regressed on X_c have their fixed
point where ``X_c^H W (tau - X p) = 0``: that of refined instruments. At it y is what an ordinary
regression would be, and models may be compared by their deviances.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.joint.elbow.doubts.record import Doubted, Past, bends_of
from armimpedance.joint.elbow.doubts.whittle import Spectrum
from armimpedance.joint.elbow.stationary.band import Bins, Complex, real_rows
from armimpedance.joint.elbow.stationary.instruments import Driver, imposed_correction


@dataclass(frozen=True, eq=False)
class Model:
    """Limb, late answer, lateness of the angle, terms of amplitude.

    Attributes
    ----------
    limb : (3,)
        I, B, K.
    answer : (2,)
        K_r, N m/rad, and B_r, N m s/rad.
    delay_s : float
    lateness_s : float
        By how much the angle is late.
    bends : (C,)
    """

    limb: FloatArray
    answer: FloatArray
    delay_s: float
    lateness_s: float
    bends: FloatArray

    def answering(self, s: Complex) -> Complex:
        """``(B_r s + K_r) e^(-s d)`` at s (n,)."""
        return np.asarray((self.answer[0] + self.answer[1] * s) * np.exp(-s * self.delay_s))

    def impedance(self, bins: Bins) -> Complex:
        """That of limb and answer together, (n,)."""
        return np.asarray(bins.impedance(self.limb) + self.answering(bins.s))


@dataclass(frozen=True, eq=False)
class Posed:
    """Real and imaginary parts of each line, weighed: what the models are fitted to.

    Attributes
    ----------
    y : (n, 2)
    limb : (n, 2, 4)
        What I, B, K and the lateness beyond the model's multiply.
    late : (n, 2, D, 2)
        What K_r and B_r of each delay multiply.
    bends : (n, 2, C)
    spectrum : Spectrum
    """

    y: FloatArray
    limb: FloatArray
    late: FloatArray
    bends: FloatArray
    spectrum: Spectrum


def posed(doubted: Doubted, driver: Driver, model: Model, power: list[FloatArray]) -> Posed:
    """All trials' rows about a model.

    Parameters
    ----------
    doubted : Doubted
    driver : Driver
        Of the doubted band.
    model : Model
    power : one (n,) of each trial
        Noise of the equation that the lines are weighed by.
    """
    parts, shares = [], []
    for row, (bins, past) in enumerate(zip(doubted.band.trials, doubted.trials, strict=True)):
        columns = _columns(bins, past, doubted.delays_s, driver, row, model, doubted.samples[row])
        weight = np.sqrt(2 / power[row])[:, None]
        Q = np.linalg.qr(real_rows(bins.ends * weight))[0]
        rows = real_rows(columns * weight)
        rows = rows - Q @ (Q.T @ rows)
        n = len(bins.s)
        parts.append(np.stack([rows[:n], rows[n:]], axis=1))
        left = 1 - (Q**2).sum(axis=1)
        shares.append((left[:n] + left[n:]).clip(1e-3))
    table = np.concatenate(parts)
    frequency = np.concatenate([b.frequency_hz for b in doubted.band.trials])
    D = len(doubted.delays_s)
    return Posed(
        table[:, :, 0],
        table[:, :, 1:5],
        np.stack([table[:, :, 5 : 5 + D], table[:, :, 5 + D : 5 + 2 * D]], axis=3),
        table[:, :, 5 + 2 * D :],
        Spectrum.over(frequency, np.concatenate(shares)),
    )


def _columns(
    bins: Bins, past: Past, delays_s: FloatArray, driver: Driver, row: int, model: Model, count: int
) -> Complex:
    """The pseudo-torque y; what I, B, K, lateness, K_r, B_r of each delay, and bends multiply."""
    in_step = np.exp(bins.s * model.lateness_s)
    number = int(np.abs(delays_s - model.delay_s).argmin())
    turned = np.exp(-bins.s[:, None] * delays_s)
    answer, Z = model.answering(bins.s), model.impedance(bins)
    angle = bins.angle * in_step
    residual = (
        bins.torque
        - bins.impedance(model.limb) * angle
        - (model.answer[0] + model.answer[1] * bins.s) * past.late[:, number] * in_step
        - past.bends @ model.bends
    )
    clean = _clean(bins, past, driver, row, model, Z, residual)
    bends = bends_of(clean, bins, count)
    limb = bins.powers * clean[:, None]
    late = turned * clean[:, None]
    y = residual + limb @ model.limb + answer * clean + bends @ model.bends
    return np.column_stack([y, limb, bins.s * Z * clean, late, bins.s[:, None] * late, bends])


def _clean(
    bins: Bins,
    past: Past,
    driver: Driver,
    row: int,
    model: Model,
    Z: Complex,
    residual: Complex,
) -> Complex:
    """The angle, in step with the torque, that the record's source explains, (n,)."""
    if driver.imposed:
        in_step = bins.angle * np.exp(bins.s * model.lateness_s)
        return np.asarray(in_step + imposed_correction(bins, Z, residual))
    if driver.motion is None and driver.band is None:
        return np.asarray((bins.torque - past.bends @ model.bends) / Z)
    measured = driver.angle(row, bins, model.limb)
    return np.asarray(measured * np.exp(bins.s * model.lateness_s))
