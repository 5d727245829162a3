"""What the reflex guard says of one group of trials."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.conventions import Kind, group_name
from armimpedance.hand.still.reflex.ends import WindowEnds

Outcome = Literal["none", "contaminated", "unknown"]

#: A reflex is named at this p or less. At .05 two of six disturbances gave false alarms in 6.5 and
#: 7 % of 200 experiments with the simulated subject: flipped signs do not see what its own
#: non-linearity repeats in every trial. Where a reflex of 25 % can be told, nothing is lost by it.
LEVEL = 0.03
#: A reflex of less than this part of K is none: with little noise the limb's own non-linearity
#: is as large.
NEGLIGIBLE_SHARE = 0.02
#: "No sign of a reflex" is said only if one of this part of K, this late (s), would have been seen.
TELLING_SHARE = 0.25
TELLING_S = 0.050


@dataclass(frozen=True)
class Share:
    """A part of the intrinsic stiffness (0.25 is 25 %) with its 95 % interval.

    Attributes
    ----------
    value, low, high : float
    """

    value: float
    low: float
    high: float


@dataclass(frozen=True, eq=False)
class DelayProfile:
    """What every delay says, D delays.

    Attributes
    ----------
    delay_s : (D,)
    log_ratio : (D,)
        Log-likelihood ratio of a reflex at this delay against none.
    weight : (D,)
        Weight of each delay in the mean over delays.
    """

    delay_s: FloatArray
    log_ratio: FloatArray
    weight: FloatArray

    def quantile(self, part: float) -> float:
        """The delay (s) below which this part of the weight lies."""
        edges = (self.delay_s[1:] + self.delay_s[:-1]) / 2
        edges = np.concatenate([self.delay_s[:1], edges, self.delay_s[-1:]])
        return float(np.interp(part, np.concatenate([[0.0], np.cumsum(self.weight)]), edges))


@dataclass(frozen=True, eq=False, repr=False)
class ReflexVerdict(FrozenRecord):
    """Whether a reflex contaminates the stiffness of one group of trials, and the evidence.

    Attributes
    ----------
    keys : mapping
        The group.
    kind : {"hand", "joint"}
    outcome : {"none", "contaminated", "unknown"}
        "unknown": no sign, but a reflex of a quarter of K would go unseen.
    p_value : float
        p value of the hypothesis that there is no reflex at any delay that was tried.
    delay_s, delay_low_s, delay_high_s : float
        Mean over delays and 95 % interval; all the same if the delay was given.
    scanned : bool
    without, intrinsic, reflex : (d, d)
        K of the model without reflex; K and R of the model with it.
    covariance : (3 d^2, 3 d^2)
        Covariance of the three matrices, row by row. Where the delay was scanned, it includes the
        delay's uncertainty.
    dof : float
    overstated : Share
        Overstatement of K by the model without reflex, as part of the intrinsic K, along K.
    share : Share
        The reflex along K.
    visible : tuple of (delay in s, part of K)
        Smallest reflex that the test finds in 95 % of such experiments; empty if one was found.
    profile : DelayProfile
    ends : WindowEnds or None
    n_trials : int
    """

    keys: dict[str, Any]
    kind: Kind
    outcome: Outcome
    p_value: float
    delay_s: float
    delay_low_s: float
    delay_high_s: float
    scanned: bool
    without: Annotated[FloatArray, "d d"]
    intrinsic: Annotated[FloatArray, "d d"]
    reflex: Annotated[FloatArray, "d d"]
    covariance: Annotated[FloatArray, "q q"]
    dof: float
    overstated: Share
    share: Share
    visible: tuple[tuple[float, float], ...]
    profile: DelayProfile
    ends: WindowEnds | None
    n_trials: int

    def __repr__(self) -> str:
        said = f"{group_name(self.keys)}: {self.outcome}, p = {self.p_value:.2g}"
        if self.outcome != "contaminated":
            return said
        delay, share = 1e3 * self.delay_s, 100 * self.share.value
        return f"{said}, {delay:.0f} ms after the onset, {share:.0f} % of the intrinsic K"

    @property
    def total(self) -> FloatArray:
        """K intrinsic and reflex together: what a slow displacement meets."""
        return np.asarray(self.intrinsic + self.reflex)

    @property
    def sd(self) -> FloatArray:
        """Standard errors of without, intrinsic, reflex, (3, d, d)."""
        return np.sqrt(np.diag(self.covariance)).reshape(3, *self.intrinsic.shape)

    @property
    def total_sd(self) -> FloatArray:
        """Standard errors of `total`, (d, d)."""
        q = self.intrinsic.size
        T = np.hstack([np.zeros((q, q)), np.eye(q), np.eye(q)])
        variance = np.diag(T @ self.covariance @ T.T)
        return np.asarray(np.sqrt(variance).reshape(self.intrinsic.shape))

    #: A reflex is named at this p or less, and only if it is at least this part of K.
    NAMED_AT_P: ClassVar[float] = LEVEL
    LEAST_SHARE: ClassVar[float] = NEGLIGIBLE_SHARE
    #: "No sign of a reflex" means one this late (s).
    TELLING_S: ClassVar[float] = TELLING_S

    def seen_from(self, delay_s: float = TELLING_S) -> float:
        """Smallest reflex (part of K) that would have been seen at the listed delay nearest."""
        return min(self.visible, key=lambda pair: abs(pair[0] - delay_s))[1]
