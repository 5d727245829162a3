"""The impedance equation at every line, with modes inside the limb, a reflex and a lag.

At each line, with y = -F, u = (a, v, x, exp(-s t) x) and s = i w,

    y = [M B K R] u + w,       y, w (d,), u (q,), [M B K R] (d, q)

w is the force of the person's own movement and the noise of the sensors. The explained motion z of
each line is free of it, so that

    sum Re (z* S^-1 (y - [M B K R] u)) = 0,      S the spectrum of w,

holds in closed loop, whether the robot imposes position or force. If the force is recorded later
than the motion by T, there is one more column, -s y.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.estimates import ImpedanceEstimate
from armimpedance.hand.random.lines import Complex, Explained, Lines
from armimpedance.hand.still import (
    INNER_DIRECTIONS,
    INNER_MODES,
    Elbow,
    InnerFits,
    averaged_inner,
    half_sphere,
    with_inner,
)

#: The noise's spectrum is a running mean over this half-width (Hz), or over so many lines per axis.
NOISE_WIDTH_HZ: Final = 0.75
NOISE_LINES: Final = 8


@dataclass(frozen=True, eq=False)
class RandomEquations:
    """Equations ``A theta = b`` for one delay; theta are the rows of [M B K R], then T.

    `b` (p,).
    `A` (p, p): instruments times regressors.
    `meat` (p, p): instruments times instruments: the covariance of the equations.
    """

    A: FloatArray
    b: FloatArray
    meat: FloatArray


def equations_at(
    lines: Lines, explained: Explained, weight: Complex, delay_s: float | None
) -> RandomEquations:
    """Build the equations with a reflex of one delay, or without.

    `weight` (L, d, d) complex: inverse of the noise's spectrum.
    """
    kernel = None if delay_s is None else np.exp(-lines.s * delay_s)
    return with_kernel(lines, explained, weight, kernel)


def with_kernel(
    lines: Lines, explained: Explained, weight: Complex, kernel: Complex | None
) -> RandomEquations:
    """Build the equations with R and any ``kernel(s)`` (L, 1) for ``exp(-s t)``; None omits R."""
    s, d = lines.s, lines.axes
    u = [lines.motion[2], lines.motion[1], lines.motion[0]]
    z = [s**2 * explained.motion, s * explained.motion, explained.motion]
    if kernel is not None:
        u, z = [*u, kernel * lines.motion[0]], [*z, kernel * explained.motion]
    U, Z = np.hstack(u), np.hstack(z)
    y, y_explained = -lines.force, -explained.force
    lag, lag_explained = -s * y, -s * y_explained
    q = U.shape[1]
    p = d * q + 1
    A, meat = np.empty((p, p)), np.empty((p, p))
    for target, right, last in ((A, U, lag), (meat, Z, lag_explained)):
        # sum over lines of Re z_a* W_ij u_c, (i a, j c)
        outer = (Z.conj()[:, :, None] * right[:, None]).reshape(len(Z), -1)
        block = (weight.reshape(len(Z), -1).T @ outer).real.reshape(d, d, q, q)
        target[:-1, :-1] = 2 * block.transpose(0, 2, 1, 3).reshape(p - 1, -1)
        target[:-1, -1] = _against(Z, weight, last)
        target[-1, :-1] = _against(
            right, np.swapaxes(weight, 1, 2), lag_explained.conj(), conj=False
        )
        target[-1, -1] = _weighed(lag_explained, weight, last)
    b = np.append(_against(Z, weight, y), _weighed(lag_explained, weight, y))
    n = lines.widening
    return RandomEquations(A / n, b / n, meat / n)


def _against(left: Complex, weight: Complex, right: Complex, *, conj: bool = True) -> FloatArray:
    """``2 Re sum left_a* W_ij right_j`` (i a,)."""
    turned = (weight @ right[..., None])[..., 0]
    first = left.conj() if conj else left
    return np.asarray(2 * (turned.T @ first).real.ravel())


def _weighed(left: Complex, weight: Complex, right: Complex) -> float:
    """``2 Re sum left_i* W_ij right_j``."""
    return float(2 * (left.conj() * (weight @ right[..., None])[..., 0]).real.sum())


def residual(lines: Lines, theta: FloatArray, delay_s: float | None) -> Complex:
    """``y + T s y - [M B K R] u`` at every line, (L, d)."""
    d = lines.axes
    u = [lines.motion[2], lines.motion[1], lines.motion[0]]
    if delay_s is not None:
        u = [*u, np.exp(-lines.s * delay_s) * lines.motion[0]]
    y = -lines.force
    matrices = theta[:-1].reshape(d, -1)
    return np.asarray(y + theta[-1] * lines.s * y - np.hstack(u) @ matrices.T)


def noise_weight(lines: Lines, left: Complex) -> Complex:
    """Inverse (L, d, d) of the residual's spectrum, a running mean that leaves out the line."""
    L, d = left.shape
    half = max(NOISE_WIDTH_HZ, NOISE_LINES * d / lines.per_hz / 2)
    first = np.searchsorted(lines.frequency_hz, lines.frequency_hz - half)
    last = np.searchsorted(lines.frequency_hz, lines.frequency_hz + half, side="right")
    outer = left[:, :, None] * left.conj()[:, None]
    sums = np.concatenate([np.zeros((1, d, d), complex), np.cumsum(outer, axis=0)])
    count = (last - first - 1)[:, None, None]
    S = (sums[last] - sums[first] - outer) / count
    scale = np.trace(S, axis1=1, axis2=2).real[:, None, None]
    S = S + (1e-9 * scale + 1e-30) * np.eye(d)
    # the inverse of a mean over n is too large by n / (n - d)
    return np.asarray((count - d) / count * np.linalg.inv(S))


# A mode inside the limb, as of a free elbow, under random perturbations.
# The term in addition to M, B and K is ``S n n^T g(s)`` (`hand.still.doubts.inner_modes`): for one
# mode and one direction n one more column of the impedance equation, linear in S. The result is the
# mean over many of them, as for returning disturbances.


def allow_for_inner(
    one: ImpedanceEstimate,
    lines: Lines,
    explained: Explained,
    weight: Complex,
    elbow: Elbow | None,
) -> ImpedanceEstimate:
    """Subtract the expected inner mode from the estimate, and include it in the intervals.

    `one`: of second order.
    `weight` (L, d, d) complex: inverse of the noise's spectrum.
    """
    d = one.k
    n = half_sphere(INNER_DIRECTIONS)
    pairs = float(np.trace(one.stiffness)) / d * (n[:, :, None] * n[:, None]).reshape(len(n), -1)
    equations_of_modes = (
        with_kernel(lines, explained, weight, mode.response(lines.s)) for mode in INNER_MODES
    )
    sizes = [_sized(equations, pairs, d) for equations in equations_of_modes]
    size, error, shift = (np.array(part) for part in zip(*sizes, strict=True))
    fits = InnerFits(INNER_MODES, size, error, shift)
    return with_inner(one, averaged_inner(fits, elbow), correct=True)


def _sized(
    equations: RandomEquations, pairs: FloatArray, d: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """S (c,) along c directions, its standard error, and the errors of M, B, K (c, 3 d^2).

    `pairs` (c, d^2): contribution of one unit of S to G, the last matrix in rows of [M B K G].
    """
    rows = np.arange(4 * d * d).reshape(d, 4, d)
    limb, own = rows[:, :3].ravel(), rows[:, 3].ravel()
    A, meat, b = equations.A, equations.meat, equations.b
    # with M, B, K eliminated: (A_gg - A_gl A_ll^-1 A_lg) along a pair, and the reduced b
    inverse = np.linalg.inv(A[np.ix_(limb, limb)])
    left, right = A[np.ix_(own, limb)] @ inverse, inverse @ A[np.ix_(limb, own)]
    spare = A[np.ix_(own, own)] - left @ A[np.ix_(limb, own)]
    precision = np.einsum("ci,ij,cj->c", pairs, spare, pairs)
    size = pairs @ (b[own] - left @ b[limb]) / precision
    # variance: row [-A_gl A_ll^-1, 1] of the inverse on either side of the meat
    row = np.zeros((len(pairs), 4 * d * d))
    row[:, limb], row[:, own] = -pairs @ left, pairs
    spread = np.einsum("ci,ij,cj->c", row, meat[:-1, :-1], row)
    shift = pairs @ right.T
    return size, np.sqrt(spread) / np.abs(precision), shift[:, _by_matrix(d)]


def _by_matrix(d: int) -> np.ndarray:
    """Indices of the elements of M, then B, then K in rows of [M B K]."""
    return np.arange(3 * d * d).reshape(d, 3, d).transpose(1, 0, 2).ravel()


# Reflex, and lag between the clocks: a mean over the models that the record does not exclude.
# A priori the limb has a reflex or none, and force and motion share a clock or not. A reflex is
# about proportional to the stiffness, ``R = r K + rest`` (r of size USUAL_REFLEX, the elements of
# the rest normal), with equal probability for any delay of a range. Everything is linear except the
# delay, so that the evidence of each model has a closed form. The result is the mean over models
# weighted by evidence (Bayesian model averaging; J. A. Hoeting and colleagues, Statistical Science
# 14 (1999) 382): if the record shows no reflex, its intervals are those without one; if it shows
# one, those with it; in between they include both.

#: Prior probabilities of a reflex and of a lag, and their usual sizes.
REFLEX_BEFOREHAND: Final = 0.3
LAG_BEFOREHAND: Final = 0.1
USUAL_REFLEX: Final = 0.3
USUAL_LAG_S: Final = 1e-3
#: Prior deviations of a reflex' elements from proportional ones, as shares of K's mean diagonal.
UNLIKE: Final = (0.01, 0.05)
#: Delays that are tried (s): no reflex is earlier, and later responses are voluntary.
EARLIEST_S: Final = 0.020
LATEST_S: Final = 0.090
COARSE_S: Final = 0.005
FINE_S: Final = 0.001
#: Models less likely than this are left out.
UNLIKELY: Final = 1e-5


@dataclass(frozen=True, eq=False)
class Averaged(FrozenRecord):
    """Mean over models; q = d^2.

    `reflex_covariance` (4 q + 1, 4 q + 1).
    `values`, `covariance` (4 q + 1,), (4 q + 1, 4 q + 1): M, B, K, R row by row, then the lag T
    (s). R and T are zero in models without them.
    `with_reflex` (4 q + 1,): the mean over the models with a reflex only.
    `delay_s` (n,): delays that were tried.
    `delay_weight` (n,): their probability, given a reflex.
    """

    values: Annotated[FloatArray, "p"]
    covariance: Annotated[FloatArray, "p p"]
    with_reflex: Annotated[FloatArray, "p"]
    reflex_covariance: Annotated[FloatArray, "p p"]
    delay_s: Annotated[FloatArray, "n"]
    delay_weight: Annotated[FloatArray, "n"]
    reflex_probability: float
    lag_probability: float

    @property
    def best_delay_s(self) -> float:
        """The likeliest delay."""
        return float(self.delay_s[int(np.argmax(self.delay_weight))])

    @property
    def delay(self) -> tuple[float, float]:
        """Mean delay and its standard deviation, s."""
        mean = float(self.delay_weight @ self.delay_s)
        return mean, float(np.sqrt(self.delay_weight @ (self.delay_s - mean) ** 2))


@dataclass(frozen=True, eq=False)
class _Model:
    """Result of one model: log of evidence times prior, values and covariance as in `Averaged`."""

    log_weight: float
    values: FloatArray
    covariance: FloatArray
    delay: int = -1
    lag: bool = False


def averaged(
    equations: Callable[[float | None], RandomEquations],
    stiffness: FloatArray,
    *,
    lag_seen: bool = False,
) -> Averaged:
    """Average over models without a reflex and with one at all delays, with and without a lag.

    `equations`: delay (s) or None -> `RandomEquations`.
    `stiffness` (d, d): approximate K, to which a reflex is proportional.
    `lag_seen`: True if a lag was detected and corrected: the remaining lag is then in all models.
    """
    models = _models(equations(None), _Priors(stiffness, reflex=False, lag_seen=lag_seen))
    coarse = np.arange(EARLIEST_S, LATEST_S + COARSE_S / 2, COARSE_S)
    priors = _Priors(stiffness, reflex=True, lag_seen=lag_seen)
    late = {float(t): _models(equations(float(t)), priors) for t in coarse}
    best = max(late, key=lambda t: max(m.log_weight for m in late[t]))
    fine = best + FINE_S * np.arange(-7, 8)
    for t in fine[(fine > EARLIEST_S) & (fine < LATEST_S)]:
        key = min(late, key=lambda tried: abs(tried - t))
        if abs(key - t) > 1e-9:
            late[float(t)] = _models(equations(float(t)), priors)
    delays = np.array(sorted(late))
    # each delay represents its neighbourhood in a range of equal prior density
    share = np.gradient(delays) / np.gradient(delays).sum()
    for i, t in enumerate(delays):
        models += [
            _Model(m.log_weight + np.log(share[i]), m.values, m.covariance, i, m.lag)
            for m in late[float(t)]
        ]
    return _mean(models, delays)


class _Priors:
    """Prior precisions of [M B K R] rows and T, for each kind of model."""

    def __init__(self, stiffness: FloatArray, *, reflex: bool, lag_seen: bool) -> None:
        d = len(stiffness)
        self.d, self.reflex, self.lag_seen = d, reflex, lag_seen
        self.q = 4 if reflex else 3
        size = float(np.trace(stiffness)) / d
        k = USUAL_REFLEX * stiffness.ravel()
        self.sizes = tuple(np.outer(k, k) + (c * size) ** 2 * np.eye(d * d) for c in UNLIKE)

    @property
    def rows(self) -> np.ndarray:
        """Indices of the elements of R, row by row."""
        row = np.arange(self.d)[:, None] * self.q * self.d + 3 * self.d + np.arange(self.d)
        return row.ravel() if self.reflex else np.empty(0, int)

    def kinds(self) -> list[tuple[float, FloatArray, bool]]:
        """Models as (log of the prior probability, prior covariance of R, True with a lag)."""
        no_reflex = (np.log(1 - REFLEX_BEFOREHAND), np.empty((0, 0)))
        reflexes = [(np.log(REFLEX_BEFOREHAND / len(self.sizes)), c) for c in self.sizes]
        lags = [(np.log(1 - LAG_BEFOREHAND), False), (np.log(LAG_BEFOREHAND), True)]
        if self.lag_seen:
            lags = [(0.0, True)]
        chosen = reflexes if self.reflex else [no_reflex]
        return [(p + log_lag, c, lag) for p, c in chosen for log_lag, lag in lags]


def _models(equations: RandomEquations, priors: _Priors) -> list[_Model]:
    """Results of the models at one delay."""
    return [_solved(equations, priors, *kind) for kind in priors.kinds()]


def _solved(
    equations: RandomEquations, priors: _Priors, log_prior: float, before: FloatArray, lag: bool
) -> _Model:
    p = len(equations.b)
    used = np.arange(p if lag else p - 1)
    A, b, meat = equations.A[np.ix_(used, used)], equations.b[used], equations.meat
    precision = np.zeros((len(used), len(used)))
    log_det = 0.0
    if len(before):
        precision[np.ix_(priors.rows, priors.rows)] = np.linalg.inv(before)
        log_det -= float(np.linalg.slogdet(before)[1])
    if lag:
        precision[-1, -1] = USUAL_LAG_S**-2
        log_det -= 2 * np.log(USUAL_LAG_S)
    # M, B, K have flat priors in all models: their share of the determinants is the same
    scale = 1 / np.sqrt(np.diag((A + A.T) / 2 + precision))
    scaled = (A + precision) * scale[:, None] * scale
    theta = scale * np.linalg.solve(scaled, scale * b)
    symmetric = (scaled + scaled.T) / 2
    log_after = float(np.linalg.slogdet(symmetric)[1]) - 2 * float(np.log(scale).sum())
    log_weight = log_prior + 0.5 * (log_det - log_after + float(b @ theta))
    inverse = np.linalg.inv(scaled) * scale[:, None] * scale
    covariance = inverse @ (meat[np.ix_(used, used)] + precision) @ inverse.T
    to = _places(priors, lag)
    values, cov = np.zeros(4 * priors.d**2 + 1), np.zeros((4 * priors.d**2 + 1,) * 2)
    values[to], cov[np.ix_(to, to)] = theta, covariance
    return _Model(log_weight, values, cov, lag=lag)


def _places(priors: _Priors, lag: bool) -> np.ndarray:
    """Index map from rows of [M B K R], T to M, B, K, R row by row, T."""
    d, q = priors.d, priors.q
    i, matrix, j = np.meshgrid(np.arange(d), np.arange(q), np.arange(d), indexing="ij")
    to = (matrix * d * d + i * d + j).ravel()
    return np.append(to, 4 * d * d) if lag else to


def _mean(models: list[_Model], delays: FloatArray) -> Averaged:
    log_weight = np.array([m.log_weight for m in models])
    weight = np.exp(log_weight - log_weight.max())
    weight /= weight.sum()
    late = np.array([m.delay >= 0 for m in models])
    values, covariance = _moments(models, weight)
    conditional = weight * late / max(float(weight[late].sum()), 1e-300)
    if not late.any() or weight[late].sum() <= 0:
        conditional = late / max(late.sum(), 1)
    reflexive, spread = _moments(models, conditional)
    at = [m.delay for m in models if m.delay >= 0]
    of_delay = np.bincount(at, conditional[late], len(delays)).astype(float)
    return Averaged(
        values,
        covariance,
        reflexive,
        spread,
        delays,
        of_delay,
        float(weight[late].sum()),
        float(sum(w for w, m in zip(weight, models, strict=True) if m.lag)),
    )


def _moments(models: list[_Model], weight: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean, and covariance within and between models."""
    likely = [(w, m) for w, m in zip(weight, models, strict=True) if w > UNLIKELY]
    total = sum(w for w, _ in likely)
    mean = np.asarray(sum(w * m.values for w, m in likely) / total)
    covariance = np.zeros((len(mean), len(mean)))
    for w, m in likely:
        off = m.values - mean
        covariance += w / total * (m.covariance + np.outer(off, off))
    return mean, covariance
