"""What the table of time-varying methods holds of each, and what it is given."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.joint.elbow.varying.beginning import Beginning
from armimpedance.joint.elbow.varying.estimated import EstimatedCourse
from armimpedance.numerics.signals import CUTOFF_HZ


@dataclass(frozen=True)
class VaryingOptions:
    """What methods take beside the samples.

    Attributes
    ----------
    window_s : float or None
        Length of a window; None: the method's own.
    every_s : float or None
        Grid of the result; None: the method's own.
    amplitude : (N, m)
        EMG amplitudes at the decimated rate, 0..1; no muscles where none are needed.
    amplitude_sd : (m,) or None
        Their standard errors.
    amplitude_cutoff_hz : float
        Edge of the low-pass that made them: their errors lie below it.
    tick : function
        To be called after each step that takes a while.
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

    Attributes
    ----------
    name : str
    description : str
        What it takes B and K for, in one line.
    needs : {"window", "amplitude", ""}
        What it takes beside the samples: a window's length, EMG amplitudes.
    reference : str
    identify : function
    """

    name: str
    description: str
    needs: Literal["window", "amplitude", ""]
    reference: str
    identify: Callable[[Beginning, VaryingOptions], EstimatedCourse]
