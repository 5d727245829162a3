"""What is said of a person's contribution: of a movement, of its samples, over time."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from armimpedance.arrays import BoolArray, FloatArray, frozen, frozen_array
from armimpedance.therapy.share.uncertainty import VarianceShares


@dataclass(frozen=True)
class Contribution:
    """A person's share in one movement; per cent of what the passive arm needs.

    Attributes
    ----------
    trial, condition, movement, axis_name : str
    n_samples : int
        That count: the axis moves.
    duration_s : float
        From onset to end.
    still_share : float
        Of the samples between, those that do not count.
    ratio_percent, ratio_sd : float
        (4) and its standard error; NaN where the denominator is exactly zero.
    ratio_ci95 : (2,)
    ratio_valid : bool
    ratio_all_percent : float
        (4) of all samples from onset to end.
    sum_ratio : float
        ``|sum tau_h| / sum |tau_h|``.
    projection_percent, projection_sd : float
    projection_ci95 : (2,)
    projection_valid : bool
    share_percent, share_sd : float
        The share of tau_h in tau_user beside any share of the robot's own inertia torque.
    share_ci95 : (2,)
    share_valid : bool
    inertia_percent : float
        That share of the robot's inertia torque; NaN where the robot does not accelerate.
    reference_percent, reference_sd : float or None
        (19); None where the arm has no reference of this movement.
    reference_valid : bool
    mean_support_Nm, mean_arm_Nm : float
        Of (18) and of tau_h.
    mean_reference_Nm : float or None
    lowering_share, saturated_share : float
        Of the samples: the passive arm drives the movement; the motor is at its limit.
    share_variance : VarianceShares
        What the uncertainty of `share_percent` is made of.
    notes : tuple of str
    """

    trial: str
    condition: str
    movement: str
    axis_name: str
    n_samples: int
    duration_s: float
    still_share: float
    ratio_percent: float
    ratio_sd: float
    ratio_ci95: FloatArray
    ratio_valid: bool
    ratio_all_percent: float
    sum_ratio: float
    projection_percent: float
    projection_sd: float
    projection_ci95: FloatArray
    projection_valid: bool
    share_percent: float
    share_sd: float
    share_ci95: FloatArray
    share_valid: bool
    inertia_percent: float
    reference_percent: float | None
    reference_sd: float | None
    reference_valid: bool
    mean_support_Nm: float
    mean_arm_Nm: float
    mean_reference_Nm: float | None
    lowering_share: float
    saturated_share: float
    share_variance: VarianceShares
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        # an interval about a denominator of zero is NaN, which frozen_array would refuse
        for name in ("ratio_ci95", "projection_ci95", "share_ci95"):
            object.__setattr__(self, name, frozen(np.array(getattr(self, name), dtype=float)))


@dataclass(frozen=True)
class SampleContribution:
    """(3) over a movement of S samples.

    Attributes
    ----------
    time_s, user, arm : (S,)
        s, Nm.
    counts : (S,) bool
        Whether the axis moves.
    percent, sd : (S,)
        NaN where tau_h is exactly zero.
    valid : (S,) bool
    """

    time_s: FloatArray
    user: FloatArray
    arm: FloatArray
    counts: BoolArray
    percent: FloatArray
    sd: FloatArray
    valid: BoolArray

    def __post_init__(self) -> None:
        _freeze(self, finite=("time_s", "user", "arm"))


@dataclass(frozen=True)
class RunningContribution:
    """The projection over the last `window_s` seconds, at each of S samples; for a display.

    Where the axis stands still it is that of the samples before; NaN once there are none left.

    Attributes
    ----------
    window_s : float
        Shorter at the movement's start.
    time_s, percent, sd : (S,)
    valid : (S,) bool
    """

    window_s: float
    time_s: FloatArray
    percent: FloatArray
    sd: FloatArray
    valid: BoolArray

    def __post_init__(self) -> None:
        _freeze(self, finite=("time_s",))


@dataclass(frozen=True)
class ContributionSoFar:
    """A movement's share or projection from its onset up to each of S samples.

    It ends at that of the whole movement. Where the axis stands still it does not change.

    Attributes
    ----------
    metric : str
        "share" or "projection".
    time_s, percent, sd : (S,)
        NaN before there is a denominator.
    valid : (S,) bool
        For a while already: what can just be told for a moment flickers.
    """

    metric: str
    time_s: FloatArray
    percent: FloatArray
    sd: FloatArray
    valid: BoolArray

    def __post_init__(self) -> None:
        _freeze(self, finite=("time_s",))


def _freeze(result: Any, finite: tuple[str, ...]) -> None:
    for field in fields(result):
        value = getattr(result, field.name)
        if field.name in finite:
            object.__setattr__(result, field.name, frozen_array(value, field.name, (None,)))
        elif isinstance(value, np.ndarray):
            object.__setattr__(result, field.name, frozen(value.copy()))
