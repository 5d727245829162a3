"""What a time-varying method hands over, of which the result is made."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.findings import Finding
from armimpedance.joint.elbow.varying.autoregression import Autoregression
from armimpedance.joint.elbow.varying.data import VaryingData

#: Grid of the result where a method has none of its own, s.
EVERY_S: Final = 0.02


@dataclass(frozen=True, eq=False)
class EstimatedCourse:
    """B and K at L points of the trials, with what was chosen and warned of.

    Attributes
    ----------
    at : (L,) int
        Sample of each point, rising.
    B, K, sd_B, sd_K : (L,)
    inertia, sd_inertia : float
    notes, warnings : tuple of str
    details : mapping
    checks : tuple of Finding
    own : Autoregression or None
        The subject's own torque, where the method itself has chosen it.
    """

    at: IntArray
    B: FloatArray
    K: FloatArray
    sd_B: FloatArray
    sd_K: FloatArray
    inertia: float
    sd_inertia: float
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    details: Mapping[str, Any] = field(default_factory=dict)
    checks: tuple[Finding, ...] = ()
    own: Autoregression | None = None


def grid(data: VaryingData, every_s: float | None) -> IntArray:
    """Samples (L,) on the grid of the result, from each trial's first."""
    step = max(round((every_s or EVERY_S) * data.rate_hz), 1)
    pairs = zip(data.offsets[:-1], data.offsets[1:], strict=True)
    return np.concatenate([np.arange(a, b, step) for a, b in pairs])
