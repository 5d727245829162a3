"""Which of eight kinds of limb does the record hold? Each is fitted, with its own spectrum.

The kinds: I, B, K alone, with a late answer to the deflection, ``K_r h theta``, one of each pathway
h (a delay and a muscle's low-pass, see `pathway`), to its velocity, ``B_r h theta'``, or to both;
and each with the angle late by T. ``Z = (I s^2 + B s + K + (B_r s + K_r) h) e^(s T)`` is linear in
all but h and T, and T is linearised anew in every round. A reflex takes stiffness away at one
frequency and adds it at another; seen through the first terms of h it is less inertia, less
viscosity and a skew of ``-K_r d^3 / (6 I)``, which is why neither can be looked for without the
other.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.joint.elbow.doubts.kinds import (
    KINDS,
    UNANSWERED,
    Kind,
    KindFit,
    Products,
    columns_of,
    fitted,
    roughly,
)
from armimpedance.joint.elbow.doubts.pathway import (
    LATEST_S,
    PathwayCells,
    ReflexArc,
    all_cells,
    together,
)
from armimpedance.joint.elbow.doubts.record import (
    BENDS,
    Doubted,
    LimbModel,
    Posed,
    fit_models,
    posed,
)
from armimpedance.joint.elbow.stationary.instruments import Driver

# Are I, B and K the same in every part of the band? A limb of another kind betrays itself there.
#
# Soft tissue, a strap, a second joint: where no kind of limb that is fitted describes the record,
# each part of the band asks for other I, B and K, and an error that counts lines does not know of
# it. The best model is solved again without each of some parts (a jackknife over frequency).

#: Parts of the band, of equal numbers of lines.
PARTS: Final = 10
#: Squares of what I, B, K move without a part, over what the lines allow: from here no chance.
NO_CHANCE: Final = 16.0


def excess_over_bands(
    X: FloatArray, y: FloatArray, eta: FloatArray, frequency: FloatArray, bound: FloatArray
) -> FloatArray:
    """By how much I, B and K vary over the band more than their lines allow, (3,); 1: they do not.

    `y` (n, 2).
    `X` (n, 2, p): real and imaginary part of each line's columns; the first three are those of I, B
    and K.
    `eta` (n,): logarithm of the noise power over what the rows are weighed by.
    `frequency` (n,): order of the lines.
    `bound` (p,): one over the variance of each parameter before the record; 0 = free.
    Returns: (3,): ratio of what leaving out a part moves to what the lines allow.
    """
    size = np.sqrt((X**2).sum(axis=(0, 1))) + np.finfo(float).tiny
    weight = np.exp(-eta)
    part = np.empty(len(y), dtype=int)
    part[np.argsort(frequency)] = np.arange(len(y)) * PARTS // len(y)
    rows = X / size
    # A_b (p, p) = X^T W X and b_b (p,) = X^T W y of each part
    A = np.stack([_gram(rows[part == b], rows[part == b], weight[part == b]) for b in range(PARTS)])
    b = np.stack(
        [_gram(rows[part == b], y[part == b, :, None], weight[part == b]) for b in range(PARTS)]
    )
    prior = np.diag(bound / size**2)
    whole, target = A.sum(axis=0) + prior, b.sum(axis=0)
    # p_b (p,) = (A - A_b)^-1 (b - b_b), whose variance beyond p's is (A - A_b)^-1 - A^-1
    moved = np.linalg.solve(whole - A, target - b)[:, :3, 0] - np.linalg.solve(whole, target)[:3, 0]
    allowed = np.linalg.inv(whole - A) - np.linalg.inv(whole)
    ratio = (moved**2).sum(axis=0) / np.diagonal(allowed, axis1=1, axis2=2).sum(axis=0)[:3]
    return np.sqrt(np.where(ratio > NO_CHANCE, ratio, 1.0))


def _gram(left: FloatArray, right: FloatArray, weight: FloatArray) -> FloatArray:
    """``sum w left^T right`` over lines and their two parts."""
    return np.asarray(np.einsum("nip,niq,n->pq", left, right, weight))


#: Rounds in which skew, instruments and spectra settle: at most, and once a round moves the torque
#: of the best kind by less than this part of the noise of one line.
ROUNDS: Final = 12
_SETTLED: Final = 0.3
#: Rounds that find the skew alone, where they come first, and by how much that may then be worse
#: for the others to begin there.
_SKEW_FIRST: Final = 3
_WORTH_A_START: Final = 200.0
#: By how much the deviance must fall for each further parameter of the next round's model.
_WORTH: Final = 4.0
#: A parameter that a round finds at or below zero starts the next at this part of what it was.
_SHRUNK: Final = 0.1


@dataclass(frozen=True, eq=False)
class Contest:
    """The kinds, fitted about the best of them.

    `fits`: parameters I, B, K, then T, K_r, B_r and the bends as the kind has them.
    `bends`: which terms of amplitude all of them hold.
    `reference` (n,): logarithm of the power that the lines are weighed by over that of the sensors.
    """

    fits: dict[Kind, KindFit]
    about: LimbModel
    bends: tuple[int, ...]
    reference: FloatArray
    rows: Posed

    def best(self, kind: Kind) -> tuple[float, int]:
        """The lowest deviance of a kind, and the number of its pathway."""
        deviance = self.fits[kind].deviance
        return float(deviance.min()), int(deviance.argmin())

    def excess_over_bands(self, frequency_hz: FloatArray) -> FloatArray:
        """How I, B and K of the best model vary over the band, see `bands`, (3,)."""
        kind = self.winner()
        number = self.best(kind)[1]
        columns = columns_of(kind, float(self.about.limb[2]), self.bends)
        fit = self.fits[kind]
        X = columns.of(self.rows, fit.pathway(number))
        return excess_over_bands(X, self.rows.y, fit.eta, frequency_hz, columns.bound)

    def chance_of_limb(self) -> float:
        """Probability that chance alone departs so far from I, B and K over frequency.

        The impedance may bend by as many hats as a spectrum has, in real and imaginary part, each
        with a residual spectrum of its own: noise of any colour is none of it.
        """
        from scipy.stats import chi2

        rows, first, bent = self.rows, 0, []
        for trial in rows.trials:
            hats = rows.spectrum.hats[first : first + len(trial.s)]
            first += len(trial.s)
            Z = np.stack([trial.s**2, trial.s, np.ones_like(trial.s)], axis=1) @ self.about.limb
            columns = (trial.weighed * Z)[:, None] * hats
            bent.append(trial.rows(np.concatenate([columns, 1j * columns], axis=1)))
        limb = rows.X[..., :3]
        models = (limb, np.concatenate([limb, np.concatenate(bent)], axis=2))
        # Prior to hats that a limb's own columns repeat: wide, but not flat.
        priors = (np.zeros(3), np.r_[np.zeros(3), np.ones(models[1].shape[2] - 3)])
        alone, free = (
            float(fit_models(X[None], rows.y, rows.spectrum, prior).deviance[0])
            for X, prior in zip(models, priors, strict=True)
        )
        return float(chi2.sf(alone - free, max(models[1].shape[2] - 6, 1)))

    def winner(self) -> Kind:
        """The best kind; a parameter is worth its deviance."""
        return min(self.fits, key=self.score)

    def score(self, kind: Kind) -> float:
        """The best deviance of a kind, and what its parameters must be worth."""
        return self.best(kind)[0] + _WORTH * kind.further


def contest(
    doubted: Doubted, driver: Driver, limb: FloatArray, bends: tuple[int, ...] = ()
) -> Contest:
    """Fit all kinds, from I, B, K (3,) alone.

    `limb` (3,).
    `driver`: of the doubted band.
    `bends`: numbers of the terms of amplitude that every kind holds.
    """
    still = LimbModel(limb, np.zeros(2), ReflexArc(LATEST_S, 0.0), 0.0, np.zeros(len(BENDS)))
    flat = np.zeros(sum(len(b.s) for b in doubted.band.trials))
    made = _settled(doubted, driver, still, flat, bends, ROUNDS)
    if made.winner().answers:
        # Far from its skew a limb can look as if it answered: better may be what begins at it.
        skewed = _settled(doubted, driver, still, flat, bends, _SKEW_FIRST, UNANSWERED)
        about, reference = _next(skewed, *_best(skewed))
        if _score(doubted, driver, skewed) < _score(doubted, driver, made) + _WORTH_A_START:
            other = _settled(doubted, driver, about, reference, bends, ROUNDS)
            if _score(doubted, driver, other) < _score(doubted, driver, made):
                made = other
    stiffness = float(made.about.limb[2])
    fits = {
        kind: fitted(made.rows, columns_of(kind, stiffness, bends), rough)
        for kind, rough in made.fits.items()
    }
    return replace(made, fits=fits)


def _best(made: Contest) -> tuple[Kind, int]:
    kind = made.winner()
    return kind, made.best(kind)[1]


def _score(doubted: Doubted, driver: Driver, made: Contest) -> float:
    return _level(doubted, driver, made) + made.score(made.winner())


def _level(doubted: Doubted, driver: Driver, made: Contest) -> float:
    """What makes deviances of two linearisations one: of the motion's error, or the torque's."""
    powers = _powers(doubted, made.about, made.reference)
    sizes = []
    for power, bins in zip(powers, doubted.band.trials, strict=True):
        Z = made.about.impedance(bins)
        sizes.append(np.log(power if driver.imposed else power / np.abs(Z) ** 2))
    return float(made.rows.spectrum.squares @ np.concatenate(sizes))


def _settled(
    doubted: Doubted,
    driver: Driver,
    model: LimbModel,
    reference: FloatArray,
    bends: tuple[int, ...],
    rounds: int,
    kinds: tuple[Kind, ...] = KINDS,
) -> Contest:
    """Linearised about what fits best, until that moves no more; else the best of all rounds.

    `model`, `reference`: where it begins, and the noise (n,) that this leaves.
    Raises LinAlgError: not even the first round has finite numbers.
    """
    best: tuple[float, Contest] | None = None
    for _ in range(rounds):
        try:
            made = _round(doubted, driver, model, reference, bends, kinds)
        except np.linalg.LinAlgError:
            if best is None:
                raise
            break
        before = model
        model, reference = _next(made, *_best(made))
        if _moved(doubted, made.rows, before, model) < _SETTLED**2:
            return made
        score = _score(doubted, driver, made)
        if best is None or score < best[0]:
            best = (score, made)
    assert best is not None  # noqa: S101 - there is a round
    return best[1]


def _round(
    doubted: Doubted,
    driver: Driver,
    model: LimbModel,
    reference: FloatArray,
    bends: tuple[int, ...],
    kinds: tuple[Kind, ...],
) -> Contest:
    """All kinds, roughly, about one model."""
    rows = posed(doubted, driver, model, _powers(doubted, model, reference))
    cells = together([all_cells(), PathwayCells.about(model.pathway)])
    products = Products.of(rows, cells, np.zeros(len(reference)))
    stiffness = float(model.limb[2])
    fits = {
        kind: roughly(rows, columns_of(kind, stiffness, bends), products, cells) for kind in kinds
    }
    return Contest(fits, model, bends, reference, rows)


def _moved(doubted: Doubted, rows: Posed, before: LimbModel, after: LimbModel) -> float:
    """By how many squares of the noise two models differ in the torque of the record's motion."""
    squares = 0.0
    for bins, moved in zip(doubted.band.trials, rows.trials, strict=True):
        one, other = (m.impedance(bins) * np.exp(bins.s * m.lateness_s) for m in (before, after))
        squares += float((np.abs((other - one) * moved.weighed) ** 2).sum())
    return squares


def _powers(doubted: Doubted, model: LimbModel, reference: FloatArray) -> list[FloatArray]:
    """Noise of the equation to weigh by, one (n,) of each trial."""
    ends = np.cumsum([len(b.s) for b in doubted.band.trials])[:-1]
    parts = zip(doubted.band.trials, np.split(np.exp(reference), ends), strict=True)
    return [g * bins.noise_power(bins.impedance(model.limb)) for bins, g in parts]


def _next(made: Contest, kind: Kind, number: int) -> tuple[LimbModel, FloatArray]:
    """A kind and pathway as a model to pose the rows about, and the noise that it leaves."""
    fit = made.fits[kind]
    values = fit.values[number]
    extra = list(values[3:])
    lateness = extra.pop(0) if kind.late_angle else 0.0
    answer = np.zeros(2)
    for which in kind.answers:
        answer[which] = extra.pop(0)
    bends = np.zeros(len(BENDS))
    bends[list(made.bends)] = extra
    limb = np.maximum(values[:3], _SHRUNK * made.about.limb)
    model = LimbModel(limb, answer, fit.pathway(number), float(lateness), bends)
    return model, made.reference + fit.eta


# Does the joint depend on how far and how fast it moves? Terms of amplitude beside the best limb.
#
# Stiffness that rises or falls with the deflection bends torque over angle by theta^2 and theta^3,
# friction by the sign of the velocity. Of a Gaussian motion they have parts that no linear limb
# makes, whatever its reflexes, and these are what is looked for.

STIFFENS: Final = (0, 1)
RUBS: Final = (2, 3)
#: By how much the deviance must fall: chance does so once in some thousand records.
LIKELIER: Final = 20.0
#: What a further pair of terms must be worth.
_WORTH_OF_AMPLITUDE: Final = 12.0


@dataclass(frozen=True, eq=False)
class Bent:
    """The terms of amplitude that the record asks for.

    `terms`: numbers among `record.BENDS`; () where none is clearly there.
    `gain`: by how much the deviance falls with all of them.
    `smallest`: the smallest change of the stiffness at the rms deflection that would have been
    seen, N m/rad.
    """

    terms: tuple[int, ...]
    gain: float
    smallest: float


def bent(made: Contest, deflection: float) -> Bent:
    """Judge the terms of amplitude beside the best of a contest without them.

    `deflection`: rms of the angle, rad.
    """
    kind = min(KINDS, key=lambda k: made.best(k)[0])
    without, number = made.best(kind)
    columns = columns_of(kind, float(made.about.limb[2]), ())
    limb = columns.of(made.rows, made.fits[kind].pathway(number))
    deviance, smallest = {}, np.inf
    for terms in (STIFFENS, RUBS, (*STIFFENS, *RUBS)):
        X = np.concatenate([limb, made.rows.X[..., 4 + np.array(terms)]], axis=2)
        fit = fit_models(X[None], made.rows.y, made.rows.spectrum, np.zeros(X.shape[2]))
        deviance[terms] = float(fit.deviance[0])
        if terms == STIFFENS:
            C = np.linalg.inv(fit.information[0])
            # The slope of c theta^3 has the mean 3 c <theta^2>.
            smallest = 3 * deflection**2 * float(np.sqrt(LIKELIER * C[-1, -1]))
    best = min(deviance, key=lambda t: deviance[t] + _WORTH_OF_AMPLITUDE * len(t) / 2)
    gain = without - min(deviance.values())
    clear = without - deviance[best] > LIKELIER
    return Bent(best if clear else (), gain, smallest)


def stiffening(values: FloatArray, deflection: float) -> float:
    """What theta^3 adds to the stiffness of a motion of this rms, N m/rad; values of STIFFENS."""
    return float(3 * values[1] * deflection**2)
