"""Coordinates of the parameters that a constraint leaves free.

A fit under constraints that are linear, or taken by their tangent at the solution, is an ordinary
one in fewer numbers: ``theta = origin + basis u``. Standard errors follow in u and are carried
back; a combination that the constraint fixes has a standard error of zero.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.numerics.regression import TrialEquations


@dataclass(frozen=True, eq=False)
class Chart(FrozenRecord):
    """``theta (n,) = origin (n,) + basis (n, r) u (r,)``.

    Attributes
    ----------
    origin : (n,)
    basis : (n, r)
        Columns that span the free directions; they are linearly independent.
    """

    origin: Annotated[FloatArray, "n"]
    basis: Annotated[FloatArray, "n r"]

    def restrict(self, equations: TrialEquations) -> TrialEquations:
        """The equations of every cluster for u, names ``u_1 …``."""
        T, r = self.basis, self.basis.shape[1]
        # T^T A_t T (r, r) u (r,) = T^T (b_t - A_t origin) (r,)
        A = T.T @ equations.A @ T
        b = (equations.b - equations.A @ self.origin) @ T
        return TrialEquations(A, b, tuple(f"u_{i + 1}" for i in range(r)), ("",) * r)

    def expand(self, free: FloatArray) -> FloatArray:
        """Parameters (..., n) of coordinates (..., r)."""
        return self.origin + free @ self.basis.T

    def expand_change(self, change: FloatArray) -> FloatArray:
        """Changes of the parameters (..., n) for changes of the coordinates (..., r)."""
        return change @ self.basis.T
