"""Which of six kinds of limb does the record hold? Each is fitted, with its own spectrum.

The kinds: I, B, K alone, with a late answer to the motion, ``K_r theta(t - d)``, one of each delay,
with one to its velocity too, ``B_r theta'(t - d)``; and each with the angle late by T.
``Z = (I s^2 + B s + K + (B_r s + K_r) e^(-s d)) e^(s T)`` is linear in all but d and T, and T is
linearised anew in every round. A reflex takes stiffness away at one frequency and adds it at
another; seen through ``e^(-s d)``'s first terms it is less inertia, less viscosity and a skew of
``-K_r d^3 / (6 I)``, which is why neither can be looked for without the other.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.joint.elbow.doubts.bands import excess_over_bands
from armimpedance.joint.elbow.doubts.record import BENDS, Doubted
from armimpedance.joint.elbow.doubts.rows import Model, Posed, posed
from armimpedance.joint.elbow.doubts.whittle import Fitted, Spectrum, fit_models
from armimpedance.joint.elbow.stationary.instruments import Driver

#: Rounds in which skew, instruments and spectra settle: at most, and once a round moves the best
#: kind's parameters by less than this part of their standard errors.
ROUNDS: Final = 5
_SETTLED: Final = 0.1
#: Rounds that find the skew alone, where they come first.
_SKEW_FIRST: Final = 2
#: Bounds so wide that they matter only where the record tells nothing: s, and parts of K.
_ANY_LATENESS_S: Final = 20e-3
_ANY_ANSWER: Final = 3.0
#: A velocity is worth this much of a deflection, s.
RATE_S: Final = 0.05
#: By how much the deviance must fall for each further parameter of the next round's model.
_WORTH: Final = 4.0
#: A parameter that a round finds at or below zero starts the next at this part of what it was.
_SHRUNK: Final = 0.1


class Kind(NamedTuple):
    """What stands beside I, B and K."""

    late_angle: bool
    answers: int

    @property
    def further(self) -> int:
        """Parameters beside I, B, K."""
        return self.late_angle + self.answers


#: In step or not; no answer, one to the motion, one to its velocity too.
KINDS: Final = tuple(Kind(late, answers) for late in (False, True) for answers in (0, 1, 2))


@dataclass(frozen=True, eq=False)
class Contest:
    """The kinds, fitted about the best of them.

    Attributes
    ----------
    fits : mapping of Kind to Fitted
        Parameters I, B, K, then T, K_r, B_r and the bends as the kind has them; those with an
        answer hold one model of each delay.
    delays_s : (D,)
    about : Model
    bends : tuple of int
        Which terms of amplitude all of them hold.
    reference : (n,)
        Logarithm of the power that the lines are weighed by over that of the sensors.
    rows : Posed
    """

    fits: dict[Kind, Fitted]
    delays_s: FloatArray
    about: Model
    bends: tuple[int, ...]
    reference: FloatArray
    rows: Posed

    def best(self, kind: Kind) -> tuple[float, int]:
        """The lowest deviance of a kind, and the number of its delay."""
        deviance = self.fits[kind].deviance
        return float(deviance.min()), int(deviance.argmin())

    def excess_over_bands(self, frequency_hz: FloatArray) -> FloatArray:
        """How I, B and K of the best model vary over the band, see `bands`, (3,)."""
        kind = self.winner()
        number = self.best(kind)[1]
        X, y, _, bound = _table(self.rows, self.about, kind, self.bends)
        eta = self.fits[kind].eta[number]
        return excess_over_bands(X[number], y, eta, frequency_hz, bound)

    def winner(self, *, late_only: bool = False) -> Kind:
        """The best kind, of all or of those without answer; a parameter is worth its deviance."""
        kinds = [k for k in KINDS if not (late_only and k.answers)]
        return min(kinds, key=self.score)

    def score(self, kind: Kind) -> float:
        """The best deviance of a kind, and what its parameters must be worth."""
        return self.best(kind)[0] + _WORTH * kind.further


def contest(
    doubted: Doubted, driver: Driver, limb: FloatArray, bends: tuple[int, ...] = ()
) -> Contest:
    """Fit all kinds, from I, B, K (3,) alone.

    Parameters
    ----------
    doubted : Doubted
    driver : Driver
        Of the doubted band.
    limb : (3,)
    bends : tuple of int
        Numbers of the terms of amplitude that every kind holds.
    """
    made = _settled(doubted, driver, limb, bends, skew_first=False)
    if not made.winner().answers:
        return made
    # Far from its skew a limb can look as if it answered: what settles from there may be better.
    other = _settled(doubted, driver, limb, bends, skew_first=True)
    levels = [_level(doubted, driver, one) + one.score(one.winner()) for one in (made, other)]
    return other if levels[1] < levels[0] else made


def _level(doubted: Doubted, driver: Driver, made: Contest) -> float:
    """What makes deviances of two linearisations one: of the motion's error, or the torque's."""
    powers = _powers(doubted, made.about, made.reference)
    sizes = []
    for power, bins in zip(powers, doubted.band.trials, strict=True):
        Z = made.about.impedance(bins)
        sizes.append(np.log(power if driver.imposed else power / np.abs(Z) ** 2))
    return float(made.rows.spectrum.squares @ np.concatenate(sizes))


def _settled(
    doubted: Doubted, driver: Driver, limb: FloatArray, bends: tuple[int, ...], *, skew_first: bool
) -> Contest:
    model = Model(limb, np.zeros(2), float(doubted.delays_s[0]), 0.0, np.zeros(len(BENDS)))
    reference = np.zeros(sum(len(b.s) for b in doubted.band.trials))
    before = None
    for turn in range(ROUNDS):
        rows = posed(doubted, driver, model, _powers(doubted, model, reference))
        fits = {kind: fit_models(*_table(rows, model, kind, bends)) for kind in KINDS}
        made = Contest(fits, doubted.delays_s, model, bends, reference, rows)
        kind = made.winner(late_only=skew_first and turn < _SKEW_FIRST)
        number = made.best(kind)[1]
        values, information = fits[kind].values[number], fits[kind].information[number]
        if turn > _SKEW_FIRST * skew_first and before is not None and len(before) == len(values):
            moved = values - before
            if moved @ information @ moved < _SETTLED**2:
                break
        before = values
        model, reference = _next(made, kind, number)
    return made


def _powers(doubted: Doubted, model: Model, reference: FloatArray) -> list[FloatArray]:
    """Noise of the equation to weigh by, one (n,) of each trial."""
    ends = np.cumsum([len(b.s) for b in doubted.band.trials])[:-1]
    parts = zip(doubted.band.trials, np.split(np.exp(reference), ends), strict=True)
    return [g * bins.noise_power(bins.impedance(model.limb)) for bins, g in parts]


def _table(
    rows: Posed, about: Model, kind: Kind, bends: tuple[int, ...]
) -> tuple[FloatArray, FloatArray, Spectrum, FloatArray]:
    """Columns (m, n, 2, p) of one kind, what they explain (n, 2), its spectrum and bounds (p,)."""
    columns, bounds = [rows.limb[..., :3]], [0.0, 0.0, 0.0]
    if kind.late_angle:
        columns.append(rows.limb[..., 3:])
        bounds.append(_ANY_LATENESS_S**-2)
    X = np.concatenate(columns, axis=2)[None]
    if kind.answers:
        late = np.moveaxis(rows.late, 2, 0)[..., : kind.answers]
        X = np.concatenate([np.broadcast_to(X, (len(late), *X.shape[1:])), late], axis=3)
        sizes = _ANY_ANSWER * about.limb[2] * np.array([1.0, RATE_S])
        bounds += list(sizes[: kind.answers] ** -2)
    if bends:
        curved = np.broadcast_to(rows.bends[None, ..., list(bends)], (*X.shape[:3], len(bends)))
        X = np.concatenate([X, curved], axis=3)
        bounds += [0.0] * len(bends)
    # The lateness counts from zero, not from the model that the rows were posed about.
    y = rows.y + about.lateness_s * rows.limb[..., 3]
    return X, y, rows.spectrum, np.array(bounds)


def _next(made: Contest, kind: Kind, number: int) -> tuple[Model, FloatArray]:
    """A kind and delay as a model to pose the rows about, and the noise that it leaves."""
    fit = made.fits[kind]
    values = fit.values[number]
    extra = list(values[3:])
    lateness = extra.pop(0) if kind.late_angle else 0.0
    answer = np.zeros(2)
    for which in range(kind.answers):
        answer[which] = extra.pop(0)
    bends = np.zeros(len(BENDS))
    bends[list(made.bends)] = extra
    limb = np.maximum(values[:3], _SHRUNK * made.about.limb)
    delay = float(made.delays_s[number if kind.answers else 0])
    model = Model(limb, answer, delay, float(lateness), bends)
    return model, made.reference + fit.eta[number]
