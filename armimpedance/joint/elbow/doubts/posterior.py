"""What the record leaves of each kind of limb: all of them, weighed by how well they predict it.

A prior for lateness and answer, in parts that are normal, gives every kind and pathway its evidence
and I, B, K beside it; the mixture of these is what can be said. A strong record leaves one kind and
its narrow interval, a weak one all of them with what each would make of K: nothing has to be seen
before it is allowed for (J. A. Hoeting et al., Statistical Science 14, 1999).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import Final

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray
from armimpedance.joint.elbow.doubts.contest import Contest
from armimpedance.joint.elbow.doubts.kinds import KINDS, RATE_S, Kind

#: sd of the lateness before the record, s, and the part of belief in it; None: in step.
LATENESS: Final = ((None, 0.5), (0.5e-3, 0.3), (5e-3, 0.2))
#: sd of the late answer before the record as part of K, and the part of belief in it.
ANSWERS: Final = ((None, 0.2), (0.15, 0.5), (0.5, 0.3))
#: Belief, of an answer, that it is to the deflection, to the velocity, or to both.
ANSWERED_TO: Final = {(): 1.0, (0,): 1 / 3, (1,): 1 / 3, (0, 1): 1 / 3}
_MOST_STEPS: Final = 60
#: Where the search for an interval's end stops, a part of the widest that it may be.
_SHARP: Final = 1e-13
#: Parts of a mixture that together weigh less than this are left out of its intervals.
_NEXT_TO_NOTHING: Final = 1e-10
LEVEL: Final = 0.95
#: A part without width, such as no answer at all, is as wide as this part of the whole.
_POINT: Final = 1e-9


@dataclass(frozen=True, eq=False)
class Posterior:
    """A mixture of c normal parts over I, B, K, T, K_r, B_r.

    `mean` (c, 6), `covariance` (c, 6, 6), `late_angle`, `answers` (c,) bool, `delay_s`,
    `muscle_s` (c,).
    `log_weight` (c,): up to a constant: a part that is all but impossible still has its place among
    its like.
    `shift` (c, 3): by how much I, B, K differ from those of a limb that has neither.
    `excess` (c, 3, 3): by how much they are more uncertain.
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
        """Of all parts (c,); their sum is 1."""
        return self.share(np.ones(len(self.log_weight), dtype=bool))

    def share(self, among: BoolArray) -> FloatArray:
        """Weights of some parts among themselves; their sum is 1."""
        weight = np.exp(self.log_weight[among] - self.log_weight[among].max())
        return np.asarray(weight / weight.sum())

    @property
    def of_neither(self) -> float:
        """Probability that the angle is in step and nothing answers."""
        return float(self.weight[~self.late_angle & ~self.answers].sum())

    @property
    def of_lateness(self) -> float:
        """Probability that the angle is late or early."""
        return float(self.weight[self.late_angle].sum())

    @property
    def of_answer(self) -> float:
        """Probability of a late answer."""
        return float(self.weight[self.answers].sum())


def posterior(made: Contest, stiffness: float) -> Posterior:
    """All kinds, pathways and parts of the prior; `stiffness` scales that of the answer."""
    parts = [
        _part(made, kind, belief, lateness, None if size is None else stiffness * size)
        for kind in KINDS
        for lateness, size, belief in _priors(kind)
    ]
    whole = [np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(Posterior)]
    return Posterior(*whole)


def _priors(kind: Kind) -> Iterator[tuple[float | None, float | None, float]]:
    """The prior's parts that belong to a kind: sd of T and of K_r / K, and the belief in them."""
    share = ANSWERED_TO[kind.answers]
    for lateness, likely in LATENESS:
        for size, sized in ANSWERS:
            if (lateness is not None, size is not None) == (kind.late_angle, bool(kind.answers)):
                yield lateness, size, likely * sized * share


def _part(
    made: Contest, kind: Kind, belief: float, lateness: float | None, answer: float | None
) -> Posterior:
    """One normal part of each pathway; its weight is belief times evidence."""
    fit = made.fits[kind]
    m, p = fit.values.shape
    free = 3 + kind.further
    sds = np.array([lateness or 0.0, answer or 0.0, (answer or 0.0) * RATE_S])
    has = np.array([kind.late_angle, 0 in kind.answers, 1 in kind.answers])
    prior = np.zeros(p)
    prior[3:free] = sds[has] ** -2
    N, where = fit.information, np.r_[:3, 3 + np.flatnonzero(has)]
    A = N + np.diag(prior)
    b = np.einsum("mij,mj->mi", N, fit.values)
    # A (p, p) q (p,) = N (p, p) values (p,): the mean once the prior is counted
    C = np.linalg.inv(A)
    q = np.einsum("mij,mj->mi", C, b)
    gain = np.einsum("mi,mi->m", b, q - fit.values) - fit.deviance
    evidence = (gain + np.log(prior[3:free]).sum() - np.linalg.slogdet(A)[1]) / 2
    mean, covariance = np.zeros((m, 6)), np.zeros((m, 6, 6))
    mean[:, where] = q[:, :free]
    covariance[:, where[:, None], where] = C[:, :free, :free]
    # The same equations without lateness and answer: what I, B, K alone would be.
    own = np.r_[:3, free:p]
    alone = np.linalg.inv(N[:, own[:, None], own])
    limb = np.einsum("mij,mj->mi", alone, b[:, own])
    return Posterior(
        log_weight=evidence + np.log(belief * fit.belief),
        mean=mean,
        covariance=covariance,
        shift=mean[:, :3] - limb[:, :3],
        excess=C[:, :3, :3] - alone[:, :3, :3],
        late_angle=np.full(m, kind.late_angle),
        answers=np.full(m, bool(kind.answers)),
        delay_s=fit.delay_s,
        muscle_s=fit.muscle_s,
    )


def half_widths(
    weight: FloatArray, mean: FloatArray, sd: FloatArray, centre: FloatArray
) -> FloatArray:
    """Half of the interval about `centre` (p,) that holds `LEVEL` of a mixture, (p,).

    `weight` (c,), `mean`, `sd` (c, p), `centre` (p,).
    """
    from scipy.special import ndtr

    # the parts that together weigh next to nothing move no digit that is printed
    heavy = weight > _NEXT_TO_NOTHING / len(weight)
    weight, mean, sd = weight[heavy], mean[heavy], sd[heavy]
    reach = np.abs(mean - centre).max(axis=0) + 6 * sd.max(axis=0)
    sd = np.maximum(sd, _POINT * reach + np.finfo(float).tiny)
    low, high, half = np.zeros(len(centre)), reach, reach / 2
    for _ in range(_MOST_STEPS):
        up, down = (centre + half - mean) / sd, (centre - half - mean) / sd
        missing = LEVEL - weight @ (ndtr(up) - ndtr(down))
        low, high = np.where(missing > 0, half, low), np.where(missing > 0, high, half)
        # Newton's step by the mixture's density at both ends, or a halving where that leads astray
        density = (
            weight @ ((np.exp(-(up**2) / 2) + np.exp(-(down**2) / 2)) / sd) / np.sqrt(2 * np.pi)
        )
        step = half + missing / np.maximum(density, np.finfo(float).tiny)
        last, half = half, np.where((low < step) & (step < high), step, (low + high) / 2)
        if (np.abs(half - last) <= _SHARP * reach).all():
            break
    return np.asarray(half)
