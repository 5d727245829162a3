"""Linear least squares in the band, for models other than the joint of second order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.joint.elbow.stationary.band import Band, Complex


@dataclass(frozen=True)
class LeastSquares:
    """Parameters (p,) of weighed columns, and the squares that they leave."""

    parameters: FloatArray
    squares: float


def least_squares(
    band: Band, columns: Sequence[Complex], weights: Sequence[FloatArray]
) -> LeastSquares:
    """Fit all trials together, the ends' polynomials taken off.

    Parameters
    ----------
    band : Band
    columns : one (n, p + 1) of each trial
        The last column is the one to be explained.
    weights : one (n,) of each trial
    """
    trials = zip(band.trials, columns, weights, strict=True)
    table = np.concatenate([bins.free(w, c) for bins, c, w in trials])
    X, y = table[:, :-1], table[:, -1]
    scale = np.linalg.norm(X, axis=0)
    scale = np.where(scale > 0, scale, 1.0)
    # X (n, p) parameters (p,) = y (n,)
    parameters = np.linalg.lstsq(X / scale, y, rcond=None)[0] / scale
    return LeastSquares(parameters, float(((y - X @ parameters) ** 2).sum()))
