"""Test if a law of EMG is linear, without lag, and constant: further terms, one kind at a time.

A score test: the terms' scores under the law, orthogonal to the law's own, are summed over the
record and compared with their spread between blocks. With C blocks and k terms,

    T = r^T V^-1 r,   r = sum_b s_b,   V = sum_b s_b s_b^T,   T / C ~ Beta(k / 2, (C - k) / 2)

for normal scores, whatever their common covariance. The significance level is therefore correct for
coloured errors, and with the amplitudes' own errors.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.special import chdtrc, fdtrc

from armimpedance.core.arrays import FloatArray
from armimpedance.joint.elbow.varying.basis import (
    BasisFit,
    basis_columns,
    blocked,
    error_columns,
    error_moments,
    low_excess,
)
from armimpedance.joint.elbow.varying.data import VaryingData
from armimpedance.joint.elbow.varying.equation import Linearised
from armimpedance.numerics.signals import lowpass

#: A missing term is reported if its p value is below this, and it changes K or B by more than
#: `MATTERS` of their mean (rms).
UNLIKELY: Final = 1e-3
MATTERS: Final = 0.02
#: Level for squares: the noise of the amplitudes is slightly skewed, which bends a straight law
#: (1 of 44 clean sessions had p = 5e-6, saturating ones 8e-6 to 1e-21).
UNLIKELY_BEND: Final = 3e-6
#: Largest number of functions of the free course.
MOST_FREE: Final = 12
#: For rates, an amplitude is filtered where errors are this share of its power or more.
ERRORS_SHARE: Final = 0.5
#: Width of the averaging of the amplitudes' spectrum, Hz, and the lowest edge of the filter.
SPECTRUM_HZ: Final = 0.3
LOWEST_HZ: Final = 1.0


@dataclass(frozen=True)
class LawDeparture:
    """Test of terms added to the linear law: p value, and change of B and K.

    `p`: probability of a statistic as large if the law holds.
    `moves` (2,): rms of the change of B and K over their means.
    `size` (k,): coefficients of the terms.
    """

    p: float
    moves: FloatArray
    size: FloatArray

    def matters(self, unlikely: float = UNLIKELY) -> bool:
        """Return True if the terms are both significant and large."""
        return bool(self.p < unlikely and self.moves.max() > MATTERS)


@dataclass(frozen=True)
class LawTerms:
    """Further functions of time, and draws of their errors due to the amplitudes' errors.

    `of_B`, `of_K` (N, f), `error_B`, `error_K` (M, N, f) or None.
    `shared`: True if a function of B and that of K have one common coefficient.
    """

    of_B: FloatArray
    of_K: FloatArray
    error_B: FloatArray | None = None
    error_K: FloatArray | None = None
    shared: bool = False

    def columns(self, eq: Linearised) -> FloatArray:
        """Columns (R, k) of the equation."""
        return self._columns(eq, self.of_B, self.of_K)

    def error_columns(self, eq: Linearised) -> Iterator[FloatArray]:
        """Draws of the columns' errors, (R, k) each."""
        if self.error_B is None or self.error_K is None:
            return iter(())
        pairs = zip(self.error_B, self.error_K, strict=True)
        return (self._columns(eq, of_B, of_K) for of_B, of_K in pairs)

    def moves(self, size: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Changes (N,) of B and of K."""
        f = self.of_B.shape[1]
        return self.of_B @ size[:f], self.of_K @ (size if self.shared else size[f:])

    def _columns(self, eq: Linearised, of_B: FloatArray, of_K: FloatArray) -> FloatArray:
        at = eq.centre
        parts = of_B[at] * eq.x1[:, None], of_K[at] * eq.x0[:, None]
        return parts[0] + parts[1] if self.shared else np.concatenate(parts, axis=1)


def departures(
    data: VaryingData, fit: BasisFit, law: FloatArray, error: FloatArray | None
) -> tuple[str, ...]:
    """Warnings on departures from the law: a lag, squares, a course independent of the amplitudes.

    `law` (N, 1 + m): one and the amplitudes.
    `error` (M, N, 2 (1 + m)) or None: draws of the amplitudes' errors.
    """
    messages = []
    lag = departure(data, fit, law, lag_terms(data, fit, law, error), error)
    if lag.matters():
        messages.append(
            f"K and B do not follow the amplitudes at once (p = {lag.p:.1g}): a lag of about "
            f"{1e3 * lag.size[0]:.0f} ms; the linear law does not hold"
        )
    curved = departure(data, fit, law, square_terms(law, error), error)
    if curved.matters(UNLIKELY_BEND):
        messages.append(
            f"squares of the amplitudes are needed (p = {curved.p:.1g}; they move K by "
            f"{100 * curved.moves[1]:.0f} %, B by {100 * curved.moves[0]:.0f} %): the linear law "
            "does not hold"
        )
    free = departure(data, fit, law, free_terms(data, law, error), error)
    if free.matters():
        messages.append(
            f"K or B changes beside the amplitudes (p = {free.p:.1g}; by "
            f"{100 * free.moves[1]:.0f} % of K, {100 * free.moves[0]:.0f} % of B): the law does "
            "not hold"
        )
    return tuple(messages)


def lag_terms(
    data: VaryingData, fit: BasisFit, law: FloatArray, error: FloatArray | None
) -> LawTerms:
    """Term of a lag, ``a(t - lag) = a - lag a'``: one lag for B and K, whose coefficient is in
    s."""
    m = law.shape[1]
    b, k = fit.coefficients[1:m], fit.coefficients[m + 1 :]
    if error is None:
        rate = _rates(data, law[:, 1:], None)
        return LawTerms(-(rate @ b)[:, None], -(rate @ k)[:, None], shared=True)
    band = [_seen_band(data, law[:, j], error[:, :, j]) for j in range(1, m)]
    rate = _rates(data, law[:, 1:], band)
    drawn = np.stack([_rates(data, draw[:, 1:m], band) for draw in error])
    return LawTerms(
        -(rate @ b)[:, None],
        -(rate @ k)[:, None],
        -(drawn @ b)[:, :, None],
        -(drawn @ k)[:, :, None],
        shared=True,
    )


def square_terms(law: FloatArray, error: FloatArray | None) -> LawTerms:
    """Squares and products of the amplitudes, without the part that the law describes."""
    a, m = law[:, 1:], law.shape[1]
    pairs = [(i, j) for i in range(m - 1) for j in range(i, m - 1)]
    squares = np.stack([a[:, i] * a[:, j] for i, j in pairs], axis=1)
    if error is None:
        return _beside(law, squares, None, None)
    n = error[:, :, 1:m]
    lost = np.stack([a[:, i] * n[:, :, j] + a[:, j] * n[:, :, i] for i, j in pairs], axis=2)
    return _beside(law, squares, lost, error[:, :, :m])


def free_terms(data: VaryingData, law: FloatArray, error: FloatArray | None) -> LawTerms:
    """Slow courses independent of the law: polynomials of time within trials, or over all
    trials."""
    T = len(data.trials)
    degree = (MOST_FREE + 1) // T - 1
    free: FloatArray
    if degree < 0:
        whole = np.polynomial.legendre.legvander(np.linspace(-1, 1, len(law)), MOST_FREE)
        free = np.asarray(whole[:, 1:], dtype=np.float64)
    else:
        free = np.zeros((len(law), T * (degree + 1)))
        for t, (a, b) in enumerate(zip(data.offsets[:-1], data.offsets[1:], strict=True)):
            x = np.linspace(-1, 1, int(b - a))
            columns = slice(t * (degree + 1), (t + 1) * (degree + 1))
            free[a:b, columns] = np.polynomial.legendre.legvander(x, degree)
        # the sum of all constants is part of the law
        free = free[:, 1:]
    if error is None:
        return _beside(law, free, None, None)
    law_error = error[:, :, : law.shape[1]]
    return _beside(law, free, np.zeros((*law_error.shape[:2], free.shape[1])), law_error)


def _beside(
    law: FloatArray, further: FloatArray, lost: FloatArray | None, law_error: FloatArray | None
) -> LawTerms:
    """Remove the part of further functions that the law describes, and scale the rest."""
    # fitted (1 + m, f): law (N, 1 + m) fitted = further (N, f)
    fitted = np.linalg.lstsq(law, further, rcond=None)[0]
    rest = further - law @ fitted
    scale = np.sqrt((rest**2).mean(axis=0))
    scale = np.where(scale > 0, scale, 1.0)
    error = None if lost is None or law_error is None else (lost - law_error @ fitted) / scale
    return LawTerms(rest / scale, rest / scale, error, error)


def _rates(data: VaryingData, amplitude: FloatArray, band: list[float] | None) -> FloatArray:
    """Rates of the amplitudes (N, m), 1/s, within trials, below band edges (m,) in Hz."""
    out = np.empty_like(amplitude)
    for a, b in zip(data.offsets[:-1], data.offsets[1:], strict=True):
        for j, values in enumerate(amplitude[a:b].T):
            if band is not None and band[j] < 0.4 * data.rate_hz:
                values = lowpass(values, band[j], data.rate_hz, order=2, axis=0)
            out[a:b, j] = np.gradient(values, 1 / data.rate_hz)
    return out


def _seen_band(data: VaryingData, amplitude: FloatArray, error: FloatArray) -> float:
    """Lowest frequency (Hz) from which errors (M, N) are most of an amplitude (N,)."""
    first = slice(0, int(np.diff(data.offsets).min()))
    taper = np.hanning(first.stop)
    about = [amplitude[a:][first] for a in data.offsets[:-1]]
    seen = np.mean([np.abs(np.fft.rfft((x - x.mean()) * taper)) ** 2 for x in about], axis=0)
    noise = (np.abs(np.fft.rfft(error[:, first] * taper, axis=1)) ** 2).mean(axis=0)
    frequency = np.arange(len(seen)) * data.rate_hz / first.stop
    width = max(round(SPECTRUM_HZ / frequency[1]), 1)
    kernel = np.full(width, 1 / width)
    share = np.convolve(noise, kernel, "same") / np.maximum(
        np.convolve(seen, kernel, "same"), np.finfo(float).tiny
    )
    hidden = frequency[(share > ERRORS_SHARE) & (frequency >= LOWEST_HZ)]
    return float(hidden[0]) if len(hidden) else float(frequency[-1])


def departure(
    data: VaryingData, fit: BasisFit, law: FloatArray, terms: LawTerms, error: FloatArray | None
) -> LawDeparture:
    """Score test of further terms."""
    eq, m = fit.eq, law.shape[1]
    own, further = basis_columns(eq, law, law), terms.columns(eq)
    o, q = own.shape[1], own.shape[1] + further.shape[1]
    white = eq.whitened(np.column_stack([own, further, eq.y]))
    grams = blocked(data, white)
    S = np.zeros((len(grams), q, q))
    if error is not None:
        both = zip(error_columns(eq, error, m), terms.error_columns(eq), strict=True)
        draws = (np.concatenate(pair, axis=1) for pair in both)
        S = error_moments(data, eq, q, draws, np.r_[1 : 1 + 2 * m, o:q])
    moments = grams[:, :-1, :-1] - S
    A, b = moments.sum(axis=0), grams[:, :-1, -1].sum(axis=0)
    last = np.arange(o - len(eq.prior_sd), o)
    A[last, last] += eq.prior_sd**-2
    # terms z (k,) after elimination of the law's own: (A_zz - A_zo A_oo^-1 A_oz) z = r
    mixed = np.linalg.solve(A[:o, :o], A[:o, o:])
    information = A[o:, o:] - A[o:, :o] @ mixed
    law_alone = np.linalg.solve(A[:o, :o], b[:o])
    right = b[o:] - A[o:, :o] @ law_alone
    size = np.linalg.lstsq(information, right, rcond=1e-10)[0]
    if error is None:
        noise = low_excess(white @ np.concatenate([mixed @ -size + law_alone, size, [-1.0]]))
        p = float(chdtrc(len(right), max(float(size @ right), 0.0) / noise))
    else:
        scores = grams[:, :-1, -1] - moments[:, :, :o] @ law_alone
        p = _probability(scores[:, o:] - scores[:, :o] @ mixed)
    means = np.array([np.abs(fit.course.B).mean(), np.abs(fit.course.K).mean()])
    moves = np.sqrt([(moved**2).mean() for moved in terms.moves(size)]) / means
    return LawDeparture(p, moves, size)


def _probability(scores: FloatArray) -> float:
    """p value of the sum of C independent scores (C, k) of mean zero and one covariance."""
    C, k = scores.shape
    if k >= C:
        return 1.0
    V, r = scores.T @ scores, scores.sum(axis=0)
    # T = r^T V^-1 r lies in 0..C
    T = min(float(r @ np.linalg.lstsq(V, r, rcond=1e-12)[0]), C * (1 - 1e-12))
    return float(fdtrc(k, C - k, (T / k) / ((C - T) / (C - k))))
