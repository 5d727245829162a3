"""Results for a person's contribution: of a movement, of its samples, over time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any, Final

from armimpedance.core.arrays import BoolArray, FloatArray, FrozenRecord
from armimpedance.core.described import Column, beside, cells
from armimpedance.core.json_text import finite
from armimpedance.joint.therapy.share.error_law import PARTS, VarianceShares


@dataclass(frozen=True)
class Metric(FrozenRecord):
    """One metric of a movement, per cent of the torque that the passive arm needs.

    `percent`, `sd`: the value and its standard error; NaN if the denominator is zero.
    `ci95` (2,): the limits of its 95 % interval.
    `valid`: True if it is determined well enough.
    """

    percent: float
    sd: float
    ci95: Annotated[FloatArray, "2 nan"]
    valid: bool


@dataclass(frozen=True)
class ReferenceContribution:
    """Contribution ``C'`` (19) of one movement.

    `percent`, `sd`: the value and its standard error; NaN if the mean reference is zero.
    `mean_reference_Nm`: mean support of the passive repetitions.
    `valid`: True if the reference can be used.
    `why_not`: the reason if it is not valid, else empty.
    """

    percent: float
    sd: float
    mean_reference_Nm: float
    valid: bool
    why_not: str = ""


@dataclass(frozen=True, repr=False)
class Contribution:
    """A person's share in one movement, per cent of the torque that the passive arm needs.

    Attributes
    ----------
    trial, condition, movement, axis_name : str
        Names of trial, condition and movement in the trial table, and of the moving axis.
    n_samples : int
        Number of samples that are used, in which the axis moves.
    duration_s : float
        Time from onset to end, s.
    still_share : float
        Share of the samples between that are not used.
    share : Metric
        The share of tau_h in tau_user, fitted together with a share of the robot's inertia torque.
    projection : Metric
        The share of tau_h in tau_user alone.
    ratio : Metric
        (4), the ratio of the sums.
    reference : ReferenceContribution or None
        (19); None if the arm has no reference of this movement.
    inertia_percent : float
        The share of the robot's inertia torque, fitted together with `share`; NaN if the robot does
        not accelerate.
    ratio_all_percent : float
        (4) of all samples from onset to end.
    sum_ratio : float
        ``|sum tau_h| / sum |tau_h|``.
    mean_support_Nm, mean_arm_Nm : float
        Means of (18) and of tau_h.
    lowering_share, saturated_share : float
        Share of the samples in which the passive arm drives the movement, and of those in which the
        motor is at its limit.
    share_variance : VarianceShares
        Contributions to the variance of `share`.
    notes : tuple of str
        Notes on these numbers for a reader.
    """

    trial: str
    condition: str
    movement: str
    axis_name: str
    n_samples: int
    duration_s: float
    still_share: float
    share: Metric
    projection: Metric
    ratio: Metric
    reference: ReferenceContribution | None
    inertia_percent: float
    ratio_all_percent: float
    sum_ratio: float
    mean_support_Nm: float
    mean_arm_Nm: float
    lowering_share: float
    saturated_share: float
    share_variance: VarianceShares
    notes: tuple[str, ...] = ()

    @property
    def reference_valid(self) -> bool:
        """True if there is a reference (19), and it is determined well enough."""
        return self.reference is not None and self.reference.valid

    def to_dict(self) -> dict[str, Any]:
        """Row of RESULT.csv: plain numbers and texts, None for a missing number."""
        row: dict[str, Any] = finite(cells(CONTRIBUTION, self))
        return row

    def __repr__(self) -> str:
        low, high = self.share.ci95
        share = f"share {self.share.percent:.1f} % (95 %: {low:.1f} to {high:.1f})"
        where = f"trial {self.trial}, {self.condition}, {self.movement}"
        return f"{where}: {share if self.share.valid else 'the share cannot be told'}"


# RESULT.csv: one row per movement.


def _of_metric(name: str, words: str) -> tuple[Column[Contribution], ...]:
    """Columns of a metric: value, standard error, limits, and validity."""

    def of(part: Callable[[Metric], Any]) -> Callable[[Contribution], Any]:
        return lambda result: part(getattr(result, name))

    percent = Column(f"{name}_percent", words, "%", of(lambda m: m.percent))
    return (
        percent,
        beside("sd_", percent, of(lambda m: m.sd), name=name),
        beside("ci_low_", percent, of(lambda m: float(m.ci95[0])), name=name),
        beside("ci_high_", percent, of(lambda m: float(m.ci95[1])), name=name),
        Column(f"{name}_valid", f"whether it can be told: {words}", value=of(lambda m: m.valid)),
    )


def _of_reference(name: str) -> Callable[[Contribution], Any]:
    return lambda result: None if result.reference is None else getattr(result.reference, name)


def _of_variance(part: str) -> Column[Contribution]:
    return Column(
        f"variance_from_{part}",
        f"part of the share's variance that comes from: {part}",
        "1",
        lambda result: getattr(result.share_variance, part),
    )


_REFERENCE: Final[Column[Contribution]] = Column(
    "reference_percent",
    "contribution against passive repetitions (19)",
    "%",
    _of_reference("percent"),
)
#: The columns of RESULT.csv.
CONTRIBUTION: Final[tuple[Column[Contribution], ...]] = (
    Column("trial", "number of the trial"),
    Column("condition", "condition of the trial"),
    Column("movement", "movement of the trial"),
    Column("axis", "axis that moves", value=lambda result: result.axis_name),
    Column("n_samples", "samples that count, because the axis moves", "1"),
    Column("duration_s", "time from onset to end", "s"),
    Column("still_share", "part of the samples between that does not count", "1"),
    *_of_metric("share", "the person's share, beside that of the robot's own inertia"),
    Column(
        "robot_inertia_percent",
        "share of the robot's inertia torque",
        "%",
        lambda result: result.inertia_percent,
    ),
    *_of_metric("projection", "the person's share alone"),
    *_of_metric("ratio", "the person's share as a ratio of sums (4)"),
    Column("sum_ratio", "size of the sum of the arm's torques over the sum of their sizes", "1"),
    Column(
        "ratio_all_samples_percent",
        "ratio of sums (4) of all samples from onset to end",
        "%",
        lambda result: result.ratio_all_percent,
    ),
    _REFERENCE,
    beside("sd_", _REFERENCE, _of_reference("sd"), name="reference"),
    Column("reference_valid", "whether there is a reference (19), and it can be told"),
    Column("mean_support_Nm", "mean support by the robot (18)", "N m"),
    Column("mean_arm_Nm", "mean torque that the passive arm needs", "N m"),
    Column(
        "mean_reference_Nm",
        "mean support of the passive repetitions",
        "N m",
        _of_reference("mean_reference_Nm"),
    ),
    Column("lowering_share", "part of the samples in which the arm drives the movement", "1"),
    Column("saturated_share", "part of the samples with the motor at its limit", "1"),
    *map(_of_variance, PARTS),
    Column(
        "notes",
        "what a reader must know of these numbers",
        value=lambda result: "; ".join(result.notes),
    ),
)


@dataclass(frozen=True)
class SampleContribution(FrozenRecord):
    """Contribution (3) over a movement of S samples.

    `time_s`, `user`, `arm` (S,): s, N m.
    `counts` (S,) bool: True if the axis moves.
    `percent`, `sd` (S,): NaN if tau_h is exactly zero.
    `valid` (S,) bool: True if tau_h is significantly different from zero.
    """

    time_s: Annotated[FloatArray, "S"]
    user: Annotated[FloatArray, "S"]
    arm: Annotated[FloatArray, "S"]
    counts: Annotated[BoolArray, "S"]
    percent: Annotated[FloatArray, "S nan"]
    sd: Annotated[FloatArray, "S nan"]
    valid: Annotated[BoolArray, "S"]


@dataclass(frozen=True)
class RunningContribution(FrozenRecord):
    """Projection over the last `window_s` seconds, at each of S samples; for a display.

    While the axis stands still it is that of the earlier samples; NaN once there are none.

    `window_s`: length of the window, s; it is shorter at the movement's start.
    `time_s`, `percent`, `sd` (S,): s, per cent, percentage points.
    `valid` (S,) bool: True if it is determined well enough.
    """

    window_s: float
    time_s: Annotated[FloatArray, "S"]
    percent: Annotated[FloatArray, "S nan"]
    sd: Annotated[FloatArray, "S nan"]
    valid: Annotated[BoolArray, "S"]


@dataclass(frozen=True)
class ContributionSoFar(FrozenRecord):
    """Share or projection of a movement from its onset up to each of S samples.

    Its last value is that of the whole movement. It does not change while the axis stands still.

    `metric`: "share" or "projection".
    `time_s`, `percent`, `sd` (S,): s, per cent, percentage points; NaN while the
    denominator is zero.
    `valid` (S,) bool: True if it is determined well enough, and has been for a while.
    """

    metric: str
    time_s: Annotated[FloatArray, "S"]
    percent: Annotated[FloatArray, "S nan"]
    sd: Annotated[FloatArray, "S nan"]
    valid: Annotated[BoolArray, "S"]
