"""The points of an ellipse, as it is drawn."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray, frozen_array


def locus(matrix: ArrayLike, n: int = 200) -> FloatArray:
    """Closed curve of ``A u``, ``|u| = 1``, of the symmetric part, (n, 2): last point = first.

    Parameters
    ----------
    matrix : (2, 2)
    n : int
        Number of points.

    Returns
    -------
    (n, 2) array
        Points on the curve, in the unit of the matrix.
    """
    A = frozen_array(matrix, "matrix", (2, 2))
    angle = np.linspace(0, 2 * np.pi, n)
    # points (n, 2) = u (n, 2) A_s^T (2, 2)
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1) @ ((A + A.T) / 2)
