"""Lagged columns of a difference equation, its model, and I, B, K of a fit to them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.joint.elbow.result import NAMES, UNITS
from armimpedance.joint.elbow.stationary.discrete import (
    DELAY,
    DiscreteModel,
    Structure,
    jacobian,
    to_continuous,
)
from armimpedance.joint.elbow.stationary.estimate import Estimate, estimate_of
from armimpedance.joint.elbow.stationary.preparation import Prepared
from armimpedance.joint.elbow.stationary.rows import Rows, Solved, ramp, solve_rows, without

#: b (nb,) = SHAPE (nb, columns) @ fitted.
SHAPE: Final = {"zoh": np.eye(2), "tustin": np.array([[1.0], [2.0], [1.0]])}
FREE: Final = {"zoh": np.eye(2), "tustin": np.eye(3)}


@dataclass(frozen=True)
class Lagged:
    """Rows of one trial before nuisance is taken off: y (S,) and its lagged columns X (S, p)."""

    X: FloatArray
    y: FloatArray


def lagged(
    angle: FloatArray, torque: FloatArray, structure: Structure, shape: FloatArray
) -> Lagged:
    """``y(t)`` and ``[-y(t-1), -y(t-2), u ...]`` for t from the third sample on.

    Parameters
    ----------
    angle, torque : (S,)
    structure : {"zoh", "tustin"}
    shape : (nb, columns)
        `SHAPE` or `FREE` of the structure.
    """
    now, one, two = angle[2:], angle[1:-1], angle[:-2]
    inputs = np.column_stack([torque[2:], torque[1:-1], torque[:-2]])[:, DELAY[structure] :]
    # U (S, columns) = [u(t-nk) u(t-nk-1) ...] (S, nb) shape (nb, columns)
    held = inputs @ shape
    return Lagged(np.column_stack([-one, -two, held]), now)


def model_of(
    parameters: FloatArray, rate_hz: float, structure: Structure, shape: FloatArray
) -> DiscreteModel:
    """The difference equation of fitted parameters."""
    return DiscreteModel(parameters[:2], shape @ parameters[2:], rate_hz, structure)


def solve_structure(prepared: Prepared, structure: Structure, *, free: bool = False) -> Estimate:
    """Least squares in one of the two structures, its b in their proportions or `free`.

    Raises
    ------
    EstimationError
        The fitted poles or gain are no joint's.
    NotIdentifiableError
        The record does not tell the coefficients apart.
    """
    shape = (FREE if free else SHAPE)[structure]
    rows = []
    for row in range(prepared.n_trials):
        inside = prepared.inside(row)
        table = lagged(prepared.angle[inside], prepared.torque[inside], structure, shape)
        X, y = without(ramp(len(table.y)), table.X, table.y)
        rows.append(Rows(X, X, y, len(y) / prepared.sample_rate_hz))
    names = ("a1", "a2", *(f"b{j + 1}" for j in range(shape.shape[1])))
    return _to_estimate(solve_rows(rows, names), prepared.sample_rate_hz, structure, shape)


def _to_estimate(
    solved: Solved, rate_hz: float, structure: Structure, shape: FloatArray
) -> Estimate:
    """I, B, K and their covariances by the delta method."""
    model = model_of(solved.parameters.values, rate_hz, structure, shape)
    # D (3, p) = d(I, B, K)/d(a, b) (3, 2 + nb) d(a, b)/d(fitted) (2 + nb, p)
    chain = np.zeros((2 + len(model.b), len(solved.parameters)))
    chain[:2, :2], chain[2:, 2:] = np.eye(2), shape
    D = jacobian(model) @ chain
    return estimate_of(solved.transformed(to_continuous(model), D, NAMES, UNITS), discrete=model)


def simulated(model: DiscreteModel, torque: FloatArray) -> FloatArray:
    """The angle (S,) that a torque (S,) makes, from rest."""
    from scipy.signal import lfilter

    return np.asarray(lfilter(model.numerator, model.denominator, torque))
