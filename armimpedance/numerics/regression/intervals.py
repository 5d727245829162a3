"""Two-sided intervals by the t distribution."""

from __future__ import annotations

import numpy as np
from scipy.special import ndtri, stdtrit

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError


def t_factor(dof: float, level: float = 0.95) -> float:
    """Half-width of a two-sided interval in standard errors; dof inf = normal.

    Parameters
    ----------
    dof : float
        Degrees of freedom; inf = normal.
    level : float
        Confidence level, 0 to 1.

    Returns
    -------
    float
        Quantile of the t distribution: the half-width over the standard error.

    Raises
    ------
    InputError
        The level does not lie between 0 and 1.
    """
    if not 0 < level < 1:
        raise InputError(f"an interval of level {level}", expected="between 0 and 1")
    upper = 0.5 + level / 2
    return float(ndtri(upper) if np.isinf(dof) else stdtrit(dof, upper))


def t_interval(values: FloatArray, sd: FloatArray, dof: float, level: float = 0.95) -> FloatArray:
    """Limits ``values -+ t sd`` (m, 2) of a two-sided interval; dof inf = normal.

    Parameters
    ----------
    values, sd : (m,)
    dof : float
        Degrees of freedom; inf = normal.
    level : float
        Confidence level, 0 to 1.

    Returns
    -------
    (m, 2) array
        Lower and upper limit of each value, in the values' unit.

    Raises
    ------
    InputError
        The level does not lie between 0 and 1.
    """
    half = t_factor(dof, level) * sd
    return np.stack([values - half, values + half], axis=-1)
