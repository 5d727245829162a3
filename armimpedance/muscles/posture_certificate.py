"""Where a matrix over posture is positive definite: what was looked at, and what is proved."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.errors import InputError
from armimpedance.muscles.joint_rows import matrix
from armimpedance.records import FloatArray, IntArray, frozen_array

#: Postures per joint at which eigenvalues are looked at.
GRID = 61


@dataclass(frozen=True)
class Gram:
    """One positive semidefinite block Q of ``K = sum_b m_b(u) B_b(u)^T Q_b B_b(u)``.

    ``B_b = blockdiag(v_s, v_e)``, columns of monomials of the scaled angles.

    Attributes
    ----------
    multiplier : str
        m: "1", or on the box "1 - s^2", "1 - e^2".
    shoulder, elbow : (n, 2), (m, 2) int
        Exponents of the monomials v_s and v_e.
    Q : (n + m, n + m)
        Symmetric, eigenvalues >= 0 up to rounding; in the unit of the matrix.
    """

    multiplier: str
    shoulder: IntArray
    elbow: IntArray
    Q: FloatArray

    def __post_init__(self) -> None:
        put = object.__setattr__
        for name in ("shoulder", "elbow"):
            put(self, name, frozen_array(getattr(self, name), name, (None, 2), np.int64))
        size = len(self.shoulder) + len(self.elbow)
        put(self, "Q", frozen_array(self.Q, "Q", (size, size)))
        if self.multiplier not in MULTIPLIERS:
            raise InputError(
                f"a Gram matrix with multiplier {self.multiplier!r}",
                expected=", ".join(MULTIPLIERS),
            )


#: Multiplier -> its coefficients over 1, s^2, e^2; each is nonnegative on the box.
MULTIPLIERS = {"1": (1, 0, 0), "1 - s^2": (1, -1, 0), "1 - e^2": (1, 0, -1)}


@dataclass(frozen=True)
class Certificate:
    """How positive definite a matrix over posture is.

    Attributes
    ----------
    promise : str
        Where it cannot have a negative eigenvalue: "nowhere proved", "everywhere" or
        "on the workspace".
    smallest_eigenvalue : float
        The smallest one found on a grid over the workspace, in the unit of the matrix.
    at : (2,)
        Where, joint angles in rad.
    grams : tuple of Gram
        The proof: their sum is the matrix, term by term.
    """

    promise: str
    smallest_eigenvalue: float
    at: FloatArray
    grams: tuple[Gram, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "at", frozen_array(self.at, "at", (2,)))


def smallest_eigenvalues(triples: ArrayLike) -> FloatArray:
    """Smallest eigenvalues (...,) of symmetric matrices given as ``ss, se, ee`` (..., 3)."""
    return np.asarray(np.linalg.eigvalsh(matrix(triples))[..., 0])
