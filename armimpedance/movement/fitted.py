"""What a method finds at one phase of one condition."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from armimpedance.arrays import FloatArray, FrozenRecord
from armimpedance.conventions import Level
from armimpedance.estimates import ImpedanceEstimate, Quality
from armimpedance.movement.hand_level import instant_of
from armimpedance.movement.solve import Known
from armimpedance.movement.windows import PhaseWindows


@dataclass(frozen=True)
class PhaseFit(FrozenRecord):
    """M, B and K at one level in the middle of a window.

    Attributes
    ----------
    level : {"hand", "joint"}
    values : (12,)
        M, B, K row by row; the limb's own.
    covariance : (12, 12)
    dof : float
    condition : float
        Of the scaled normal equations.
    rank : int
    explained : float
        Share of the mean response to the pushes that the model describes.
    warnings : tuple of str
    provenance : tuple of str
    """

    level: Level
    values: Annotated[FloatArray, "12"]
    covariance: Annotated[FloatArray, "12 12"]
    dof: float
    condition: float
    rank: int
    explained: float
    warnings: tuple[str, ...] = ()
    provenance: tuple[str, ...] = ()


#: Windows of one phase, the level that is asked for, and what is known of the inertia -> the fit.
FitPhase = Callable[[PhaseWindows, Level, Known | None], PhaseFit]


@dataclass(frozen=True)
class Method:
    """An estimator of a moving hand's impedance.

    Attributes
    ----------
    assumes : str
        What must hold for it to be right, in one sentence.
    reference : str
    fit : callable
        `FitPhase`.
    levels : tuple of str
        At which levels it gives M, B and K.
    """

    assumes: str
    reference: str
    fit: FitPhase
    levels: tuple[Level, ...] = ("hand",)


def to_estimate(
    fit: PhaseFit, windows: PhaseWindows, method: str, keys: Mapping[str, Any]
) -> ImpedanceEstimate:
    """The fit as every other estimate of M, B and K stands."""
    at = instant_of(windows)
    M, B, K = fit.values.reshape(3, 2, 2)
    pushed = int(windows.pushed.sum())
    quality = Quality(
        n_trials=pushed,
        n_rows=pushed * 2 * len(windows.lag_s),
        multiple_correlation=float(np.sqrt(max(fit.explained, 0.0))),
        vaf=fit.explained,
        cond_raw=fit.condition,
        cond_scaled=fit.condition,
        rank=fit.rank,
        residual_sd=0.0,
    )
    lag = windows.lag_s[windows.middle]
    said = f"told for {1e3 * lag:.0f} ms after the push's onset, window {windows.lag_s[-1]:.3g} s"
    free = f"{int((~windows.pushed).sum())} free reaches"
    return ImpedanceEstimate(
        level=fit.level,
        method=method,
        inertia=M,
        viscosity=B,
        stiffness=K,
        covariance=fit.covariance,
        dof=fit.dof,
        quality=quality,
        keys=keys,
        position=at.hand + windows.shoulder_m,
        force=at.force,
        joint_angles=at.angle,
        shoulder_m=windows.shoulder_m,
        warnings=fit.warnings,
        provenance=(said, free, *windows.notes, *fit.provenance),
    )
