"""Joint stiffnesses of a redundant arm compatible with the hand's stiffness: a set, not a matrix.

All joint compliances C with ``J C J^T = K_e^-1`` give the same hand stiffness. In the basis of
J's row space and null space the row-space block of C is fixed and the others are free, so the
set is affine of dimension n(n+1)/2 - d(d+1)/2. Inverting by blocks, the stiffnesses are
``K_j + Gamma = J^T K_e J + R`` with R positive semidefinite of rank n - d: every element of the
diagonal is bounded below by that of ``J^T K_e J``, and nothing is bounded above. No optimisation
is needed for the bounds.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray, FrozenRecord, frozen_array
from armimpedance.core.errors import InputError
from armimpedance.limb.arm import require_full_rank


@dataclass(frozen=True)
class FeasibleJointStiffness(FrozenRecord):
    """All symmetric joint stiffnesses of a stable arm that give one hand stiffness.

    `jacobian` (d, n), `hand_stiffness` (d, d).
    `force_term` (n, n): Gamma of the hand's force; zero without force.
    `compliance` (n, n): one member's compliance ``(K_j + Gamma)^-1``, positive definite.
    `directions` (p, n, n): orthonormal symmetric directions in which the compliance is free.
    `lower_bound` (n, n): ``J^T K_e J - Gamma``: every member minus this is positive semidefinite of
    rank n - d.
    """

    jacobian: Annotated[FloatArray, "d n"]
    hand_stiffness: Annotated[FloatArray, "d d"]
    force_term: Annotated[FloatArray, "n n"]
    compliance: Annotated[FloatArray, "n n"]
    directions: Annotated[FloatArray, "p n n"]
    lower_bound: Annotated[FloatArray, "n n"]

    @property
    def dimension(self) -> int:
        """Number of free coefficients, n(n+1)/2 - d(d+1)/2."""
        return len(self.directions)

    def element_bounds(self, i: int, j: int) -> tuple[float, float]:
        """Open bounds of the element (i, j), counted from 0, over all members; inf if unbounded."""
        return (float(self.lower_bound[i, i]) if i == j else -np.inf), np.inf

    def member(self, coefficients: ArrayLike) -> FloatArray:
        """Joint stiffness (n, n) at these coefficients (p,) of `directions`.

        Raises InputError: wrong number of coefficients, or the compliance there is not positive
        definite.
        """
        coefficients = np.asarray(coefficients, dtype=float)
        if coefficients.shape != (self.dimension,):
            raise InputError(f"{coefficients.size} coefficients", expected=f"{self.dimension}")
        C = self.compliance + np.tensordot(coefficients, self.directions, axes=1)
        if not _positive_definite(C):
            raise InputError("these coefficients give a joint compliance that is not positive")
        return np.linalg.inv(C) - self.force_term

    def contains(self, joint_stiffness: ArrayLike, *, rtol: float = 1e-6) -> bool:
        """True if this symmetric K_j (n, n) is stable and gives the hand stiffness."""
        K = np.asarray(joint_stiffness, dtype=float) + self.force_term
        if not np.allclose(K, K.T, rtol=0, atol=rtol * np.abs(K).max()):
            return False
        if not _positive_definite(K):
            return False
        hand = np.linalg.inv(self.jacobian @ np.linalg.solve(K, self.jacobian.T))
        error = np.linalg.norm(hand - self.hand_stiffness)
        return bool(error <= rtol * np.linalg.norm(self.hand_stiffness))


def feasible_joint_stiffness(
    hand_stiffness: ArrayLike, jacobian: ArrayLike, *, force_term: ArrayLike | None = None
) -> FeasibleJointStiffness:
    """All joint stiffnesses with ``(J (K_j + Gamma)^-1 J^T)^-1 = K_e``.

    Parameters
    ----------
    hand_stiffness : (d, d)
        Symmetric positive definite, N/m.
    jacobian : (d, n)
        n >= d.
    force_term : (n, n), optional
        Gamma of the hand's force (`force_term`).

    Returns
    -------
    FeasibleJointStiffness

    Raises
    ------
    InputError
        K_e is not symmetric positive definite.
    NotIdentifiableError
        Singular posture or fewer joints than hand axes.
    """
    J = frozen_array(jacobian, "jacobian", (None, None))
    d, n = J.shape
    require_full_rank(J)
    K_e = frozen_array(hand_stiffness, "hand_stiffness", (d, d))
    if not np.allclose(K_e, K_e.T, rtol=1e-9, atol=0) or not _positive_definite(K_e):
        raise InputError("hand stiffness", expected="symmetric and positive definite")
    gamma = frozen_array(np.zeros((n, n)) if force_term is None else force_term, "Gamma", (n, n))
    rows, null = _row_and_null_space(J)
    pseudo_inverse = np.linalg.pinv(J)
    # C (n, n) = J^+ K_e^-1 J^+T on the row space, plus any positive compliance on the null space
    particular = pseudo_inverse @ np.linalg.inv(K_e) @ pseudo_inverse.T
    particular = particular + np.trace(particular) / d * null @ null.T
    return FeasibleJointStiffness(
        jacobian=J,
        hand_stiffness=K_e,
        force_term=gamma,
        compliance=particular,
        directions=_free_directions(rows, null),
        lower_bound=J.T @ K_e @ J - gamma,
    )


def _row_and_null_space(J: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Orthonormal bases of the row space (n, d) and the null space (n, n - d)."""
    V = np.linalg.svd(J)[2].T
    return V[:, : len(J)], V[:, len(J) :]


def _free_directions(rows: FloatArray, null: FloatArray) -> FloatArray:
    """Distinct matrices ``v w^T + w v^T`` of unit Frobenius norm, w in the null space, any v."""
    n = len(rows)
    basis = np.hstack([rows, null])
    pairs = [(i, j) for j in range(rows.shape[1], n) for i in range(j + 1)]
    outer = [np.outer(basis[:, i], basis[:, j]) for i, j in pairs]
    symmetric = [(product + product.T) / 2 for product in outer]
    return np.array([s / np.linalg.norm(s) for s in symmetric]).reshape(-1, n, n)


def _positive_definite(matrix: FloatArray) -> bool:
    eigenvalues = np.linalg.eigvalsh((matrix + matrix.T) / 2)
    return bool(eigenvalues[0] > 1e-12 * abs(eigenvalues[-1]))
