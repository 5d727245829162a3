"""The impedance equation at every line, with modes inside the limb, a reflex and a lag.

At each line, with y = -F, u = (a, v, x, exp(-s t) x) and s = i w,

    y = [M B K R] u + w,       y, w (d,), u (q,), [M B K R] (d, q)

w is what the person does of her own accord and what the sensors add. The explained motion z of
each line is free of it, so that

    sum Re (z* S^-1 (y - [M B K R] u)) = 0,      S the spectrum of w,

holds in closed loop, whether the robot imposes position or force. A force that is recorded later
than the motion by T adds one more column, -s y.
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

#: The noise's spectrum is a mean over this half width (Hz), or over so many lines to each axis.
NOISE_WIDTH_HZ: Final = 0.75
NOISE_LINES: Final = 8


@dataclass(frozen=True, eq=False)
class RandomEquations:
    """``A theta = b`` of one delay; theta are the rows of [M B K R], then T.

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
    """The equations with a reflex of one delay, or without.

    `weight` (L, d, d) complex: inverse of the noise's spectrum.
    """
    kernel = None if delay_s is None else np.exp(-lines.s * delay_s)
    return with_kernel(lines, explained, weight, kernel)


def with_kernel(
    lines: Lines, explained: Explained, weight: Complex, kernel: Complex | None
) -> RandomEquations:
    """The equations with R by any ``kernel(s)`` (L, 1) in place of ``exp(-s t)``, or without."""
    s, d = lines.s, lines.axes
    u = [lines.motion[2], lines.motion[1], lines.motion[0]]
    z = [s**2 * explained.motion, s * explained.motion, explained.motion]
    if kernel is not None:
        u, z = [*u, kernel * lines.motion[0]], [*z, kernel * explained.motion]
    U, Z = np.hstack(u), np.hstack(z)
    y, y_told = -lines.force, -explained.force
    lag, lag_told = -s * y, -s * y_told
    q = U.shape[1]
    p = d * q + 1
    A, meat = np.empty((p, p)), np.empty((p, p))
    for target, right, last in ((A, U, lag), (meat, Z, lag_told)):
        # sum over lines of Re z_a* W_ij u_c, (i a, j c)
        outer = (Z.conj()[:, :, None] * right[:, None]).reshape(len(Z), -1)
        block = (weight.reshape(len(Z), -1).T @ outer).real.reshape(d, d, q, q)
        target[:-1, :-1] = 2 * block.transpose(0, 2, 1, 3).reshape(p - 1, -1)
        target[:-1, -1] = _against(Z, weight, last)
        target[-1, :-1] = _against(right, np.swapaxes(weight, 1, 2), lag_told.conj(), conj=False)
        target[-1, -1] = _weighed(lag_told, weight, last)
    b = np.append(_against(Z, weight, y), _weighed(lag_told, weight, y))
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
    whole = theta[:-1].reshape(d, -1)
    return np.asarray(y + theta[-1] * lines.s * y - np.hstack(u) @ whole.T)


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
    # the inverse of a mean of n is too large by n / (n - d)
    return np.asarray((count - d) / count * np.linalg.inv(S))


# A mode inside the limb, as of a free elbow, under random perturbations.
#
# Beside M, B and K stands ``S n n^T g(s)`` (`hand.still.doubts.inner_modes`): for one mode and one
# direction n one more column of the impedance equation, linear in S; over many of them the answer
# is a mean, as for returning disturbances.


def allow_for_inner(
    one: ImpedanceEstimate,
    lines: Lines,
    explained: Explained,
    weight: Complex,
    elbow: Elbow | None,
) -> ImpedanceEstimate:
    """The estimate with an inner mode taken off, as likely as it is, and in its intervals.

    `one`: of second order.
    `weight` (L, d, d) complex: inverse of the noise's spectrum.
    """
    d = one.k
    n = half_sphere(INNER_DIRECTIONS)
    pairs = float(np.trace(one.stiffness)) / d * (n[:, :, None] * n[:, None]).reshape(len(n), -1)
    made = (with_kernel(lines, explained, weight, mode.response(lines.s)) for mode in INNER_MODES)
    sizes = [_sized(equations, pairs, d) for equations in made]
    size, error, shift = (np.array(part) for part in zip(*sizes, strict=True))
    fits = InnerFits(INNER_MODES, size, error, shift)
    return with_inner(one, averaged_inner(fits, elbow), correct=True)


def _sized(
    equations: RandomEquations, pairs: FloatArray, d: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """S (c,) along c directions, its standard error, and by how much M, B, K (c, 3 d^2) are wrong.

    `pairs` (c, d^2): what one unit of S adds to G, the last matrix in rows of [M B K G].
    """
    rows = np.arange(4 * d * d).reshape(d, 4, d)
    limb, own = rows[:, :3].ravel(), rows[:, 3].ravel()
    A, meat, b = equations.A, equations.meat, equations.b
    # without M, B, K: (A_gg - A_gl A_ll^-1 A_lg) along a pair, and what is left of b
    inverse = np.linalg.inv(A[np.ix_(limb, limb)])
    left, right = A[np.ix_(own, limb)] @ inverse, inverse @ A[np.ix_(limb, own)]
    spare = A[np.ix_(own, own)] - left @ A[np.ix_(limb, own)]
    known = np.einsum("ci,ij,cj->c", pairs, spare, pairs)
    size = pairs @ (b[own] - left @ b[limb]) / known
    # variance: row [-A_gl A_ll^-1, 1] of the inverse on either side of the meat
    row = np.zeros((len(pairs), 4 * d * d))
    row[:, limb], row[:, own] = -pairs @ left, pairs
    spread = np.einsum("ci,ij,cj->c", row, meat[:-1, :-1], row)
    shift = pairs @ right.T
    return size, np.sqrt(spread) / np.abs(known), shift[:, _by_matrix(d)]


def _by_matrix(d: int) -> np.ndarray:
    """Where the elements of M, then B, then K stand in rows of [M B K]."""
    return np.arange(3 * d * d).reshape(d, 3, d).transpose(1, 0, 2).ravel()


# Is there a reflex, and a lag between the clocks? A mean over what the record does not exclude.
#
# Beforehand the limb has a reflex or none, force and motion share a clock or not. A reflex is about
# proportional to the stiffness, ``R = r K + rest`` (r some USUAL_REFLEX, the elements of the rest
# normal), at any delay of a range alike. Everything is linear but the delay, so that each model has
# its evidence in closed form, and the answer is the mean over models weighed by evidence (Bayesian
# model averaging; J. A. Hoeting and colleagues, Statistical Science 14 (1999) 382): where the
# record shows no reflex it costs nothing, where it shows one its price is paid, in between
# intervals hold both.

#: Probability of a reflex and of a lag beforehand, and the sizes that they usually have.
REFLEX_BEFOREHAND: Final = 0.3
LAG_BEFOREHAND: Final = 0.1
USUAL_REFLEX: Final = 0.3
USUAL_LAG_S: Final = 1e-3
#: How far a reflex' elements usually are from proportional, parts of K's mean diagonal.
UNLIKE: Final = (0.01, 0.05)
#: Delays that are tried (s): nothing answers earlier, and what comes later is on purpose.
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
    `with_reflex` (4 q + 1,): the mean over models with a reflex alone.
    `delay_s` (n,): those that were tried.
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
    """One model's answer: log of evidence times prior, values and covariance as in `Averaged`."""

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
    """Average over no reflex and reflexes of all delays, with and without a lag.

    `equations`: delay (s) or None -> `RandomEquations`.
    `stiffness` (d, d): about K: what a reflex is proportional to.
    `lag_seen`: whether a lag was found and taken off: what is left of it is then asked in all
    models.
    """
    models = _models(equations(None), _Priors(stiffness, reflex=False, lag_seen=lag_seen))
    coarse = np.arange(EARLIEST_S, LATEST_S + COARSE_S / 2, COARSE_S)
    priors = _Priors(stiffness, reflex=True, lag_seen=lag_seen)
    late = {float(t): _models(equations(float(t)), priors) for t in coarse}
    best = max(late, key=lambda t: max(m.log_weight for m in late[t]))
    fine = best + FINE_S * np.arange(-7, 8)
    for t in fine[(fine > EARLIEST_S) & (fine < LATEST_S)]:
        key = min(late, key=lambda known: abs(known - t))
        if abs(key - t) > 1e-9:
            late[float(t)] = _models(equations(float(t)), priors)
    delays = np.array(sorted(late))
    # each delay stands for its neighbourhood, of a range in which all are alike
    share = np.gradient(delays) / np.gradient(delays).sum()
    for i, t in enumerate(delays):
        models += [
            _Model(m.log_weight + np.log(share[i]), m.values, m.covariance, i, m.lag)
            for m in late[float(t)]
        ]
    return _mean(models, delays)


class _Priors:
    """Precisions beforehand of [M B K R] rows and T, for each kind of model."""

    def __init__(self, stiffness: FloatArray, *, reflex: bool, lag_seen: bool) -> None:
        d = len(stiffness)
        self.d, self.reflex, self.lag_seen = d, reflex, lag_seen
        self.q = 4 if reflex else 3
        size = float(np.trace(stiffness)) / d
        k = USUAL_REFLEX * stiffness.ravel()
        self.sizes = tuple(np.outer(k, k) + (c * size) ** 2 * np.eye(d * d) for c in UNLIKE)

    @property
    def rows(self) -> np.ndarray:
        """Where the elements of R stand, row by row."""
        row = np.arange(self.d)[:, None] * self.q * self.d + 3 * self.d + np.arange(self.d)
        return row.ravel() if self.reflex else np.empty(0, int)

    def kinds(self) -> list[tuple[float, FloatArray, bool]]:
        """(log of the probability, covariance beforehand of R, whether there is a lag)."""
        none = (np.log(1 - REFLEX_BEFOREHAND), np.empty((0, 0)))
        each = [(np.log(REFLEX_BEFOREHAND / len(self.sizes)), c) for c in self.sizes]
        lags = [(np.log(1 - LAG_BEFOREHAND), False), (np.log(LAG_BEFOREHAND), True)]
        if self.lag_seen:
            lags = [(0.0, True)]
        chosen = each if self.reflex else [none]
        return [(p + more, c, lag) for p, c in chosen for more, lag in lags]


def _models(equations: RandomEquations, priors: _Priors) -> list[_Model]:
    """The answers at one delay."""
    return [_solved(equations, priors, *kind) for kind in priors.kinds()]


def _solved(
    equations: RandomEquations, priors: _Priors, log_prior: float, before: FloatArray, lag: bool
) -> _Model:
    p = len(equations.b)
    kept = np.arange(p if lag else p - 1)
    A, b, meat = equations.A[np.ix_(kept, kept)], equations.b[kept], equations.meat
    precision = np.zeros((len(kept), len(kept)))
    log_det = 0.0
    if len(before):
        precision[np.ix_(priors.rows, priors.rows)] = np.linalg.inv(before)
        log_det -= float(np.linalg.slogdet(before)[1])
    if lag:
        precision[-1, -1] = USUAL_LAG_S**-2
        log_det -= 2 * np.log(USUAL_LAG_S)
    # M, B, K are flat beforehand in all models: their share of the determinants is the same
    scale = 1 / np.sqrt(np.diag((A + A.T) / 2 + precision))
    scaled = (A + precision) * scale[:, None] * scale
    theta = scale * np.linalg.solve(scaled, scale * b)
    symmetric = (scaled + scaled.T) / 2
    log_after = float(np.linalg.slogdet(symmetric)[1]) - 2 * float(np.log(scale).sum())
    log_weight = log_prior + 0.5 * (log_det - log_after + float(b @ theta))
    inverse = np.linalg.inv(scaled) * scale[:, None] * scale
    covariance = inverse @ (meat[np.ix_(kept, kept)] + precision) @ inverse.T
    to = _places(priors, lag)
    whole, cov = np.zeros(4 * priors.d**2 + 1), np.zeros((4 * priors.d**2 + 1,) * 2)
    whole[to], cov[np.ix_(to, to)] = theta, covariance
    return _Model(log_weight, whole, cov, lag=lag)


def _places(priors: _Priors, lag: bool) -> np.ndarray:
    """From rows of [M B K R], T to M, B, K, R row by row, T."""
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
    given = weight * late / max(float(weight[late].sum()), 1e-300)
    if not late.any() or weight[late].sum() <= 0:
        given = late / max(late.sum(), 1)
    reflexive, spread = _moments(models, given)
    at = [m.delay for m in models if m.delay >= 0]
    of_delay = np.bincount(at, given[late], len(delays)).astype(float)
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
    kept = [(w, m) for w, m in zip(weight, models, strict=True) if w > UNLIKELY]
    total = sum(w for w, _ in kept)
    mean = np.asarray(sum(w * m.values for w, m in kept) / total)
    covariance = np.zeros((len(mean), len(mean)))
    for w, m in kept:
        off = m.values - mean
        covariance += w / total * (m.covariance + np.outer(off, off))
    return mean, covariance
