"""The muscles of a spatial arm with a free wrist: the published ones, in another person.

Lengths are those of the table that comes with the package, fitted to MyoSuite's arm, with each
angle counted as often as this person's muscle has it: some 10 % more or less, about the middle
posture.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from importlib.resources import files
from itertools import combinations_with_replacement
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from manipulandum_sim.hand import SimulatedSubject
from manipulandum_sim.space.muscles import MIDDLE_RAD, Muscles

#: Standard deviation of an angle's count from person to person.
APART: Final = 0.1
#: First number of the random key of a person.
WRIST_KEY: Final = 303
#: The middle posture, rad: as for a locked wrist, and the wrist straight.
STRAIGHT_RAD: Final = (*MIDDLE_RAD, 0.0, 0.0, 0.0)
_JOINTS: Final = len(STRAIGHT_RAD)
# Of 1 and the seven angles every product of two, and of three: all monomials up to that order.
_Factors = list[tuple[int, ...]]
_PAIRS: Final[_Factors] = list(combinations_with_replacement(range(_JOINTS + 1), 2))
_TRIPLES: Final[_Factors] = list(combinations_with_replacement(range(_JOINTS + 1), 3))


@dataclass(frozen=True)
class WristMuscles(Muscles):
    """Paths and mechanics of m muscles over seven joints.

    Attributes
    ----------
    names : (m,) tuple of str
    coefficients : (m, 120)
        Of the lengths (m), by the monomials of the angles from the middle posture.
    greatest, fibre : (m,)
        Greatest tension (N) and fibre length (m).
    """

    names: tuple[str, ...]
    coefficients: FloatArray
    greatest: FloatArray
    fibre: FloatArray

    @classmethod
    def of(cls, subject: SimulatedSubject) -> WristMuscles:
        """The muscles of a subject; the same each time."""
        terms = list(_terms())
        names = tuple(dict.fromkeys(term["muscle"] for term in terms))
        key = (WRIST_KEY, *subject.id.encode())
        rng = np.random.default_rng(np.random.SeedSequence(0, spawn_key=key))
        scale = np.maximum(1 + APART * rng.normal(size=(len(names), _JOINTS)), 0.5)
        # any points that determine a polynomial of this order do: it is the same polynomial
        v = rng.uniform(-1, 1, (3 * len(_TRIPLES), _JOINTS))
        lengths = np.zeros((len(v), len(names)))
        greatest, fibre = np.zeros((2, len(names)))
        for term in terms:
            i = names.index(term["muscle"])
            powers = [int(term[f"q_{j}_power"]) for j in range(1, _JOINTS + 1)]
            q = STRAIGHT_RAD + scale[i] * v
            lengths[:, i] += float(term["length_m"]) * np.prod(q**powers, axis=1)
            greatest[i], fibre[i] = float(term["max_tension_N"]), float(term["fibre_m"])
        coefficients = np.linalg.lstsq(_products(v, _TRIPLES), lengths)[0].T
        return cls(names, np.asarray(coefficients, float), subject.strength * greatest, fibre)

    def paths(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Lengths (N, m) up to a constant, and ``G = dL/dq`` (N, m, 7)."""
        v = q - np.array(STRAIGHT_RAD)
        length = _products(v, _TRIPLES) @ self.coefficients.T
        G = _products(v, _PAIRS) @ self._slopes.T
        return length, G.reshape(len(q), *self.greatest.shape, _JOINTS)

    @cached_property
    def _slopes(self) -> FloatArray:
        """Coefficients (m * 7, 36) of the moment arms, by the products of two."""
        slopes = np.zeros((len(self.greatest), _JOINTS, len(_PAIRS)))
        for term, triple in enumerate(_TRIPLES):
            for place, factor in enumerate(triple):
                if factor:
                    rest = _PAIRS.index((*triple[:place], *triple[place + 1 :]))
                    slopes[:, factor - 1, rest] += self.coefficients[:, term]
        return slopes.reshape(-1, len(_PAIRS))


def _terms() -> Iterator[dict[str, str]]:
    """The rows of the package's table."""
    place = files("armimpedance") / "limb" / "arm" / "muscles" / "myoarm.csv"
    with place.open(encoding="utf-8") as stream:
        yield from csv.DictReader(line for line in stream if not line.startswith("#"))


def _products(v: FloatArray, factors: _Factors) -> FloatArray:
    """Products (N, t) of factors among 1 and the angles v (N, 7)."""
    w = np.column_stack([np.ones(len(v)), v])
    return np.asarray(w[:, np.array(factors)].prod(axis=2))
