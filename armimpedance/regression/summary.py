"""What every fit that is written to a file says of itself (FIT.json, MODEL.json)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armimpedance.errors import InputError
from armimpedance.regression.result import t_interval


@dataclass(frozen=True)
class NamedParameter:
    """One fitted number.

    Attributes
    ----------
    name, unit : str
    value, sd : float
        `sd` as the source would print it.
    sd_robust : float
        The one to trust: intervals are made of it.
    dof : float
        Of the t distribution for the interval; inf = normal.
    joint : int or None
        Counted from 1; None where it has no meaning.
    """

    name: str
    value: float
    sd: float
    sd_robust: float
    unit: str
    dof: float = float("inf")
    joint: int | None = None

    @property
    def ci95(self) -> tuple[float, float]:
        """95 % limits from `sd_robust`."""
        low, high = t_interval(np.array([self.value]), np.array([self.sd_robust]), self.dof)[0]
        return float(low), float(high)

    @property
    def relative_sd_percent(self) -> float:
        """``100 sd / |value|``; inf for a value of zero."""
        return 100 * self.sd / abs(self.value) if self.value else float("inf")

    @property
    def well_identified(self) -> bool:
        """Whether twice the relative standard error stays below 10 %."""
        return 2 * self.relative_sd_percent < 10


@dataclass(frozen=True)
class FitSummary:
    """Method, size, condition and parameters of a fit.

    Attributes
    ----------
    method : str
    n : int
        Rows of the regression.
    cond_raw, cond_scaled : float
    rank : int
    r2, vaf : float
    parameters : tuple of NamedParameter
    warnings : tuple of str
    """

    method: str
    n: int
    cond_raw: float
    cond_scaled: float
    rank: int
    r2: float
    vaf: float
    parameters: tuple[NamedParameter, ...]
    warnings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        names = [(p.name, p.joint) for p in self.parameters]
        if len(set(names)) != len(names):
            raise InputError("a fit has two parameters of one name")
