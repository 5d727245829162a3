"""How well a model of joint impedance fits, element by element, and what that is worth.

The source's R and E (Tsuji 1997, Tables 1 and 2) rise and fall with the number of coefficients
whatever the data are: beside them stand the R that pure noise would give (null R) and the R of
predictions of rows that the fit has not seen (leave-one-out R).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray

#: Below this part of their size, predictions that differ are the same number rounded.
_CONSTANT = 1e-9


@dataclass(frozen=True)
class ElementQuality:
    """One element of K or B.

    Attributes
    ----------
    element : str
        ``K_ss``, ``K_se``, ``K_es``, ``K_ee``, or the same of B.
    r : float
        Correlation between measured and fitted values; 0 where the fit is a constant.
    e : float
        Sum of squared errors, in the element's unit squared.
    adjusted_r2 : float
        ``1 - (E/(P - p)) / (E_0/(P - 1))``; nan with no rows to spare.
    leave_one_out_r : float
        Correlation between measured values and predictions without their own row.
    null_r : float
        R that the same fit gives on rows whose order was shuffled, on average.
    """

    element: str
    r: float
    e: float
    adjusted_r2: float
    leave_one_out_r: float
    null_r: float


def correlation(measured: ArrayLike, predicted: ArrayLike) -> float:
    """Correlation of two vectors (P,); 0 where one of them is constant.

    Parameters
    ----------
    measured, predicted : (P,)

    Returns
    -------
    float
    """
    return float(correlations(np.atleast_2d(measured), np.atleast_2d(predicted))[0])


def correlations(measured: ArrayLike, predicted: ArrayLike) -> FloatArray:
    """Correlation of every row of one table (n, P) with that of another, (n,); 0 if constant."""
    x, y = np.asarray(measured, dtype=float), np.asarray(predicted, dtype=float)
    dx, dy = x - x.mean(axis=1, keepdims=True), y - y.mean(axis=1, keepdims=True)
    size_x, size_y = np.linalg.norm(dx, axis=1), np.linalg.norm(dy, axis=1)
    varies = (size_x > _CONSTANT * np.linalg.norm(x, axis=1)) & (
        size_y > _CONSTANT * np.linalg.norm(y, axis=1)
    )
    size = np.where(varies, size_x * size_y, 1.0)
    return np.asarray(np.where(varies, (dx * dy).sum(axis=1) / size, 0.0))


def explained(measured: FloatArray, fitted: FloatArray) -> tuple[float, float]:
    """R^2 and variance accounted for over all elements together, of values (P, e).

    ``1 - |error|^2 / |values about their means|^2``; the second takes the mean error off too.
    Neither exists where nothing varies.
    """
    error, varying = measured - fitted, measured - measured.mean(axis=0)
    total = float((varying**2).sum())
    about = error - error.mean(axis=0)
    if not total:  # one row has nothing to explain
        return float("nan"), float("nan")
    return 1 - float((error**2).sum()) / total, 1 - float((about**2).sum()) / total


def element_quality(
    element: str,
    measured: ArrayLike,
    fitted: ArrayLike,
    *,
    held_out: ArrayLike | None,
    null_r: float,
    coefficients: float,
) -> ElementQuality:
    """Judge one element: measured, fitted, and predicted without the own row, each (P,).

    Parameters
    ----------
    element : str
    held_out : (P,) or None
        None where rows cannot be left out.
    null_r : float
    coefficients : float
        Coefficients p that the fit spent on this element.
    """
    y, fit = np.asarray(measured, dtype=float), np.asarray(fitted, dtype=float)
    e, e0 = float(((y - fit) ** 2).sum()), float(((y - y.mean()) ** 2).sum())
    spare = len(y) - coefficients
    adjusted = 1 - (e / spare) / (e0 / (len(y) - 1)) if spare > 0 and e0 > 0 else float("nan")
    return ElementQuality(
        element=element,
        r=correlation(y, fit),
        e=e,
        adjusted_r2=adjusted,
        leave_one_out_r=float("nan") if held_out is None else correlation(y, held_out),
        null_r=null_r,
    )
