"""Symmetry of the inertia: a gain of one axis of the force relative to the others breaks it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.special import stdtrit

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import AXES
from armimpedance.core.findings import Finding
from armimpedance.hand.still.doubts.model import Model

# The inertia is symmetric by physics, whatever the person does.
#
# A gain ``1 + k`` of the force's axis i beside the others makes ``M_ij = (1 + k) M_ji``; axes that
# are turned do much the same. One record does not show which axis is right.

#: Significance level of a gain, and the smallest gain that is reported.
LEVEL_OF_SYMMETRY: Final = 0.0015
LEAST_GAIN: Final = 0.02
#: The gain is not judged if only one larger than this could have been detected.
LARGEST_GAIN: Final = 0.5


@dataclass(frozen=True)
class Gain:
    """Gain of an axis relative to the others, less 1: k, with its standard error."""

    axis: int
    size: float
    error: float
    dof: float

    @property
    def limit(self) -> float:
        """Detection limit of k."""
        return limit_of_gain(self.error, self.dof)


def limit_of_gain(error: float, dof: float) -> float:
    """Detection limit of a gain less 1, given its standard error."""
    return float(stdtrit(dof, 1 - LEVEL_OF_SYMMETRY / 2)) * error


def gain_of(models: Sequence[Model]) -> Gain | None:
    """Gain of the axis that differs most from the others, over all conditions, or None."""
    d = models[0].equation.axes
    if d == 1:
        return None
    gains = []
    for axis in range(d):
        by_condition = np.array([_gain(model, axis) for model in models])
        weight = by_condition[:, 1] ** -2
        size, error = float(weight @ by_condition[:, 0] / weight.sum()), float(weight.sum() ** -0.5)
        # weights from few trials are rough: the dof are no more than those of one condition
        gains.append(Gain(axis, size, error, float(by_condition[:, 2].min())))
    return max(gains, key=lambda gain: abs(gain.size) / gain.error)


def _gain(model: Model, axis: int) -> tuple[float, float, float]:
    """k of one axis, its standard error and degrees of freedom, from one condition's M."""
    size, error = gain_in(model.parameters, model.covariance, axis)
    return size, error, model.equation.trials - 1


def gain_in(parameters: FloatArray, covariance: FloatArray, axis: int) -> tuple[float, float]:
    """k of one axis and its standard error, from M in the parameters (3 d^2,)."""
    d = round((len(parameters) / 3) ** 0.5)
    M = parameters[: d * d].reshape(d, d)
    others = [j for j in range(d) if j != axis]
    pick = np.zeros((d - 1, d * d))
    for row, j in enumerate(others):
        pick[row, axis * d + j], pick[row, j * d + axis] = 1.0, -1.0
    s = np.array([(M[axis, j] + M[j, axis]) / 2 for j in others])
    # M_ij - M_ji = k M_ij: (d - 1,) = (d - 1,) k, weighted by its covariance
    weight = np.linalg.inv(pick @ covariance[: d * d, : d * d] @ pick.T)
    precision = max(float(s @ weight @ s), 1e-300)
    return float(s @ weight @ pick @ M.ravel()) / precision, precision**-0.5


def check_symmetry(models: Sequence[Model]) -> tuple[Finding, ...]:
    """The finding "gain"; empty with one axis."""
    gain = gain_of(models)
    if gain is None:
        return ()
    if gain.limit > LARGEST_GAIN:
        text = "coupling between the axes is too small to hold their gains against each other"
        return (Finding("gain", "ok", text),)
    smallest = f"{100 * max(gain.limit, LEAST_GAIN):.2g} %"
    if abs(gain.size) <= max(gain.limit, LEAST_GAIN):
        return (Finding("gain", "ok", "inertia is symmetric: all axes have one gain", smallest),)
    text = (
        f"inertia is not symmetric: the force along {AXES[gain.axis]} is {100 * gain.size:+.0f} % "
        f"(sd {100 * gain.error:.0f}) beside the other axes', or its axes are turned; hang a known "
        "weight along each axis"
    )
    return (Finding("gain", "warning", text, smallest),)


def rows_of(parameters: FloatArray, axis: int) -> FloatArray:
    """Change of M, B and K (3 d^2,) for a gain that is too large by one along an axis."""
    d = round((len(parameters) / 3) ** 0.5)
    return np.asarray(parameters.reshape(3, d, d) * (np.arange(d) == axis)[:, None]).ravel()
