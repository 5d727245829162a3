"""Lagged columns of a difference equation, its model, and I, B, K of a fit to them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.arrays import FloatArray
from armimpedance.elbow.stationary.discrete import (
    DELAY,
    DiscreteModel,
    Structure,
    jacobian,
    to_continuous,
)
from armimpedance.elbow.stationary.estimate import Estimate, Solved

#: b (nb,) = SHAPE (nb, columns) @ fitted.
SHAPE: Final = {"zoh": np.eye(2), "tustin": np.array([[1.0], [2.0], [1.0]])}
FREE: Final = {"zoh": np.eye(2), "tustin": np.eye(3)}


@dataclass(frozen=True)
class Lagged:
    """Rows of one trial before nuisance is taken off: y (S,) and its lagged columns X (S, p)."""

    X: FloatArray
    y: FloatArray


def column_names(shape: FloatArray) -> tuple[str, ...]:
    """Of the fitted parameters: a1, a2, b1, ..."""
    return ("a1", "a2", *(f"b{j + 1}" for j in range(shape.shape[1])))


def lagged(
    angle: FloatArray, torque: FloatArray, structure: Structure, shape: FloatArray | None = None
) -> Lagged:
    """``y(t)`` and ``[-y(t-1), -y(t-2), u ...]`` for t from the third sample on.

    Parameters
    ----------
    angle, torque : (S,)
    structure : {"zoh", "tustin"}
    shape : (nb, columns), optional
        `SHAPE` by default.
    """
    now, one, two = angle[2:], angle[1:-1], angle[:-2]
    inputs = np.column_stack([torque[2:], torque[1:-1], torque[:-2]])[:, DELAY[structure] :]
    # U (S, columns) = [u(t-nk) u(t-nk-1) ...] (S, nb) shape (nb, columns)
    held = inputs @ (SHAPE[structure] if shape is None else shape)
    return Lagged(np.column_stack([-one, -two, held]), now)


def model_of(
    parameters: FloatArray, rate_hz: float, structure: Structure, shape: FloatArray | None = None
) -> DiscreteModel:
    """The difference equation of fitted parameters."""
    b = (SHAPE[structure] if shape is None else shape) @ parameters[2:]
    return DiscreteModel(parameters[:2], b, rate_hz, structure)


def to_estimate(
    solved: Solved, rate_hz: float, structure: Structure, shape: FloatArray | None = None
) -> Estimate:
    """I, B, K and their covariances by the delta method."""
    shape = SHAPE[structure] if shape is None else shape
    model = model_of(solved.parameters, rate_hz, structure, shape)
    # D (3, p) = d(I, B, K)/d(a, b) (3, 2 + nb) d(a, b)/d(fitted) (2 + nb, p)
    chain = np.zeros((2 + len(model.b), len(solved.parameters)))
    chain[:2, :2], chain[2:, 2:] = np.eye(2), shape
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


def simulated(model: DiscreteModel, torque: FloatArray) -> FloatArray:
    """The angle (S,) that a torque (S,) makes, from rest."""
    from scipy.signal import lfilter

    return np.asarray(lfilter(model.numerator, model.denominator, torque))
