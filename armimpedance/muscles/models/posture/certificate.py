"""Monomials of the joint angles, and where a matrix over posture is positive definite.

A matrix polynomial that can be written as ``K(u) = sum_b m_b(u) B_b(u)^T Q_b B_b(u)`` with Gram
matrices Q_b >= 0 is positive semidefinite wherever all multipliers m_b are nonnegative.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray, FrozenRecord, IntArray
from armimpedance.core.errors import InputError
from armimpedance.muscles.models.packed import matrix

# The monomials of the two joint angles that moment arms and joint impedance are made of.

#: Above this order a polynomial has more coefficients (91) than an experiment has postures.
MAX_ORDER = 6

_SHORT = ("s", "e")


def checked_order(order: object) -> int:
    """The order L of moment arms.

    Raises InputError: not a whole number from 0 to `MAX_ORDER`.
    """
    whole = isinstance(order, int | np.integer) and not isinstance(order, bool)
    if not whole or not 0 <= int(order) <= MAX_ORDER:  # type: ignore[call-overload]
        raise InputError(f"moment arms of order {order}", expected=f"0 to {MAX_ORDER}")
    return int(order)  # type: ignore[call-overload]


def exponents(degree: int) -> IntArray:
    """Exponents (terms, 2) of all monomials up to a total degree, the lowest degree first.

    (degree + 1)(degree + 2)/2 terms: 1, 6, 15 for 2L = 0, 2, 4.
    """
    both = [(d - i, i) for d in range(degree + 1) for i in range(d + 1)]
    return np.array(both, dtype=np.int64)


def monomials(scaled: ArrayLike, powers: IntArray) -> FloatArray:
    """Values (..., terms) of ``u_s^i u_e^j`` at scaled angles (..., 2)."""
    u = np.asarray(scaled, dtype=float)
    highest = int(powers.max(initial=0))
    # (..., 2, highest + 1): by repeated products, exact where a power is 0 or 1
    ladder = np.ones((*u.shape, highest + 1))
    for k in range(1, highest + 1):
        ladder[..., k] = ladder[..., k - 1] * u
    return np.asarray(ladder[..., 0, powers[:, 0]] * ladder[..., 1, powers[:, 1]])


def term_names(powers: IntArray) -> tuple[str, ...]:
    """Names of the monomials: ``1, s, e, s^2, s e, e^2``; s and e are the scaled angles."""
    return tuple(_term_name(row) for row in powers)


def _term_name(row: IntArray) -> str:
    parts = [
        name if power == 1 else f"{name}^{power}"
        for name, power in zip(_SHORT, row, strict=True)
        if power
    ]
    return " ".join(parts) or "1"


#: Postures per joint at which eigenvalues are looked at.
GRID = 61

#: Multiplier -> its coefficients over 1, s^2, e^2. The latter two are nonnegative on the box.
MULTIPLIERS = {"1": (1, 0, 0), "1 - s^2": (1, -1, 0), "1 - e^2": (1, 0, -1)}

#: Coefficients may differ from those of their proof by this part of the largest: rounding.
_ROUNDING = 1e-9

_SHIFTS = np.array([[0, 0], [2, 0], [0, 2]])


@dataclass(frozen=True)
class GramShape(FrozenRecord):
    """One block of a sum of squares: ``m(u) B(u)^T Q B(u)``, ``B = blockdiag(v_s, v_e)``.

    `multiplier`: m: "1", or on the box "1 - s^2", "1 - e^2".
    `shoulder`, `elbow` (n, 2), (m, 2) int: exponents of the monomials v_s and v_e: what moment arms
    are polynomials of.
    """

    multiplier: str
    shoulder: Annotated[IntArray, "n 2"]
    elbow: Annotated[IntArray, "m 2"]

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.multiplier not in MULTIPLIERS:
            raise InputError(
                f"a Gram matrix with multiplier {self.multiplier!r}",
                expected=", ".join(MULTIPLIERS),
            )

    @property
    def size(self) -> int:
        """Rows of Q."""
        return len(self.shoulder) + len(self.elbow)


@dataclass(frozen=True)
class Gram(GramShape):
    """A block with its matrix.

    `Q` (n + m, n + m): symmetric, eigenvalues >= 0 up to rounding; in the unit of the matrix it
    proves.
    """

    Q: Annotated[FloatArray, "q q"]

    def __post_init__(self) -> None:
        super().__post_init__()
        Q = self.Q
        if len(Q) != self.size:
            raise InputError(f"Q of {len(Q)} rows", expected=f"{self.size}")
        size = np.abs(Q).max(initial=0.0)
        asymmetric = np.abs(Q - Q.T).max(initial=0.0) > _ROUNDING * size
        if asymmetric or np.linalg.eigvalsh(Q).min(initial=0.0) < -_ROUNDING * size:
            raise InputError("a Gram matrix that is not positive semidefinite proves nothing")


@dataclass(frozen=True)
class Certificate(FrozenRecord):
    """Certificate that a matrix over posture is positive definite.

    `smallest_eigenvalue`: the smallest one found on a grid over the workspace, in the unit of the
    matrix.
    `at` (2,): where, joint angles in rad.
    `grams`: the proof: their sum is the matrix, term by term (`proves`).
    """

    smallest_eigenvalue: float
    at: Annotated[FloatArray, "2"]
    grams: tuple[Gram, ...] = ()

    @property
    def promise(self) -> str:
        """Where a negative eigenvalue is impossible.

        "nowhere proved", "everywhere" or "on the workspace".
        """
        if not self.grams:
            return "nowhere proved"
        always = all(gram.multiplier == "1" for gram in self.grams)
        return "everywhere" if always else "on the workspace"


def smallest_eigenvalues(triples: ArrayLike) -> FloatArray:
    """Smallest eigenvalues (...,) of symmetric matrices given as ``ss, se, ee`` (..., 3)."""
    return np.asarray(np.linalg.eigvalsh(matrix(triples))[..., 0])


def coefficient_map(shape: GramShape, powers: IntArray) -> FloatArray:
    """Coefficients of ss, se, ee as linear functions of Q, (3, terms, size, size).

    Element ab is ``sum_ij T[ab, :, i, j] Q_ij``: every product of two monomials of moment arms,
    times the multiplier, is a monomial of the matrix. Symmetric in i, j.
    """
    place = {tuple(p): t for t, p in enumerate(powers.tolist())}
    monomial = np.concatenate([shape.shoulder, shape.elbow])
    joint = np.repeat([0, 1], [len(shape.shoulder), len(shape.elbow)])
    T = np.zeros((3, len(powers), shape.size, shape.size))
    for i in range(shape.size):
        for j in range(shape.size):
            # Q_ij and Q_ji of different joints are both in se, which is counted once
            share = 1.0 if joint[i] == joint[j] else 0.5
            for factor, shift in zip(MULTIPLIERS[shape.multiplier], _SHIFTS, strict=True):
                if factor:
                    term = place[tuple((monomial[i] + monomial[j] + shift).tolist())]
                    T[joint[i] + joint[j], term, i, j] += share * factor
    return T


def coefficients_of(grams: Sequence[Gram], order: int) -> FloatArray:
    """Coefficients (terms, 3) of ss, se, ee that Gram matrices add up to."""
    powers = exponents(2 * order)
    parts = [np.einsum("atij,ij->ta", coefficient_map(g, powers), g.Q) for g in grams]
    return np.asarray(np.sum(parts, axis=0))


def proves(grams: Sequence[Gram], coefficients: FloatArray, order: int) -> bool:
    """Return True if the Gram matrices add up to these coefficients (terms, 3)."""
    off = np.abs(coefficients_of(grams, order) - coefficients).max()
    return bool(off <= _ROUNDING * np.abs(coefficients).max(initial=0.0))
