"""What a method finds at one phase of one condition."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.conventions import Level
from armimpedance.core.estimates import ImpedanceEstimate, Quality
from armimpedance.hand.reaching.hand_level import Instant, instant_of
from armimpedance.hand.reaching.solve import Known
from armimpedance.hand.reaching.windows import PhaseWindows


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
    throughout : bool
        Whether it takes pushes that go on throughout the reach.
    """

    assumes: str
    reference: str
    fit: FitPhase
    levels: tuple[Level, ...] = ("hand",)
    throughout: bool = False


def to_estimate(
    fit: PhaseFit, windows: PhaseWindows, method: str, keys: Mapping[str, Any]
) -> ImpedanceEstimate:
    """The fit of one phase as every other estimate of M, B and K stands."""
    lag = windows.lag_s[windows.middle]
    said = f"told for {1e3 * lag:.0f} ms after the push's onset, window {windows.lag_s[-1]:.3g} s"
    pushed = int(windows.pushed.sum())
    return estimate_at(
        replace(fit, provenance=(said, *said_of(windows), *fit.provenance)),
        instant_of(windows),
        windows.shoulder_m,
        (pushed, pushed * 2 * len(windows.lag_s)),
        method,
        keys,
    )


def said_of(windows: PhaseWindows) -> tuple[str, ...]:
    """What is told of the free reaches."""
    return (f"{int((~windows.pushed).sum())} free reaches", *windows.notes)


def estimate_at(
    fit: PhaseFit,
    at: Instant,
    shoulder_m: FloatArray,
    counts: tuple[int, int],
    method: str,
    keys: Mapping[str, Any],
) -> ImpedanceEstimate:
    """The fit at one instant; `counts` are pushed trials and rows."""
    M, B, K = fit.values.reshape(3, 2, 2)
    quality = Quality(
        n_trials=counts[0],
        n_rows=counts[1],
        multiple_correlation=float(np.sqrt(max(fit.explained, 0.0))),
        vaf=fit.explained,
        cond_raw=fit.condition,
        cond_scaled=fit.condition,
        rank=fit.rank,
        residual_sd=0.0,
    )
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
        position=at.hand + shoulder_m,
        force=at.force,
        joint_angles=at.angle,
        shoulder_m=shoulder_m,
        warnings=fit.warnings,
        provenance=fit.provenance,
    )
