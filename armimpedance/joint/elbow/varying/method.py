"""Interface of the time-varying methods: their input, their result, and the record of a method."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final, Literal

import numpy as np

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.findings import Finding
from armimpedance.joint.elbow.varying.beginning import Beginning
from armimpedance.joint.elbow.varying.data import Autoregression, VaryingData
from armimpedance.numerics.signals import CUTOFF_HZ

# Result of a time-varying method, from which the final result is made.

#: Grid of the result if a method has none of its own, s.
EVERY_S: Final = 0.02


@dataclass(frozen=True, eq=False)
class EstimatedCourse:
    """B and K at L points of the trials, with notes and warnings.

    `B`, `K`, `sd_B`, `sd_K` (L,).
    `at` (L,) int: sample of each point, rising.
    `own`: the subject's own torque, if the method itself has chosen it.
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
    """Samples (L,) on the grid of the result, counted from each trial's first."""
    step = max(round((every_s or EVERY_S) * data.rate_hz), 1)
    pairs = zip(data.offsets[:-1], data.offsets[1:], strict=True)
    return np.concatenate([np.arange(a, b, step) for a, b in pairs])


@dataclass(frozen=True)
class VaryingOptions:
    """Options of the methods.

    `window_s`: length of a window; None: the method's own.
    `every_s`: grid of the result; None: the method's own.
    `amplitude` (N, m): EMG amplitudes at the decimated rate, 0..1; empty if they are not needed.
    `amplitude_sd` (m,) or None: their standard errors.
    `amplitude_cutoff_hz`: edge of the low-pass of the amplitudes; their errors lie below it.
    `tick`: is called after each long step.
    """

    window_s: float | None = None
    every_s: float | None = None
    amplitude: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    amplitude_sd: FloatArray | None = None
    amplitude_cutoff_hz: float = CUTOFF_HZ
    tick: Callable[[], None] = lambda: None


@dataclass(frozen=True)
class VaryingMethod:
    """A method for B(t) and K(t) with constant I.

    `description`: its model of B and K, in one line.
    `needs`: its input besides the samples: a window's length, or EMG amplitudes.
    """

    name: str
    description: str
    needs: Literal["window", "amplitude", ""]
    reference: str
    identify: Callable[[Beginning, VaryingOptions], EstimatedCourse]
