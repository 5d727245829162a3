"""What the analyses of one joint say: I, B and K at an operating point, or over time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, Final

import numpy as np

from armimpedance.arrays import FloatArray, IntArray, frozen_array
from armimpedance.errors import RecordError
from armimpedance.regression import FitSummary, NamedParameter, t_factor

#: Names and units of the three parameters of (3), in this order everywhere.
NAMES: Final = ("I", "B", "K")
UNITS: Final = ("kg m^2", "Nm s/rad", "Nm/rad")


@dataclass(frozen=True)
class ChannelSnr:
    """Signal to noise of the raw channels, dB of power over the whole band; None = cannot be told.

    Attributes
    ----------
    torque_db, angle_db : float or None
    """

    torque_db: float | None
    angle_db: float | None


@dataclass(frozen=True)
class Whiteness:
    """Are the residuals white? What a model left behind shows here, and what a filter put in.

    Attributes
    ----------
    statistic, p : float
        Ljung-Box over `lags` lags, and the probability of one as large from white residuals.
    lags : int
    largest_correlation : float
        Of all lags but zero.
    """

    statistic: float
    p: float
    lags: int
    largest_correlation: float


@dataclass(frozen=True)
class ElbowFit:
    """I, B and K of one joint.

    Attributes
    ----------
    summary : FitSummary
        What FIT.json holds; parameters `NAMES`.
    covariance : (3, 3)
        Robust, of I, B, K.
    snr : ChannelSnr
    whiteness : Whiteness
    preparation : tuple of str
        Filter, decimation and band: what was chosen, and why, one sentence each.
    details : mapping
        What a method adds: its discrete model, the orders that were compared.
    """

    summary: FitSummary
    covariance: FloatArray
    snr: ChannelSnr
    whiteness: Whiteness
    preparation: tuple[str, ...] = ()
    details: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        put = object.__setattr__
        if tuple(p.name for p in self.summary.parameters) != NAMES:
            raise RecordError("the parameters of a joint", expected=", ".join(NAMES))
        put(self, "covariance", frozen_array(self.covariance, "covariance", (3, 3)))
        put(self, "preparation", tuple(self.preparation))
        put(self, "details", MappingProxyType(dict(self.details)))

    def _value(self, name: str) -> NamedParameter:
        return self.summary.parameters[NAMES.index(name)]

    @property
    def inertia(self) -> NamedParameter:
        """I, kg m^2."""
        return self._value("I")

    @property
    def viscosity(self) -> NamedParameter:
        """B, Nm s/rad."""
        return self._value("B")

    @property
    def stiffness(self) -> NamedParameter:
        """K, Nm/rad."""
        return self._value("K")

    @property
    def values(self) -> FloatArray:
        """I, B, K, (3,)."""
        return np.array([p.value for p in self.summary.parameters])

    @property
    def interval(self) -> FloatArray:
        """95 % limits of I, B, K, (3, 2)."""
        return np.array([p.ci95 for p in self.summary.parameters])


@dataclass(frozen=True)
class VaryingImpedance:
    """I constant, B and K over time, with bands.

    Samples of T trials, one trial after another; L points in all.

    Attributes
    ----------
    method : str
    trials : (T,) tuple of str
    offsets : (T + 1,) int
        Points of trial t are ``offsets[t]:offsets[t + 1]``.
    time_s : (L,)
        From each trial's first sample.
    B, K : (L,)
    sd_B, sd_K : (L,)
        Standard errors; the band is pointwise.
    inertia : NamedParameter
    dof : float
        Of the t distribution for the bands; inf = normal.
    snr : ChannelSnr
    preparation, warnings : tuple of str
    details : mapping
        What a method adds: noise level chosen, knots, coefficients of a law.
    """

    method: str
    trials: tuple[str, ...]
    offsets: IntArray
    time_s: FloatArray
    B: FloatArray
    K: FloatArray
    sd_B: FloatArray
    sd_K: FloatArray
    inertia: NamedParameter
    snr: ChannelSnr
    dof: float = float("inf")
    preparation: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    details: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "trials", tuple(self.trials))
        put(
            self,
            "offsets",
            frozen_array(self.offsets, "offsets", (len(self.trials) + 1,), np.int64),
        )
        put(self, "time_s", frozen_array(self.time_s, "time_s", (int(self.offsets[-1]),)))
        for name in ("B", "K", "sd_B", "sd_K"):
            put(self, name, frozen_array(getattr(self, name), name, self.time_s.shape))
        put(self, "preparation", tuple(self.preparation))
        put(self, "warnings", tuple(self.warnings))
        put(self, "details", MappingProxyType(dict(self.details)))

    def points_of(self, row: int) -> slice:
        """The points of trial `row`, counted from 0."""
        return slice(int(self.offsets[row]), int(self.offsets[row + 1]))

    def band(self, name: str, level: float = 0.95) -> FloatArray:
        """Pointwise limits of B or K, (L, 2)."""
        value, sd = getattr(self, name), getattr(self, f"sd_{name}")
        half = t_factor(self.dof, level) * sd
        return np.stack([value - half, value + half], axis=-1)
