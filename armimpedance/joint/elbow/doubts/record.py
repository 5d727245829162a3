"""The record as the doubts see it: its band without the first moments, angles of before, bends.

``tau = (I s^2 + B s + K) theta + K_r h theta + sum c_j phi_j(theta, theta') + noise``, h a pathway
(see `pathway`): what it makes of the angle of a while ago is taken from the samples themselves, so
the first moments of every trial serve as its past alone.
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
#: Weighed columns whose squares are less hold rounding alone.
_LEAST_SQUARES: Final = 1e-30
#: Below this part of its rms a velocity has no sign.
_SLOW: Final = 0.1


@dataclass(frozen=True, eq=False)
class Past:
    """One trial's coefficients beside those of its `Bins`.

    `angle` (S,): the measured angle, the first moments included.
    `start`: where the band begins in it.
    `rate_hz`: of its samples.
    `bends` (n, C): terms of amplitude of the measured motion.
    """

    angle: FloatArray
    start: int
    rate_hz: float
    bends: Complex

    def answered(self, pathway: ReflexArc, bins: Bins) -> Complex:
        """What a pathway makes of the measured angle, (n,)."""
        late = answered_to(self.angle, pathway, self.start, self.rate_hz)
        return coefficients(late[None], bins)[:, 0]


@dataclass(frozen=True, eq=False)
class Doubted:
    """A band of the record without its first moments, with what the doubts ask of it.

    `band`: weighed by the sensors' floors.
    `samples`: of each trial.
    """

    band: Band
    trials: tuple[Past, ...]
    samples: tuple[int, ...]


def doubted(prepared: PreparedSamples, whole_band: Band) -> Doubted:
    """The record without its first moments, and their part in what follows.

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
    """Every trial from its sample `start` on."""
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
    """Coefficients (n, C) of the terms of amplitude of a motion with coefficients (n,)."""
    return coefficients(bends_in_time(angle, bins, count), bins)


def bends_in_time(angle: Complex, bins: Bins, count: int) -> FloatArray:
    """The terms of amplitude of a motion over time, (C, S), each of unit rms."""
    first = round(float(bins.frequency_hz[0]) * bins.seconds)
    spectrum = np.zeros((2, count // 2 + 1), dtype=np.complex128)
    spectrum[:, first : first + len(bins.s)] = np.stack([angle, bins.s * angle]) * np.sqrt(count)
    q, v = np.fft.irfft(spectrum, count, axis=1)
    return np.stack([q**2, q**3, v / np.sqrt(v**2 + _SLOW**2 * (v**2).mean()), v * np.abs(v)])


# Models of one record that compete: linear least squares, each with its own residual spectrum.
#
# The residual's spectrum absorbs what a model misses: judged by the spectrum of another one, a
# misfit looks larger or smaller than it is. Each model's deviance is therefore minimised over its
# parameters and its spectrum in turn: ``sum nu (ln g + r / g)``, P. Whittle, Ark. Mat. 2, 1953; the
# logarithm of g is linear between knots (see `stationary.weights`).

_ROUNDS: Final = 3
_STEPS: Final = 5
_LONGEST: Final = 1.0


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Hats over the lines, and how many squares each line holds.

    `hats` (n, k), `squares` (n,).
    """

    hats: FloatArray
    squares: FloatArray

    @classmethod
    def over(cls, frequency_hz: FloatArray, squares: FloatArray) -> Spectrum:
        """Knots as the weights have them, over lines of all trials (n,)."""
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
    """m models of p parameters, each with its own spectrum.

    `values` (m, p).
    `information` (m, p, p): X^T W X with the model's own weights; its inverse is the covariance.
    `deviance` (m,): minus twice the logarithm of the likelihood, up to a constant that all share.
    `eta` (m, n): logarithm of the model's noise power over the reference.
    """

    values: FloatArray
    information: FloatArray
    deviance: FloatArray
    eta: FloatArray


def fit_models(X: FloatArray, y: FloatArray, spectrum: Spectrum, prior: FloatArray) -> WhittleFit:
    """Fit m models ``y = X p + e`` to the same rows.

    `y` (n, 2).
    `X` (m, n, 2, p): real and imaginary part of each line's columns, weighed by the reference.
    `prior` (p,): one over the variance of each parameter before the record, about zero; 0 = free.
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


# The equation of motion about a model so far, as regression on columns without noise.
#
# With instruments ``X_c``, the columns of the motion that the record's source explains, and the
# residual e of the measured columns X, the rows ``y = e + X_c p`` regressed on X_c have their fixed
# point where ``X_c^H W (tau - X p) = 0``: that of refined instruments. At it y is what an ordinary
# regression would be, and models may be compared by their deviances.


@dataclass(frozen=True, eq=False)
class LimbModel:
    """Limb, late answer, lateness of the angle, terms of amplitude.

    `bends` (C,).
    `limb` (3,): I, B, K.
    `answer` (2,): K_r, N m/rad, and B_r, N m s/rad.
    `lateness_s`: by how much the angle is late.
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
        """That of limb and answer together, (n,)."""
        return np.asarray(bins.impedance(self.limb) + self.answering(bins.s))


@dataclass(frozen=True, eq=False)
class Posed:
    """Real and imaginary parts of each line, weighed: what the models are fitted to.

    `X` (n, 2, 4 + C): what I, B, K, the lateness and the bends multiply.
    `y` (n, 2): what is explained.
    """

    X: FloatArray
    y: FloatArray
    spectrum: Spectrum
    trials: tuple[Moved, ...]

    def late(self, pathway: ReflexArc) -> FloatArray:
        """What K_r and B_r of a pathway multiply, (n, 2, 2)."""
        return np.concatenate([trial.late(pathway) for trial in self.trials])

    @cached_property
    def knots(self) -> Knots:
        """Frequencies at which pathways are evaluated for all lines."""
        return Knots.of(np.concatenate([trial.s for trial in self.trials]))


@dataclass(frozen=True, eq=False)
class Moved:
    """One trial's weighed angle without noise (n,), and the orthonormal ends Q (2 n, 6)."""

    s: Complex
    weighed: Complex
    Q: FloatArray

    def rows(self, columns: Complex) -> FloatArray:
        """Weighed columns (n, q) as real and imaginary part without the ends, (n, 2, q)."""
        rows, n = real_rows(columns), len(self.s)
        rows = rows - self.Q @ (self.Q.T @ rows)
        return np.asarray(np.stack([rows[:n], rows[n:]], axis=1))

    def late(self, pathway: ReflexArc) -> FloatArray:
        """As of `Posed.late`, this trial's lines."""
        h = response(self.s, *(np.array([x]) for x in pathway))[:, 0] * self.weighed
        return self.rows(np.stack([h, self.s * h], axis=1))


#: Knots are so far apart, Hz: cubics between them miss a pathway's response by 1e-5 at most.
_KNOTS_HZ: Final = 0.1


@dataclass(frozen=True, eq=False)
class Knots:
    """Frequencies between which what a pathway does is a cubic: a record has many more lines.

    ``sum_k x_k h(s_k)`` over n lines is ``sum_b X_b h(s_b)`` over b knots, X the cubics' weights
    times x.

    `s` (b,); `spread` (b, n), sparse.
    """

    s: Complex
    spread: Any

    @classmethod
    def of(cls, s: Complex) -> Knots:
        """`s` (n,)."""
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
        """X (b, q) of columns (n, q)."""
        return np.asarray(self.spread @ columns)


def posed(doubted: Doubted, driver: Driver, model: LimbModel, power: list[FloatArray]) -> Posed:
    """All trials' rows about a model.

    `driver`: of the doubted band.
    `power` one (n,) of each trial: noise of the equation that the lines are weighed by.
    Raises LinAlgError: about this model nothing is left of the motion.
    """
    parts, shares, moved = [], [], []
    for row, (bins, past) in enumerate(zip(doubted.band.trials, doubted.trials, strict=True)):
        clean, columns = _columns(bins, past, driver, row, model, doubted.samples[row])
        weight = np.sqrt(2 / power[row])
        Q = np.linalg.qr(real_rows(bins.ends * weight[:, None]))[0]
        moved.append(Moved(bins.s, clean * weight, Q))
        parts.append(moved[-1].rows(columns * weight[:, None]))
        n, left = len(bins.s), 1 - (Q**2).sum(axis=1)
        shares.append((left[:n] + left[n:]).clip(1e-3))
    table = np.concatenate(parts)
    if not (table[..., :3] ** 2).sum(axis=(0, 1)).min() > _LEAST_SQUARES:
        raise np.linalg.LinAlgError("nothing is left of the motion")
    frequency = np.concatenate([b.frequency_hz for b in doubted.band.trials])
    spectrum = Spectrum.over(frequency, np.concatenate(shares))
    return Posed(table[..., :-1], table[..., -1], spectrum, tuple(moved))


def _columns(
    bins: Bins, past: Past, driver: Driver, row: int, model: LimbModel, count: int
) -> tuple[Complex, Complex]:
    """The angle without noise (n,); what I, B, K, lateness, bends multiply; the pseudo-torque y.

    `count`: samples of the trial.
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
    # The lateness counts from zero, not from the model's.
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
    """The angle, in step with the torque, that the record's source explains, (n,)."""
    if driver.imposed:
        in_step = bins.angle * np.exp(bins.s * model.lateness_s)
        return np.asarray(in_step + imposed_correction(bins, Z, residual))
    if driver.motion is None and driver.band is None:
        torque = bins.torque + driver.torque_correction(bins, Z, residual)
        return np.asarray((torque - past.bends @ model.bends) / Z)
    measured = driver.angle(row, bins, model.limb)
    return np.asarray(measured * np.exp(bins.s * model.lateness_s))
