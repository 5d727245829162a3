"""Method `definite`: symmetric and positive semidefinite M, B and K.

The symmetric matrices without negative eigenvalues that are nearest to the solution theta_hat of
another method, in the metric of its information:

    minimise (theta - theta_hat)^T H (theta - theta_hat),   H = sum_t A_t,   M, B, K >= 0

With weighted equations H is the inverse covariance of theta_hat by its noise model. (The clustered
covariance would not do: with fewer trials than parameters it is singular.) Two axes are solved in
closed form (`hand.still.cones`); three get the symmetric fit, which is refused if it is not
positive semidefinite. M is the inertia as measured, with the mass of the handle.

Standard errors are those of the free coordinates at the solution: a matrix inside its cone has all
its symmetric elements, one on the surface, K = k v v^T, keeps k and the direction of v, and its
smallest eigenvalue is fixed at 0. The antisymmetric part is zero with a standard error of zero.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import MATRICES, Kind
from armimpedance.core.errors import EstimationError
from armimpedance.core.records import Window
from armimpedance.hand.still.cones import NearestMatrices, Place, nearest_semidefinite
from armimpedance.hand.still.methods import weighted
from armimpedance.hand.still.prepared import Chart, Method, Prepared
from armimpedance.numerics.regression import TrialEquations, solve_total

#: Eigenvalues of a symmetric fit of three axes below this part of the largest count as negative.
_ROUNDING = 1e-12


def within(free: Callable[[Window, Kind], Prepared]) -> Callable[[Window, Kind], Prepared]:
    """Build `prepare` of this method from that of another method."""

    def prepare(window: Window, kind: Kind) -> Prepared:
        """Equations of one group, and the coordinates that the constraint leaves free."""
        prepared = free(window, kind)
        return constrained(prepared, prepared.trial_equations(kind), window.axes)

    return prepare


def constrained(prepared: Prepared, equations: TrialEquations, axes: int) -> Prepared:
    """Constrain M, B, K to be symmetric and positive semidefinite.

    Raises EstimationError: three axes whose symmetric fit is not positive semidefinite, or only
    zero satisfies the constraint.
    """
    centred = _symmetric_information(equations)
    H, theta = centred.A.sum(axis=0), solve_total(centred)
    E = np.kron(np.eye(3), symmetric_basis(axes))
    Q = E.T @ H @ E
    u = np.linalg.solve(Q, E.T @ H @ theta)
    if axes <= 2:
        nearest = nearest_semidefinite(Q, u, axes)
    else:
        _require_semidefinite((E @ u).reshape(3, axes, axes))
        nearest = NearestMatrices(u, ("inside",) * 3)
    T = _tangent(nearest, axes)
    if not T.shape[1]:
        raise EstimationError("no positive semidefinite M, B and K but zero fits the force")
    names = list(MATRICES)
    singular = [
        name for name, place in zip(names, nearest.places, strict=True) if place != "inside"
    ]
    warnings = tuple(f"{name} held positive semidefinite: an eigenvalue is 0" for name in singular)
    bound = None
    if prepared.bound is not None:
        # T (T^T J T)^-1 T^T, J the information without the constraint
        bound = T @ np.linalg.solve(T.T @ np.linalg.solve(prepared.bound, T), T.T)
    return replace(
        prepared,
        equations=centred,
        # the solution itself lies in the tangent plane, which passes through zero
        chart=Chart(np.zeros(len(theta)), T),
        notes=(*prepared.notes, "M, B, K symmetric and positive semidefinite"),
        warnings=(*prepared.warnings, *warnings),
        bound=bound,
    )


def _symmetric_information(equations: TrialEquations) -> TrialEquations:
    """Equations with the same solution and the same scores there, every A_t symmetric."""
    theta = solve_total(equations)
    A = (equations.A + equations.A.transpose(0, 2, 1)) / 2
    return replace(equations, A=A, b=equations.b + (A - equations.A) @ theta)


def symmetric_basis(d: int) -> FloatArray:
    """Basis (d^2, d (d + 1) / 2) of symmetric matrices row by row; (m, x, y) for two axes."""
    if d == 2:
        return np.array([[1.0, 1, 0], [0, 0, 1], [0, 0, 1], [1, -1, 0]])
    columns = []
    for i in range(d):
        for j in range(i, d):
            element = np.zeros((d, d))
            element[i, j] = element[j, i] = 1.0
            columns.append(element.ravel())
    return np.column_stack(columns)


def _require_semidefinite(matrices: np.ndarray) -> None:
    for name, matrix in zip(MATRICES, matrices, strict=True):
        values = np.linalg.eigvalsh(matrix)
        if values[0] < -_ROUNDING * abs(values[-1]):
            raise EstimationError(
                f"the symmetric {name} of {len(matrix)} axes is not positive semidefinite "
                f"(smallest eigenvalue {values[0]:.3g}), and the closed form is for two axes"
            )


def _tangent(nearest: NearestMatrices, d: int) -> FloatArray:
    """Basis (3 d^2, r) of the changes that the constraint allows at the solution."""
    s = d * (d + 1) // 2
    columns: list[FloatArray] = []
    for i, place in enumerate(nearest.places):
        own = _tangent_of_one(nearest.u[s * i : s * i + s], place, d)
        padded = np.zeros((3 * d * d, own.shape[1]))
        padded[d * d * i : d * d * (i + 1)] = own
        columns.append(padded)
    return np.concatenate(columns, axis=1)


def _tangent_of_one(u: FloatArray, place: Place, d: int) -> FloatArray:
    if place == "inside":
        return symmetric_basis(d)
    if place == "apex":
        return np.zeros((d * d, 0))
    # K = k v v^T; first-order changes are those of k and of the direction of v
    angle = np.arctan2(u[2], u[1]) / 2
    v, w = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    turned = np.outer(v, w)
    return np.column_stack([np.outer(v, v).ravel(), (turned + turned.T).ravel()])


METHOD = Method(
    assumes="the limb is passive: M, B and K are symmetric without negative eigenvalues",
    reference="second-order cones, S. Boyd and L. Vandenberghe, Convex Optimization (2004)",
    prepare=within(weighted.prepare),
    differs="the limb is not passive, for example because of a reflex, or trials are too few",
)
