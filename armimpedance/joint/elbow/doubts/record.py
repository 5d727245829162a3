"""The record for the tests of a stationary fit: band, earlier angles, terms of amplitude.

``tau = (I s^2 + B s + K) theta + K_r h theta + sum c_j phi_j(theta, theta') + noise``, h a pathway
(see `pathway`). Its response to earlier angles is computed from the samples. Therefore the
beginning of every trial is used only as the past of the rest, and is not fitted.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.joint.elbow.doubts.pathway import (
    PAST_S,
    ReflexArc,
    answered_to,
    cubic_weights,
    response,
)
from armimpedance.joint.elbow.samples import JointSamples
from armimpedance.joint.elbow.stationary.band import Band, Bins, Complex, band_of, real_rows
from armimpedance.joint.elbow.stationary.instruments import Driver, imposed_correction
from armimpedance.joint.elbow.stationary.preparation import PreparedSamples, without_ramp
from armimpedance.joint.elbow.stationary.weights import hats, knots_of

#: The terms of amplitude: two of stiffness, two of friction.
BENDS: Final = ("theta^2", "theta^3", "sign theta'", "theta' |theta'|")
#: Weighted columns with a smaller sum of squares are only rounding.
_LEAST_SQUARES: Final = 1e-30
#: Share of its rms below which the sign of a velocity is smoothed.
_SLOW: Final = 0.1


@dataclass(frozen=True, eq=False)
class Past:
    """Data of one trial beyond its `Bins`.

    `angle` (S,): the measured angle, including the beginning.
    `start`: index of its first sample in the band.
    `rate_hz`: sample rate.
    `bends` (n, C): terms of amplitude of the measured motion.
    """

    angle: FloatArray
    start: int
    rate_hz: float
    bends: Complex

    def answered(self, pathway: ReflexArc, bins: Bins) -> Complex:
        """Coefficients (n,) of a pathway's response to the measured angle."""
        late = answered_to(self.angle, pathway, self.start, self.rate_hz)
        return coefficients(late[None], bins)[:, 0]


@dataclass(frozen=True, eq=False)
class Doubted:
    """Band of the record without the beginning of each trial, and data for the tests.

    `band`: weighted by the sensors' noise floors.
    `samples`: number of samples of each trial in the band.
    """

    band: Band
    trials: tuple[Past, ...]
    samples: tuple[int, ...]


def doubted(prepared: PreparedSamples, whole_band: Band) -> Doubted:
    """Return the record without the beginning of each trial, which is kept as the past of the rest.

    Raises InputError: the band holds too few coefficients.
    """
    whole = prepared.source
    rate = whole.sample_rate_hz
    start = int(np.ceil(PAST_S * rate)) + 2
    cut = without_beginning(whole, start)
    band = band_of(replace(prepared, source=cut), whole_band.source)
    trials = []
    for row, bins in enumerate(band.trials):
        angle = whole.angle[whole.samples_of(row)]
        trials.append(Past(angle, start, rate, bends_of(bins.angle, bins, len(angle) - start)))
    lengths = tuple(int(n) for n in np.diff(cut.offsets))
    return Doubted(band, tuple(trials), lengths)


def without_beginning(samples: JointSamples, start: int) -> JointSamples:
    """Return every trial from its sample `start` on."""
    kept = np.ones(len(samples.angle), dtype=bool)
    for first in samples.offsets[:-1]:
        kept[first : first + start] = False
    lengths = np.diff(samples.offsets) - start
    changed = {
        name: getattr(samples, name)[kept]
        for name in ("torque", "angle", "perturbation", "command")
        if getattr(samples, name) is not None
    }
    return replace(samples, offsets=np.concatenate([[0], np.cumsum(lengths)]), **changed)


def coefficients(series: FloatArray, bins: Bins) -> Complex:
    """Unitary coefficients (n, m) of series (m, S) at the lines of `bins`."""
    count = series.shape[-1]
    first = round(float(bins.frequency_hz[0]) * bins.seconds)
    whole = np.fft.rfft(without_ramp(series), axis=-1) / np.sqrt(count)
    return np.asarray(whole[:, first : first + len(bins.s)].T, dtype=np.complex128)


def bends_of(angle: Complex, bins: Bins, count: int) -> Complex:
    """Coefficients (n, C) of the terms of amplitude, from the coefficients (n,) of a motion."""
    return coefficients(bends_in_time(angle, bins, count), bins)


def bends_in_time(angle: Complex, bins: Bins, count: int) -> FloatArray:
    """Terms of amplitude of a motion over time, (C, S), each of unit rms."""
    first = round(float(bins.frequency_hz[0]) * bins.seconds)
    spectrum = np.zeros((2, count // 2 + 1), dtype=np.complex128)
    spectrum[:, first : first + len(bins.s)] = np.stack([angle, bins.s * angle]) * np.sqrt(count)
    q, v = np.fft.irfft(spectrum, count, axis=1)
    return np.stack([q**2, q**3, v / np.sqrt(v**2 + _SLOW**2 * (v**2).mean()), v * np.abs(v)])


# Competing models of one record: linear least squares, each with its own residual spectrum.
#
# The residual's spectrum includes a model's misfit: with the spectrum of another model, the misfit
# looks larger or smaller than it is. Each model's deviance is therefore minimised over its
# parameters and its spectrum in turn: ``sum nu (ln g + r / g)``, P. Whittle, Ark. Mat. 2, 1953; the
# logarithm of g is linear between knots (see `stationary.weights`).

_ROUNDS: Final = 3
_STEPS: Final = 5
_LONGEST: Final = 1.0


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Shape functions (hats) of a noise spectrum over the lines.

    `hats` (n, k). `squares` (n,): number of independent squares per line.
    """

    hats: FloatArray
    squares: FloatArray

    @classmethod
    def over(cls, frequency_hz: FloatArray, squares: FloatArray) -> Spectrum:
        """Hats with the knots of the weights, over lines of all trials (n,)."""
        return cls(hats(np.log(frequency_hz), np.log(knots_of(frequency_hz))), squares)

    def logarithms(self, power: FloatArray) -> FloatArray:
        """``ln g`` (m, n) of each of m residuals with powers (m, n), by Fisher's scoring."""
        weight = self.hats * self.squares[:, None]
        tiny = np.finfo(float).tiny
        logs = np.log(power @ weight / np.maximum(weight.sum(axis=0), tiny) + tiny)
        # (H^T nu H)^-1 (k, k) H^T nu (k, n)
        gain = np.linalg.solve(weight.T @ self.hats, weight.T)
        for _ in range(_STEPS):
            eta = logs @ self.hats.T
            logs = logs + np.clip((power * np.exp(-eta) - 1) @ gain.T, -_LONGEST, _LONGEST)
        return np.asarray(logs @ self.hats.T)


@dataclass(frozen=True, eq=False)
class WhittleFit:
    """Fits of m models of p parameters, each with its own residual spectrum.

    `values` (m, p).
    `information` (m, p, p): X^T W X with the model's own weights; its inverse is the covariance.
    `deviance` (m,): minus twice the logarithm of the likelihood, up to a constant that all share.
    `eta` (m, n): logarithm of the model's noise power over the reference power.
    """

    values: FloatArray
    information: FloatArray
    deviance: FloatArray
    eta: FloatArray


def fit_models(X: FloatArray, y: FloatArray, spectrum: Spectrum, prior: FloatArray) -> WhittleFit:
    """Fit m models ``y = X p + e`` to the same rows.

    `y` (n, 2).
    `X` (m, n, 2, p): real and imaginary part of each line's columns, weighted by the reference.
    `prior` (p,): one over the prior variance of each parameter about zero; 0 = no prior.
    """
    m, n, _, p = X.shape
    eta = np.zeros((m, n))
    rows = X.reshape(m, 2 * n, p)
    scale = np.sqrt((rows**2).sum(axis=1)) + np.finfo(float).tiny
    rows = rows / scale[:, None, :]
    ridge = np.einsum("mp,pq->mpq", prior / scale**2, np.eye(p))
    target = y.reshape(2 * n)
    for turn in range(_ROUNDS):
        weight = np.repeat(np.exp(-eta), 2, axis=1)
        weighed = rows * weight[:, :, None]
        # N (m, p, p) = X^T W X + prior, N p (m, p) = X^T W y
        N = np.swapaxes(weighed, 1, 2) @ rows + ridge
        values = np.linalg.solve(N, (np.swapaxes(weighed, 1, 2) @ target)[..., None])[..., 0]
        e = target - (rows @ values[..., None])[..., 0]
        power = (e.reshape(m, n, 2) ** 2).sum(axis=2) / np.maximum(spectrum.squares, 1e-300)
        if turn < _ROUNDS - 1:
            eta = spectrum.logarithms(power)
    last = spectrum.logarithms(power)
    deviance = (spectrum.squares * (last + power * np.exp(-last))).sum(axis=1)
    deviance = deviance + ((values / scale) ** 2 * prior).sum(axis=1)
    return WhittleFit(values / scale, N * scale[:, :, None] * scale[:, None, :], deviance, eta)


# The equation of motion about the present model, as a regression on columns without noise.
#
# The instruments ``X_c`` are the columns of the motion that the record's source explains; e is the
# residual with the measured columns X. The regression of ``y = e + X_c p`` on X_c has its fixed
# point where ``X_c^H W (tau - X p) = 0``, the equation of refined instruments. There it is an
# ordinary regression, so models can be compared by their deviances.


@dataclass(frozen=True, eq=False)
class LimbModel:
    """Parameters of a limb with a late answer, a late angle and terms of amplitude.

    `bends` (C,).
    `limb` (3,): I, B, K.
    `answer` (2,): K_r, N m/rad, and B_r, N m s/rad.
    `lateness_s`: delay of the angle after the torque, s.
    """

    limb: FloatArray
    answer: FloatArray
    pathway: ReflexArc
    lateness_s: float
    bends: FloatArray

    def answering(self, s: Complex) -> Complex:
        """``(B_r s + K_r) h`` at s (n,)."""
        h = response(s, *(np.array([x]) for x in self.pathway))[:, 0]
        return np.asarray((self.answer[0] + self.answer[1] * s) * h)

    def impedance(self, bins: Bins) -> Complex:
        """Impedance of limb and answer together, (n,)."""
        return np.asarray(bins.impedance(self.limb) + self.answering(bins.s))


@dataclass(frozen=True, eq=False)
class Posed:
    """Regression to which the models are fitted: weighted real and imaginary part of each line.

    `X` (n, 2, 4 + C): columns of I, B, K, of the lateness and of the bends.
    `y` (n, 2): left-hand side.
    """

    X: FloatArray
    y: FloatArray
    spectrum: Spectrum
    trials: tuple[Moved, ...]

    def late(self, pathway: ReflexArc) -> FloatArray:
        """Columns of K_r and B_r of a pathway, (n, 2, 2)."""
        return np.concatenate([trial.late(pathway) for trial in self.trials])

    @cached_property
    def knots(self) -> Knots:
        """Frequencies at which pathways are evaluated for all lines."""
        return Knots.of(np.concatenate([trial.s for trial in self.trials]))


@dataclass(frozen=True, eq=False)
class Moved:
    """Weighted angle of one trial without noise (n,), and its orthonormal ends Q (2 n, 6)."""

    s: Complex
    weighed: Complex
    Q: FloatArray

    def rows(self, columns: Complex) -> FloatArray:
        """Weighted columns (n, q) as real and imaginary part without the ends, (n, 2, q)."""
        rows, n = real_rows(columns), len(self.s)
        rows = rows - self.Q @ (self.Q.T @ rows)
        return np.asarray(np.stack([rows[:n], rows[n:]], axis=1))

    def late(self, pathway: ReflexArc) -> FloatArray:
        """Like `Posed.late`, for this trial's lines."""
        h = response(self.s, *(np.array([x]) for x in pathway))[:, 0] * self.weighed
        return self.rows(np.stack([h, self.s * h], axis=1))


#: Distance of the knots, Hz: cubics between them give a pathway's response to within 1e-5.
_KNOTS_HZ: Final = 0.1


@dataclass(frozen=True, eq=False)
class Knots:
    """Frequencies between which a pathway's response is a cubic; a record has many more lines.

    The sum ``sum_k x_k h(s_k)`` over n lines equals ``sum_b X_b h(s_b)`` over b knots; X is the
    matrix of the cubics' weights times x.

    `s` (b,). `spread` (b, n): the weights, sparse.
    """

    s: Complex
    spread: Any

    @classmethod
    def of(cls, s: Complex) -> Knots:
        """Choose the knots for lines at `s` (n,)."""
        from scipy.sparse import csr_matrix

        at = s.imag / (2 * np.pi * _KNOTS_HZ)
        whole = np.floor(at).astype(int)
        first = int(whole.min()) - 1
        rows = (whole - 1 - first)[:, None] + np.arange(4)
        weights, lines = cubic_weights(at - whole), np.repeat(np.arange(len(s)), 4)
        count = int(rows.max()) + 1
        spread = csr_matrix((weights.ravel(), (rows.ravel(), lines)), shape=(count, len(s)))
        knots: Complex = np.asarray(2j * np.pi * _KNOTS_HZ * (first + np.arange(count)), complex)
        return cls(knots, spread)

    def summed(self, columns: Complex) -> Complex:
        """Weighted sums X (b, q) of columns (n, q)."""
        return np.asarray(self.spread @ columns)


def posed(doubted: Doubted, driver: Driver, model: LimbModel, power: list[FloatArray]) -> Posed:
    """Regression rows of all trials, linearised about a model.

    `driver`: source of the motion in the band.
    `power`: noise power of the equation by which the lines are weighted, one (n,) array per trial.
    Raises LinAlgError: with this model nothing of the motion is explained.
    """
    parts, shares, moved = [], [], []
    for row, (bins, past) in enumerate(zip(doubted.band.trials, doubted.trials, strict=True)):
        clean, columns = _columns(bins, past, driver, row, model, doubted.samples[row])
        weight = np.sqrt(2 / power[row])
        Q = np.linalg.qr(real_rows(bins.ends * weight[:, None]))[0]
        moved.append(Moved(bins.s, clean * weight, Q))
        parts.append(moved[-1].rows(columns * weight[:, None]))
        n, free = len(bins.s), 1 - (Q**2).sum(axis=1)
        shares.append((free[:n] + free[n:]).clip(1e-3))
    table = np.concatenate(parts)
    if not (table[..., :3] ** 2).sum(axis=(0, 1)).min() > _LEAST_SQUARES:
        raise np.linalg.LinAlgError("nothing is left of the motion")
    frequency = np.concatenate([b.frequency_hz for b in doubted.band.trials])
    spectrum = Spectrum.over(frequency, np.concatenate(shares))
    return Posed(table[..., :-1], table[..., -1], spectrum, tuple(moved))


def _columns(
    bins: Bins, past: Past, driver: Driver, row: int, model: LimbModel, count: int
) -> tuple[Complex, Complex]:
    """Angle without noise (n,); columns of I, B, K, lateness and bends, then the left-hand side y.

    `count`: number of samples of the trial.
    """
    in_step = np.exp(bins.s * model.lateness_s)
    answer, Z = model.answering(bins.s), model.impedance(bins)
    residual = (
        bins.torque - bins.impedance(model.limb) * bins.angle * in_step - past.bends @ model.bends
    )
    if model.answer.any():
        rate = model.answer[0] + model.answer[1] * bins.s
        residual = residual - rate * past.answered(model.pathway, bins) * in_step
    clean = _clean(bins, past, driver, row, model, Z, residual)
    bends = bends_of(clean, bins, count)
    limb = bins.powers * clean[:, None]
    late = bins.s * Z * clean
    # The lateness is counted from zero, not from the model's value.
    y = residual + limb @ model.limb + (answer * clean + model.lateness_s * late)
    return clean, np.column_stack([limb, late, bends, y + bends @ model.bends])


def _clean(
    bins: Bins,
    past: Past,
    driver: Driver,
    row: int,
    model: LimbModel,
    Z: Complex,
    residual: Complex,
) -> Complex:
    """Angle (n,), in step with the torque, that the record's source explains."""
    if driver.imposed:
        in_step = bins.angle * np.exp(bins.s * model.lateness_s)
        return np.asarray(in_step + imposed_correction(bins, Z, residual))
    if driver.motion is None and driver.band is None:
        torque = bins.torque + driver.torque_correction(bins, Z, residual)
        return np.asarray((torque - past.bends @ model.bends) / Z)
    measured = driver.angle(row, bins, model.limb)
    return np.asarray(measured * np.exp(bins.s * model.lateness_s))
