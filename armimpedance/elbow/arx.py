"""ARX as the source does it, on filtered and decimated samples: least squares in discrete time.

``y(t) = -a1 y(t-1) - a2 y(t-2) + b1 u(t-nk) + ... + e(t)``. Measured angles stand on both sides:
their noise biases the estimate unless a filter took it away first. For torque without steps the
bilinear structure holds with ``b = b1 (1, 2, 1)``, so that three numbers are fitted for three.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.elbow.band import Band
from armimpedance.elbow.discrete import DiscreteModel, Structure, jacobian, to_continuous
from armimpedance.elbow.estimate import Estimate, Rows, Solved, ramp, solve_rows, without
from armimpedance.elbow.preparation import Prepared
from armimpedance.records import FloatArray

#: What the fitted parameters are called.
COLUMNS: Final = {"zoh": ("a1", "a2", "b1", "b2"), "tustin": ("a1", "a2", "b1")}
#: b = SHAPE (nb, columns) @ fitted.
SHAPE: Final = {"zoh": np.eye(2), "tustin": np.array([[1.0], [2.0], [1.0]])}


@dataclass(frozen=True)
class Lagged:
    """Rows of one trial before nuisance is taken off: y (S,) and its lagged columns X (S, p)."""

    X: FloatArray
    y: FloatArray


def lagged(angle: FloatArray, torque: FloatArray, structure: Structure) -> Lagged:
    """``y(t)`` and ``[-y(t-1), -y(t-2), u ...]`` for t from the third sample on."""
    now, one, two = angle[2:], angle[1:-1], angle[:-2]
    if structure == "zoh":
        inputs = [torque[1:-1], torque[:-2]]
    else:
        inputs = [torque[2:] + 2 * torque[1:-1] + torque[:-2]]
    return Lagged(np.column_stack([-one, -two, *inputs]), now)


def model_of(parameters: FloatArray, rate_hz: float, structure: Structure) -> DiscreteModel:
    """The difference equation of fitted parameters."""
    return DiscreteModel(parameters[:2], SHAPE[structure] @ parameters[2:], rate_hz, structure)


def solve(prepared: Prepared, band: Band) -> Estimate:
    """Least squares, bilinear structure.

    Raises
    ------
    EstimationError
        The fitted poles or gain are no joint's.
    NotIdentifiableError
        The record does not tell the coefficients apart.
    """
    del band
    return solve_structure(prepared, "tustin")


def solve_structure(prepared: Prepared, structure: Structure) -> Estimate:
    """Least squares in one of the two structures.

    Raises
    ------
    EstimationError, NotIdentifiableError
        As `solve`.
    """
    rows = []
    for row in range(prepared.n_trials):
        inside = prepared.inside(row)
        table = lagged(prepared.angle[inside], prepared.torque[inside], structure)
        X, y = without(ramp(len(table.y)), table.X, table.y)
        rows.append(Rows(X, X, y, len(y) / prepared.sample_rate_hz))
    solved = solve_rows(rows, COLUMNS[structure])
    return to_estimate(solved, prepared.sample_rate_hz, structure)


def to_estimate(solved: Solved, rate_hz: float, structure: Structure) -> Estimate:
    """I, B, K and their covariances by the delta method."""
    model = model_of(solved.parameters, rate_hz, structure)
    # D (3, p) = dI,B,K/d(a, b) (3, 2 + nb) d(a, b)/d(fitted) (2 + nb, p)
    chain = np.zeros((2 + len(model.b), len(solved.parameters)))
    chain[:2, :2], chain[2:, 2:] = np.eye(2), SHAPE[structure]
    D = jacobian(model) @ chain
    return Estimate(
        to_continuous(model),
        D @ solved.covariance @ D.T,
        D @ solved.classical @ D.T,
        solved.dof,
        solved.n,
        solved.conditioning,
        {"discrete": model},
    )
