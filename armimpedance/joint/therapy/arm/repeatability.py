"""Agreement between repetitions of one passive movement, and the information in a few of them.

Every repetition gives a pair (k_s, offset). Their scatter includes all changes between repetitions.
But with three repetitions the covariance has two degrees of freedom: t is 4.3, and by chance the
scatter is sometimes very small. It is therefore moderated (G. K. Smyth, Stat. Appl. Genet. Mol.
Biol. 3 (2004) 3) by its expectation: the slow fluctuation of the person's torque, visible in the
residuals of every single repetition, and a usual variation of stiffness and rest angle (constants
below). The expectation counts as `PRIOR_DOF` degrees of freedom; a larger scatter still has an
effect.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.numerics.regression import ragged_factors

#: Usual variation between repetitions: relative sd of k_s, and sd of q_0 (rad).
STIFFNESS_REPEATS: Final = 0.03
REST_REPEATS_RAD: Final = 0.02
#: Degrees of freedom of the expected scatter.
PRIOR_DOF: Final = 4.0

#: Repetitions are too different if they scatter by more than this share of the arm's whole torque
#: (rms over the movement), and by more than this torque: one passive movement would then be read
#: as a contribution of that many percent.
LARGEST_SHARE: Final = 0.15
LARGEST_SCATTER_NM: Final = 0.25
#: And if the p value of such a scatter is below this.
SIGNIFICANCE: Final = 0.01

#: Time step for the fluctuation, s (with a shorter one, the kernel's correlation would look like
#: the person's), and tried correlation times, s.
_STEP_S: Final = 0.1
_TIMES_S: Final = tuple(np.geomspace(0.05, 3.0, 20))
#: First cosine for the density: the slowest ones were removed from the residual by the line.
_FIRST_COSINE: Final = 3
#: Highest frequency of the residual's density, Hz.
_BAND_HZ: Final = 1.5


@dataclass(frozen=True)
class Scatter:
    """Covariance of one repetition's (k_s, offset) about the mean.

    `expected` (2, 2).
    `covariance` (2, 2): moderated.
    `seen` (2, 2): observed between the repetitions.
    `between` (2, 2): part of `covariance` due to the arm, without the fluctuation of the person's
    torque.
    `rms_Nm`: root mean square of the observed scatter's torque over the angles of the movement.
    `chance`: p value of the observed scatter under the expected one.
    """

    covariance: FloatArray
    dof: float
    seen: FloatArray
    seen_dof: int
    expected: FloatArray
    between: FloatArray
    rms_Nm: float
    chance: float

    def disagrees(self, arm_rms_Nm: float) -> bool:
        """Return True if the repetitions differ too much for an arm that needs this torque
        (rms)."""
        limit = max(LARGEST_SCATTER_NM, LARGEST_SHARE * arm_rms_Nm)
        return self.rms_Nm > limit and self.chance < SIGNIFICANCE


def scatter_of(
    single: FloatArray,
    groups: Sequence[str],
    noise: FloatArray,
    q: FloatArray,
    *,
    prior_dof: float = PRIOR_DOF,
) -> Scatter:
    """Scatter of the repetitions' separate fits.

    `single` (R, 2): k_s, N m/rad, and offset, N m, of every repetition.
    `groups`: movement of each repetition; every movement has its own mean.
    `noise` (2, 2): covariance of a repetition's fit due to the torque's fluctuation.
    `q` (N,): angles of all samples, rad.
    `prior_dof`: degrees of freedom of the expectation; 0: only the observed scatter.
    """
    labels = np.asarray(groups)
    mean = np.stack([single[labels == g].mean(axis=0) for g in labels])
    dof = len(single) - len(set(groups))
    # observed (2, 2) = D^T D / dof, D (R, 2) the fits about their movement's mean
    observed = (single - mean).T @ (single - mean) / dof
    k, offset = single.mean(axis=0)
    expected = noise + _repeats(float(k), float(offset))
    total = prior_dof + dof
    covariance = (prior_dof * expected + dof * observed) / total
    gram = np.array([[(q**2).mean(), q.mean()], [q.mean(), 1.0]])
    return Scatter(
        covariance=covariance,
        dof=total,
        seen=observed,
        seen_dof=dof,
        expected=expected,
        between=_semidefinite(covariance - noise),
        rms_Nm=float(np.sqrt(np.trace(gram @ observed))),
        chance=_chance(observed, expected, dof),
    )


def _repeats(k: float, offset: float) -> FloatArray:
    """Covariance of (k, -k q_0) for k and q_0 that vary independently."""
    share, shift = STIFFNESS_REPEATS**2, REST_REPEATS_RAD**2
    both = np.array([k, offset])
    # k (1 + e), q_0 + d: d(k, b) = e (k, b) - d (0, k)
    return share * np.outer(both, both) + np.diag([0.0, shift * k**2])


def _semidefinite(C: FloatArray) -> FloatArray:
    """Nearest covariance matrix (2, 2), relative to the scale of its entries."""
    scale = np.sqrt(np.maximum(np.abs(np.diag(C)), 1e-300))
    values, vectors = np.linalg.eigh(C / np.outer(scale, scale))
    clipped = (vectors * np.maximum(values, 0.0)) @ vectors.T
    return np.asarray(clipped * np.outer(scale, scale))


def _chance(seen: FloatArray, expected: FloatArray, dof: int) -> float:
    """Tail of the F distribution for ``tr(expected^-1 seen) / 2``; `expected` is also inexact."""
    from scipy.special import fdtrc

    ratio = float(np.trace(np.linalg.solve(expected, seen))) / 2
    return float(fdtrc(2 * dof, 2 * PRIOR_DOF, ratio))


def fluctuation_covariance(
    W: Sequence[FloatArray], E: Sequence[FloatArray], sample_rate_hz: float
) -> FloatArray:
    """Mean covariance (2, 2) of the line of one repetition due to a fluctuating torque.

    The residuals E are modelled as a process of correlation ``sigma^2 exp(-|t| / T_c)``. The
    restricted likelihood accounts for the fitted lines; log T_c is averaged over it, since a few
    seconds do not determine it well. For processes of .05 to 2 s the median result is 1.5 to .65 of
    the true variance.

    `W` sequence of (S_t, 2): q and 1 of every repetition.
    `E` sequence of (S_t,): residual of its line, N m.
    """
    stride = max(round(_STEP_S * sample_rate_hz), 1)
    step = stride / sample_rate_hz
    rows = [w[stride // 2 :: stride] for w in W]
    residual = [e[stride // 2 :: stride, None] for e in E]
    longest = len(max(rows, key=len)) * step
    times = np.array([t for t in _TIMES_S if t <= longest])
    likelihood = np.array([_at_time(rows, residual, step / t)[0] for t in times])
    weight = np.exp(likelihood - likelihood.max())
    time = float(np.exp(np.log(times) @ weight / weight.sum()))
    return _at_time(rows, residual, step / time)[1]


def _at_time(
    rows: list[FloatArray], residual: list[FloatArray], steps: float
) -> tuple[float, FloatArray]:
    """Restricted log likelihood, and covariance of a line, for one correlation time."""
    phi = float(np.exp(-steps))
    factors = ragged_factors(
        [_whitened(w, phi) for w in rows],
        [_whitened(e, phi) for e in residual],
        regressors=("k", "offset"),
        outputs=("torque",),
    )
    p, n = factors.n_regressors, sum(map(len, rows))
    free = n - p * len(rows)
    # every repetition has its own line: the residual is the last entry of its triangle
    variance = max(float((factors.r[:, p, p] ** 2).sum()) / free, 1e-300)
    information = np.log(np.abs(np.diagonal(factors.r[:, :p, :p], axis1=1, axis2=2))).sum()
    innovations = (n - len(rows)) * np.log1p(-(phi**2)) / 2
    covariance = np.mean([_line_covariance(w, phi) for w in rows], axis=0)
    return -free / 2 * np.log(variance) - information - innovations, variance * covariance


def _line_covariance(w: FloatArray, phi: float) -> FloatArray:
    """Covariance of the least-squares line through a process of unit variance."""
    lag = np.abs(np.subtract.outer(np.arange(len(w)), np.arange(len(w))))
    inverse = np.linalg.inv(w.T @ w)
    # C (2, 2) = (W^T W)^-1 W^T R W (W^T W)^-1, R (m, m) the correlation
    return np.asarray(inverse @ w.T @ phi**lag @ w @ inverse)


def _whitened(x: FloatArray, phi: float) -> FloatArray:
    return np.concatenate([x[:1], (x[1:] - phi * x[:-1]) / np.sqrt(1 - phi**2)])


def noise_density(E: Sequence[FloatArray], sample_rate_hz: float) -> float:
    """Density of the residuals (S_t,) of all repetitions at low frequencies, N m^2 s.

    It is the mean square of cosine sums (Mueller 2007, as in `joint.relaxed.linear`), without those
    that a line removes: such slow changes are part of the scatter between repetitions.
    """
    squares = []
    for e in E:
        n = len(e)
        last = max(int(2 * _BAND_HZ * n / sample_rate_hz), _FIRST_COSINE + 1)
        phase = np.pi * (np.arange(n) + 0.5) / n
        cosines = np.cos(np.arange(_FIRST_COSINE, last + 1)[:, None] * phase)
        squares.append(2 / n * (cosines @ e) ** 2)
    return float(np.concatenate(squares).mean() / sample_rate_hz)
