"""Compare eight kinds of limb on one record; each is fitted with its own residual spectrum.

The kinds are: I, B, K only; with a late answer (reflex) to the deflection, ``K_r h theta``, h being
a pathway of a delay and a muscle's low-pass (see `pathway`); with one to the velocity, ``B_r h
theta'``; with both; and each of these four with the angle late by T (skew). ``Z = (I s^2 + B s + K
+ (B_r s + K_r) h) e^(s T)`` is linear in all but h and T; T is linearised again in every round. A
reflex reduces the stiffness at one frequency and increases it at another. To the first orders of h
it looks like less inertia, less viscosity and a skew of ``-K_r d^3 / (6 I)``. Reflex and skew must
therefore be searched for together.
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

# Are I, B and K the same in every part of the band?
#
# If no fitted kind of limb describes the record (soft tissue, a strap, a second joint), each part
# of the band gives different I, B and K, and a standard error from the number of lines is too
# small. The best model is solved again without each part in turn (a jackknife over frequency).

#: Number of parts of the band, with equal numbers of lines.
PARTS: Final = 10
#: Ratio of the jackknife variance of I, B, K to that from the lines; above this it is not chance.
NO_CHANCE: Final = 16.0


def excess_over_bands(
    X: FloatArray, y: FloatArray, eta: FloatArray, frequency: FloatArray, bound: FloatArray
) -> FloatArray:
    """Factor (3,) by which I, B and K vary over the band more than their standard errors; 1 if not.

    `y` (n, 2).
    `X` (n, 2, p): real and imaginary part of each line's columns; the first three are those of I, B
    and K.
    `eta` (n,): logarithm of the noise power relative to the rows' reference power.
    `frequency` (n,): by which the lines are sorted into parts.
    `bound` (p,): one over the prior variance of each parameter; 0 = no prior.
    Returns: (3,): jackknife standard error over the standard error from the lines.
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


#: Largest number of rounds for skew, instruments and spectra to converge; they have converged when
#: a round moves the torque of the best kind by less than this share of the noise of one line.
ROUNDS: Final = 12
_SETTLED: Final = 0.3
#: Rounds of a search for the skew only, and by how much its score may be worse than the first
#: search's for a second full search to start from it.
_SKEW_FIRST: Final = 3
_WORTH_A_START: Final = 200.0
#: Fall of the deviance that each further parameter of the next round's model must bring.
_WORTH: Final = 4.0
#: A parameter that becomes zero or negative restarts at this share of its previous value.
_SHRUNK: Final = 0.1


@dataclass(frozen=True, eq=False)
class Contest:
    """All kinds of limb, fitted about the best of them.

    `fits`: parameters I, B, K, then those of T, K_r, B_r and the bends that the kind has.
    `about`: the model about which the rows are linearised.
    `bends`: numbers of the terms of amplitude that all kinds have.
    `reference` (n,): logarithm of the lines' reference power over the sensors' noise power.
    """

    fits: dict[Kind, KindFit]
    about: LimbModel
    bends: tuple[int, ...]
    reference: FloatArray
    rows: Posed

    def best(self, kind: Kind) -> tuple[float, int]:
        """Lowest deviance of a kind, and the number of its pathway."""
        deviance = self.fits[kind].deviance
        return float(deviance.min()), int(deviance.argmin())

    def excess_over_bands(self, frequency_hz: FloatArray) -> FloatArray:
        """Variation of I, B and K of the best model over the band (3,), see `excess_over_bands`."""
        kind = self.winner()
        number = self.best(kind)[1]
        columns = columns_of(kind, float(self.about.limb[2]), self.bends)
        fit = self.fits[kind]
        X = columns.of(self.rows, fit.pathway(number))
        return excess_over_bands(X, self.rows.y, fit.eta, frequency_hz, columns.bound)

    def chance_of_limb(self) -> float:
        """Probability that chance alone departs so far from I, B and K over frequency.

        The impedance may be modified by as many hats as a spectrum has, in real and imaginary part.
        Both models have their own residual spectrum, so coloured noise does not count as a misfit.
        """
        from scipy.stats import chi2

        rows, first, hat_columns = self.rows, 0, []
        for trial in rows.trials:
            hats = rows.spectrum.hats[first : first + len(trial.s)]
            first += len(trial.s)
            Z = np.stack([trial.s**2, trial.s, np.ones_like(trial.s)], axis=1) @ self.about.limb
            columns = (trial.weighed * Z)[:, None] * hats
            hat_columns.append(trial.rows(np.concatenate([columns, 1j * columns], axis=1)))
        limb = rows.X[..., :3]
        models = (limb, np.concatenate([limb, np.concatenate(hat_columns)], axis=2))
        # Hats can repeat the limb's own columns, so their prior is wide, but not flat.
        priors = (np.zeros(3), np.r_[np.zeros(3), np.ones(models[1].shape[2] - 3)])
        plain, free = (
            float(fit_models(X[None], rows.y, rows.spectrum, prior).deviance[0])
            for X, prior in zip(models, priors, strict=True)
        )
        return float(chi2.sf(plain - free, max(models[1].shape[2] - 6, 1)))

    def winner(self) -> Kind:
        """The kind of the best score."""
        return min(self.fits, key=self.score)

    def score(self, kind: Kind) -> float:
        """Lowest deviance of a kind, plus a penalty for its parameters."""
        return self.best(kind)[0] + _WORTH * kind.further


def contest(
    doubted: Doubted, driver: Driver, limb: FloatArray, bends: tuple[int, ...] = ()
) -> Contest:
    """Fit all kinds, starting from I, B, K (3,) only.

    `limb` (3,).
    `driver`: source of the motion in the band.
    `bends`: numbers of the terms of amplitude that every kind has.
    """
    still = LimbModel(limb, np.zeros(2), ReflexArc(LATEST_S, 0.0), 0.0, np.zeros(len(BENDS)))
    flat = np.zeros(sum(len(b.s) for b in doubted.band.trials))
    result = _settled(doubted, driver, still, flat, bends, ROUNDS)
    if result.winner().answers:
        # Before its skew is corrected, a limb can look as if it had a reflex: a search that starts
        # from the skew may end better.
        skewed = _settled(doubted, driver, still, flat, bends, _SKEW_FIRST, UNANSWERED)
        about, reference = _next(skewed, *_best(skewed))
        if _score(doubted, driver, skewed) < _score(doubted, driver, result) + _WORTH_A_START:
            second = _settled(doubted, driver, about, reference, bends, ROUNDS)
            if _score(doubted, driver, second) < _score(doubted, driver, result):
                result = second
    stiffness = float(result.about.limb[2])
    fits = {
        kind: fitted(result.rows, columns_of(kind, stiffness, bends), rough)
        for kind, rough in result.fits.items()
    }
    return replace(result, fits=fits)


def _best(result: Contest) -> tuple[Kind, int]:
    kind = result.winner()
    return kind, result.best(kind)[1]


def _score(doubted: Doubted, driver: Driver, result: Contest) -> float:
    return _level(doubted, driver, result) + result.score(result.winner())


def _level(doubted: Doubted, driver: Driver, result: Contest) -> float:
    """Offset that makes deviances of two linearisations comparable.

    It refers them to the error of the motion, or to that of the torque if the angle is imposed.
    """
    powers = _powers(doubted, result.about, result.reference)
    sizes = []
    for power, bins in zip(powers, doubted.band.trials, strict=True):
        Z = result.about.impedance(bins)
        sizes.append(np.log(power if driver.imposed else power / np.abs(Z) ** 2))
    return float(result.rows.spectrum.squares @ np.concatenate(sizes))


def _settled(
    doubted: Doubted,
    driver: Driver,
    model: LimbModel,
    reference: FloatArray,
    bends: tuple[int, ...],
    rounds: int,
    kinds: tuple[Kind, ...] = KINDS,
) -> Contest:
    """Repeat the rounds until the best model converges; else return the best of all rounds.

    `model`, `reference`: start model, and its log noise power (n,).
    Raises LinAlgError: even the first round gives numbers that are not finite.
    """
    best: tuple[float, Contest] | None = None
    for _ in range(rounds):
        try:
            result = _round(doubted, driver, model, reference, bends, kinds)
        except np.linalg.LinAlgError:
            if best is None:
                raise
            break
        before = model
        model, reference = _next(result, *_best(result))
        if _moved(doubted, result.rows, before, model) < _SETTLED**2:
            return result
        score = _score(doubted, driver, result)
        if best is None or score < best[0]:
            best = (score, result)
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
    """Fit all kinds, roughly, linearised about one model."""
    rows = posed(doubted, driver, model, _powers(doubted, model, reference))
    cells = together([all_cells(), PathwayCells.about(model.pathway)])
    products = Products.of(rows, cells, np.zeros(len(reference)))
    stiffness = float(model.limb[2])
    fits = {
        kind: roughly(rows, columns_of(kind, stiffness, bends), products, cells) for kind in kinds
    }
    return Contest(fits, model, bends, reference, rows)


def _moved(doubted: Doubted, rows: Posed, before: LimbModel, after: LimbModel) -> float:
    """Squared difference of two models in the torque of the record's motion, over the noise."""
    squares = 0.0
    for bins, moved in zip(doubted.band.trials, rows.trials, strict=True):
        old, new = (m.impedance(bins) * np.exp(bins.s * m.lateness_s) for m in (before, after))
        squares += float((np.abs((new - old) * moved.weighed) ** 2).sum())
    return squares


def _powers(doubted: Doubted, model: LimbModel, reference: FloatArray) -> list[FloatArray]:
    """Noise power of the equation to weight by, one (n,) array per trial."""
    ends = np.cumsum([len(b.s) for b in doubted.band.trials])[:-1]
    parts = zip(doubted.band.trials, np.split(np.exp(reference), ends), strict=True)
    return [g * bins.noise_power(bins.impedance(model.limb)) for bins, g in parts]


def _next(result: Contest, kind: Kind, number: int) -> tuple[LimbModel, FloatArray]:
    """Return a fitted kind and pathway as the next model, and its log noise power."""
    fit = result.fits[kind]
    values = fit.values[number]
    extra = list(values[3:])
    lateness = extra.pop(0) if kind.late_angle else 0.0
    answer = np.zeros(2)
    for which in kind.answers:
        answer[which] = extra.pop(0)
    bends = np.zeros(len(BENDS))
    bends[list(result.bends)] = extra
    limb = np.maximum(values[:3], _SHRUNK * result.about.limb)
    model = LimbModel(limb, answer, fit.pathway(number), float(lateness), bends)
    return model, result.reference + fit.eta


# Does the joint depend on how far and how fast it moves? Terms of amplitude are added to the limb.
#
# Stiffness that depends on the deflection adds theta^2 and theta^3 to the torque, friction adds the
# sign of the velocity. For a Gaussian motion, no linear limb, whatever its reflexes, can produce
# the whole of these terms; the part that it cannot produce is tested.

STIFFENS: Final = (0, 1)
RUBS: Final = (2, 3)
#: Fall of the deviance that is significant: chance gives it once in some thousand records.
LIKELIER: Final = 20.0
#: Fall of the deviance that a further pair of terms must bring.
_WORTH_OF_AMPLITUDE: Final = 12.0


@dataclass(frozen=True, eq=False)
class Bent:
    """Terms of amplitude that are significant.

    `terms`: indices into `record.BENDS`; () if none is significant.
    `gain`: fall of the deviance with all of them.
    `smallest`: smallest change of the stiffness at the rms deflection that would have been
    detected, N m/rad.
    """

    terms: tuple[int, ...]
    gain: float
    smallest: float


def bent(result: Contest, deflection: float) -> Bent:
    """Test the terms of amplitude together with the best model of a contest without them.

    `deflection`: rms of the angle, rad.
    """
    kind = min(KINDS, key=lambda k: result.best(k)[0])
    without, number = result.best(kind)
    columns = columns_of(kind, float(result.about.limb[2]), ())
    limb = columns.of(result.rows, result.fits[kind].pathway(number))
    deviance, smallest = {}, np.inf
    for terms in (STIFFENS, RUBS, (*STIFFENS, *RUBS)):
        X = np.concatenate([limb, result.rows.X[..., 4 + np.array(terms)]], axis=2)
        fit = fit_models(X[None], result.rows.y, result.rows.spectrum, np.zeros(X.shape[2]))
        deviance[terms] = float(fit.deviance[0])
        if terms == STIFFENS:
            C = np.linalg.inv(fit.information[0])
            # The mean slope of c theta^3 is 3 c <theta^2>.
            smallest = 3 * deflection**2 * float(np.sqrt(LIKELIER * C[-1, -1]))
    best = min(deviance, key=lambda t: deviance[t] + _WORTH_OF_AMPLITUDE * len(t) / 2)
    gain = without - min(deviance.values())
    clear = without - deviance[best] > LIKELIER
    return Bent(best if clear else (), gain, smallest)


def stiffening(values: FloatArray, deflection: float) -> float:
    """Stiffness that theta^3 adds for a motion of this rms, N m/rad; `values` of STIFFENS."""
    return float(3 * values[1] * deflection**2)
