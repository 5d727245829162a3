"""A mode inside the limb, as of a free elbow, under random perturbations.

At once the limb answers with ``K + S n n^T``, at rest with K, between them (w natural frequency, z
damping, see `hand.still.doubts.inner`) with

    K + S n n^T g(s),      g(s) = (s^2 + 2 z w s) / (s^2 + 2 z w s + w^2).

For one w and n that is one more column of the impedance equation, linear in S; over many of them
the answer is a mean, as for returning disturbances.
"""

from __future__ import annotations

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.estimates import ImpedanceEstimate
from armimpedance.hand.random.equations import Equations, with_kernel
from armimpedance.hand.random.explained import Explained
from armimpedance.hand.random.lines import Complex, Lines
from armimpedance.hand.still import (
    INNER_DAMPING,
    INNER_DIRECTIONS,
    INNER_HZ,
    Elbow,
    averaged_inner,
    half_sphere,
    with_inner,
)


def allow_for_inner(
    one: ImpedanceEstimate,
    lines: Lines,
    explained: Explained,
    weight: Complex,
    elbow: Elbow | None,
) -> ImpedanceEstimate:
    """The estimate with an inner mode taken off, as likely as it is, and in its intervals.

    Parameters
    ----------
    one : ImpedanceEstimate
        Of second order.
    lines : Lines
    explained : Explained
    weight : (L, d, d) complex
        Inverse of the noise's spectrum.
    elbow : {"free", None}
    """
    d = one.k
    scale = float(np.trace(one.stiffness)) / d
    found: dict[str, tuple[float, float, float]] = {}
    shifts: dict[str, FloatArray] = {}
    for hz in INNER_HZ:
        equations = with_kernel(lines, explained, weight, _kernel(lines.s, hz))
        for i, n in enumerate(half_sphere(INNER_DIRECTIONS)):
            name = f"inner {hz} {i}"
            size, error, shifts[name] = _sized(equations, _along(n, scale, d), d)
            found[name] = (size, error, 1.0)
    return with_inner(one, averaged_inner(found, shifts, elbow), correct=True)


def _kernel(s: Complex, hz: float) -> Complex:
    """g(s) of one natural frequency."""
    w = 2 * np.pi * hz
    late = s**2 + 2 * INNER_DAMPING * w * s
    return np.asarray(late / (late + w**2))


def _sized(equations: Equations, D: FloatArray, d: int) -> tuple[float, float, FloatArray]:
    """S with its standard error, and by how much M, B, K (3 d^2,) are wrong for one unit of it."""
    A, b = D.T @ equations.A[:-1, :-1] @ D, D.T @ equations.b[:-1]
    meat = D.T @ equations.meat[:-1, :-1] @ D
    unit = 1 / np.sqrt(np.diag(meat))
    inverse = np.linalg.inv(A * unit[:, None] * unit) * unit[:, None] * unit
    error = float(np.sqrt((inverse @ meat @ inverse.T)[-1, -1]))
    # M, B, K (S) = A_11^-1 (b_1 - A_12 S): the last column of the inverse, by its corner
    shift = -inverse[:-1, -1] / inverse[-1, -1]
    return float((inverse @ b)[-1]), error, shift[_by_matrix(d)]


def _along(n: FloatArray, scale: float, d: int) -> FloatArray:
    """From rows of [M B K] and S to rows of [M B K G], G = scale S n n^T."""
    rows = np.arange(4 * d * d).reshape(d, 4, d)
    D = np.zeros((4 * d * d, 3 * d * d + 1))
    D[rows[:, :3].ravel(), np.arange(3 * d * d)] = 1.0
    D[rows[:, 3].ravel(), -1] = scale * np.outer(n, n).ravel()
    return D


def _by_matrix(d: int) -> np.ndarray:
    """Where the elements of M, then B, then K stand in rows of [M B K]."""
    return np.arange(3 * d * d).reshape(d, 3, d).transpose(1, 0, 2).ravel()
