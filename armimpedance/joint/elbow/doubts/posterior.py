"""Average all kinds of limb, weighted by how well they predict the record.

With a prior for lateness and answer (a mixture of normal parts) every kind and pathway has an
evidence, and its own I, B, K; the result is their mixture. A strong record leaves one kind with a
narrow interval, a weak one leaves all kinds with the K of each. An effect is thus allowed for even
if it is not significant (J. A. Hoeting et al., Statistical Science 14, 1999).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import Final

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray
from armimpedance.joint.elbow.doubts.contest import Contest
from armimpedance.joint.elbow.doubts.kinds import KINDS, RATE_S, Kind

#: Prior of the lateness: standard deviation, s, and probability of each part; None: in step.
LATENESS: Final = ((None, 0.5), (0.5e-3, 0.3), (5e-3, 0.2))
#: Prior of the answer: standard deviation as a share of K, and probability; None: no answer.
ANSWERS: Final = ((None, 0.2), (0.15, 0.5), (0.5, 0.3))
#: Prior probability that an answer is to the deflection, to the velocity, or to both.
ANSWERED_TO: Final = {(): 1.0, (0,): 1 / 3, (1,): 1 / 3, (0, 1): 1 / 3}
_MOST_STEPS: Final = 60
#: The search for an interval's end stops at this share of its largest half-width.
_SHARP: Final = 1e-13
#: Parts of a mixture whose weights sum to less than this are left out of its intervals.
_NEXT_TO_NOTHING: Final = 1e-10
LEVEL: Final = 0.95
#: Width of a part without width (such as "no answer"), as a share of the whole.
_POINT: Final = 1e-9


@dataclass(frozen=True, eq=False)
class Posterior:
    """Mixture of c normal parts over I, B, K, T, K_r, B_r.

    `mean` (c, 6), `covariance` (c, 6, 6), `late_angle`, `answers` (c,) bool, `delay_s`,
    `muscle_s` (c,).
    `log_weight` (c,): up to a constant; as logarithms, so that very unlikely parts can still be
    compared with each other.
    `shift` (c, 3): difference of I, B, K from those of a limb without lateness and answer.
    `excess` (c, 3, 3): difference of their covariance.
    """

    log_weight: FloatArray
    mean: FloatArray
    covariance: FloatArray
    shift: FloatArray
    excess: FloatArray
    late_angle: BoolArray
    answers: BoolArray
    delay_s: FloatArray
    muscle_s: FloatArray

    @property
    def weight(self) -> FloatArray:
        """Weights of all parts (c,); their sum is 1."""
        return self.share(np.ones(len(self.log_weight), dtype=bool))

    def share(self, among: BoolArray) -> FloatArray:
        """Weights of selected parts, normalised to the sum 1."""
        weight = np.exp(self.log_weight[among] - self.log_weight[among].max())
        return np.asarray(weight / weight.sum())

    @property
    def of_neither(self) -> float:
        """Probability that the angle is in step and there is no late answer."""
        return float(self.weight[~self.late_angle & ~self.answers].sum())

    @property
    def of_lateness(self) -> float:
        """Probability that the angle is late or early."""
        return float(self.weight[self.late_angle].sum())

    @property
    def of_answer(self) -> float:
        """Probability of a late answer."""
        return float(self.weight[self.answers].sum())


def posterior(result: Contest, stiffness: float) -> Posterior:
    """Mixture over all kinds, pathways and parts of the prior; `stiffness` scales the answer's
    prior.
    """
    parts = [
        _part(result, kind, belief, lateness, None if size is None else stiffness * size)
        for kind in KINDS
        for lateness, size, belief in _priors(kind)
    ]
    whole = [np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(Posterior)]
    return Posterior(*whole)


def _priors(kind: Kind) -> Iterator[tuple[float | None, float | None, float]]:
    """Yield the parts of the prior for a kind: sd of T and of K_r / K, and their probability."""
    share = ANSWERED_TO[kind.answers]
    for lateness, likely in LATENESS:
        for size, probable in ANSWERS:
            if (lateness is not None, size is not None) == (kind.late_angle, bool(kind.answers)):
                yield lateness, size, likely * probable * share


def _part(
    result: Contest, kind: Kind, belief: float, lateness: float | None, answer: float | None
) -> Posterior:
    """One normal part for each pathway; its weight is prior probability times evidence."""
    fit = result.fits[kind]
    m, p = fit.values.shape
    free = 3 + kind.further
    sds = np.array([lateness or 0.0, answer or 0.0, (answer or 0.0) * RATE_S])
    has = np.array([kind.late_angle, 0 in kind.answers, 1 in kind.answers])
    prior = np.zeros(p)
    prior[3:free] = sds[has] ** -2
    N, at = fit.information, np.r_[:3, 3 + np.flatnonzero(has)]
    A = N + np.diag(prior)
    b = np.einsum("mij,mj->mi", N, fit.values)
    # A (p, p) q (p,) = N (p, p) values (p,): the posterior mean
    C = np.linalg.inv(A)
    q = np.einsum("mij,mj->mi", C, b)
    gain = np.einsum("mi,mi->m", b, q - fit.values) - fit.deviance
    evidence = (gain + np.log(prior[3:free]).sum() - np.linalg.slogdet(A)[1]) / 2
    mean, covariance = np.zeros((m, 6)), np.zeros((m, 6, 6))
    mean[:, at] = q[:, :free]
    covariance[:, at[:, None], at] = C[:, :free, :free]
    # I, B, K from the same equations without lateness and answer.
    own = np.r_[:3, free:p]
    plain = np.linalg.inv(N[:, own[:, None], own])
    limb = np.einsum("mij,mj->mi", plain, b[:, own])
    return Posterior(
        log_weight=evidence + np.log(belief * fit.belief),
        mean=mean,
        covariance=covariance,
        shift=mean[:, :3] - limb[:, :3],
        excess=C[:, :3, :3] - plain[:, :3, :3],
        late_angle=np.full(m, kind.late_angle),
        answers=np.full(m, bool(kind.answers)),
        delay_s=fit.delay_s,
        muscle_s=fit.muscle_s,
    )


def half_widths(
    weight: FloatArray, mean: FloatArray, sd: FloatArray, centre: FloatArray
) -> FloatArray:
    """Half-widths (p,) of the intervals about `centre` (p,) that contain `LEVEL` of a mixture.

    `weight` (c,), `mean`, `sd` (c, p), `centre` (p,).
    """
    from scipy.special import ndtr

    # parts of negligible total weight do not change a printed digit
    heavy = weight > _NEXT_TO_NOTHING / len(weight)
    weight, mean, sd = weight[heavy], mean[heavy], sd[heavy]
    reach = np.abs(mean - centre).max(axis=0) + 6 * sd.max(axis=0)
    sd = np.maximum(sd, _POINT * reach + np.finfo(float).tiny)
    low, high, half = np.zeros(len(centre)), reach, reach / 2
    for _ in range(_MOST_STEPS):
        up, down = (centre + half - mean) / sd, (centre - half - mean) / sd
        missing = LEVEL - weight @ (ndtr(up) - ndtr(down))
        low, high = np.where(missing > 0, half, low), np.where(missing > 0, high, half)
        # Newton's step from the mixture's density at both ends, or bisection outside the bracket
        density = (
            weight @ ((np.exp(-(up**2) / 2) + np.exp(-(down**2) / 2)) / sd) / np.sqrt(2 * np.pi)
        )
        step = half + missing / np.maximum(density, np.finfo(float).tiny)
        last, half = half, np.where((low < step) & (step < high), step, (low + high) / 2)
        if (np.abs(half - last) <= _SHARP * reach).all():
            break
    return np.asarray(half)
