"""Verdict of the reflex guard on one group of trials."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Any, ClassVar, Literal

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray, FrozenRecord
from armimpedance.core.conventions import Kind, group_name
from armimpedance.core.errors import ArmImpedanceError, InputError
from armimpedance.core.records import Window
from armimpedance.hand.still.weighing import weighted_fit
from armimpedance.numerics.regression import leave_one_out_shift
from armimpedance.numerics.signals import Modes

# Change of the stiffness with the end of the window: the contribution of a reflex comes late.
# Test functions that vanish at the window's end would use too little of 60 ms. The measured motion
# does not depend on the reflex, so that it may come from the whole record, through a smoothing
# spline. Only the force, in means over short cells, ends with the window.

#: Knots of the kinematics' spline and cells of the force (s). Wider knots miss the jerk of the
#: onset: with 20 ms knots K is 30 % wrong at 60 ms, narrower ones let more noise through.
KNOTS_S = 0.008
CELL_S = 0.010
_DEGREE = 5
#: Rest before the onset that is included in the fit (s).
REST_S = 0.080
#: Ends (s): the first, every cell while a reflex may begin, then fewer.
FIRST_END_S = 0.030
_DENSE_UNTIL_S = 0.100
_SPARSE_S = 0.040
#: The early end is the first from here (s) at which K has this precision (sd of its norm, share of
#: K). Before, the spline's error at the onset is a tenth of K and more.
EARLY_S = 0.070
EARLY_SD = 0.15


@dataclass(frozen=True, eq=False)
class WindowEnds(FrozenRecord):
    """Stiffness from windows that end earlier and earlier.

    `stiffness` (E, d, d).
    `end_s` (E,): after the onset.
    `covariance` (E, d^2, d^2): clustered by trial.
    `early`: index of the earliest end with a usable K.
    `change_covariance` (E, d^2, d^2): covariance of the change since the early end. Both fits use
    the same trials, so that their noise cancels.
    """

    end_s: Annotated[FloatArray, "e"]
    stiffness: Annotated[FloatArray, "e d d"]
    covariance: Annotated[FloatArray, "e q q"]
    early: int
    change_covariance: Annotated[FloatArray, "e q q"]
    dof: float

    @property
    def usable(self) -> BoolArray:
        """True for ends (E,) late enough that the spline's error at the onset is small."""
        return np.asarray(self.end_s > EARLY_S - 1e-9)

    @property
    def change(self) -> FloatArray:
        """K minus K at the early end, (E, d, d)."""
        return np.asarray(self.stiffness - self.stiffness[self.early])

    def along(self, direction: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Change along a matrix (d, d), as a share of it, and its standard error, (E,) each."""
        unit = ((direction + direction.T) / 2).ravel()
        unit = unit / (unit @ unit)
        change = self.change.reshape(len(self.end_s), -1) @ unit
        return change, np.sqrt(np.einsum("a,eab,b->e", unit, self.change_covariance, unit))


def window_ends(window: Window, kind: Kind) -> WindowEnds:
    """Fit windows that end 30 ms after the onset and later.

    Raises InputError: if the window is too short for any fit.
    """
    ends, stiffnesses, moved = [], [], []
    d, q = window.axes, window.axes**2
    for end in _ends(window):
        try:
            fitted = weighted_fit(window, kind, modes=_cells(window, end))
            shift = leave_one_out_shift(fitted.equations, fitted.parameters)
        except ArmImpedanceError:
            continue
        ends.append(end)
        stiffnesses.append(fitted.parameters[2 * q :].reshape(d, d))
        moved.append(shift[:, 2 * q :])
    if not ends:
        raise InputError("no window to end early", expected="more samples after the onset")
    stiffness, jackknife = np.stack(stiffnesses), np.stack(moved)
    covariance = _covariance(jackknife)
    size = np.linalg.norm(stiffness.reshape(len(ends), -1)[-1])
    precise = np.sqrt(np.trace(covariance, axis1=1, axis2=2)) <= EARLY_SD * size
    precise &= np.array(ends) > EARLY_S - 1e-9
    early = int(np.argmax(precise)) if precise.any() else len(ends) - 1
    return WindowEnds(
        end_s=np.array(ends),
        stiffness=stiffness,
        covariance=covariance,
        early=early,
        change_covariance=_covariance(jackknife - jackknife[early]),
        dof=float(jackknife.shape[1] - 1),
    )


def _ends(window: Window) -> FloatArray:
    last = float(window.lag_s[-1])
    dense = np.arange(FIRST_END_S, _DENSE_UNTIL_S + 1e-9, CELL_S)
    sparse = np.arange(_DENSE_UNTIL_S + _SPARSE_S, last - _SPARSE_S / 2, _SPARSE_S)
    ends = np.concatenate([dense, sparse, [last]])
    return np.asarray(np.unique(np.round(ends[ends <= last], 6)))


def _covariance(moved: FloatArray) -> FloatArray:
    """CR3 covariance (E, q, q) from the shift of the estimate by each trial (E, T, q)."""
    T = moved.shape[1]
    return np.asarray((T - 1) / T * moved.transpose(0, 2, 1) @ moved)


def _cells(window: Window, end_s: float) -> Modes:
    """Modes for a window that ends early: means over cells, with derivatives of a spline."""
    last = int(np.searchsorted(window.lag_s, end_s + 1e-9))
    first = int(np.searchsorted(window.lag_s, -REST_S - 1e-9))
    return _cell_modes(len(window.lag_s), window.sample_rate_hz, first, last)


@lru_cache(maxsize=64)
def _cell_modes(samples: int, sample_rate_hz: float, first: int, last: int) -> Modes:
    """Modes of samples first to last (exclusive), in whole cells counted from the last."""
    cell = max(1, round(CELL_S * sample_rate_hz))
    count = (last - first) // cell
    smooth = np.zeros((count, samples))
    for k in range(count):
        smooth[k, last - (count - k) * cell : last - (count - k - 1) * cell] = 1 / np.sqrt(cell)
    slope, bend = _spline_derivatives(samples, sample_rate_hz)
    return Modes(smooth, smooth @ slope, smooth @ bend)


@lru_cache(maxsize=8)
def _spline_derivatives(samples: int, sample_rate_hz: float) -> tuple[FloatArray, FloatArray]:
    """Operators (S, S) from samples to derivatives of their least-squares spline."""
    from scipy.interpolate import BSpline

    spacing = max(3, round(KNOTS_S * sample_rate_hz))
    pieces = max(1, (samples - 1) // spacing)
    inner = np.linspace(0, samples - 1, pieces + 1)
    knots = np.concatenate([np.zeros(_DEGREE), inner, np.full(_DEGREE, samples - 1.0)])
    splines = BSpline(knots, np.eye(len(knots) - _DEGREE - 1), _DEGREE)
    at = np.arange(samples, dtype=float)
    # C (b, S) = (N^T N)^-1 N^T, N (S, b)
    N = splines(at)
    C = np.linalg.solve(N.T @ N, N.T)
    slope, bend = (sample_rate_hz**order * splines.derivative(order)(at) @ C for order in (1, 2))
    return slope, bend


Outcome = Literal["none", "contaminated", "unknown"]

#: A reflex is reported at this p or less. At .05 two of six disturbances gave false alarms in 6.5
#: and 7 % of 200 experiments with the simulated subject, because flipped signs do not show the part
#: of its own non-linearity that repeats in every trial. Where a reflex of 25 % is detectable, the
#: lower level loses nothing.
LEVEL = 0.03
#: A reflex of less than this share of K is neglected: with little noise the limb's own
#: non-linearity is as large.
NEGLIGIBLE_SHARE = 0.02
#: "No sign of a reflex" is reported only if a reflex of this share of K, this late (s), would have
#: been detected.
TELLING_SHARE = 0.25
TELLING_S = 0.050


@dataclass(frozen=True)
class Share:
    """Share of the intrinsic stiffness (0.25 is 25 %) with its 95 % interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True, eq=False)
class DelayProfile:
    """Evidence for each of D delays.

    `delay_s` (D,).
    `log_ratio` (D,): log-likelihood ratio of a reflex at this delay against none.
    `weight` (D,): weight of each delay in the mean over delays.
    """

    delay_s: FloatArray
    log_ratio: FloatArray
    weight: FloatArray

    def quantile(self, part: float) -> float:
        """The delay (s) below which this share of the weight lies."""
        edges = (self.delay_s[1:] + self.delay_s[:-1]) / 2
        edges = np.concatenate([self.delay_s[:1], edges, self.delay_s[-1:]])
        return float(np.interp(part, np.concatenate([[0.0], np.cumsum(self.weight)]), edges))


@dataclass(frozen=True, eq=False, repr=False)
class ReflexVerdict(FrozenRecord):
    """Verdict on a reflex in the stiffness of one group of trials, and the evidence.

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
        Mean over delays and 95 % interval; all equal if the delay was stated.
    scanned : bool
    without, intrinsic, reflex : (d, d)
        K of the model without reflex; K and R of the model with it.
    covariance : (3 d^2, 3 d^2)
        Covariance of the three matrices, row by row. It includes the uncertainty of the delay if
        that was scanned.
    dof : float
    overstated : Share
        Overstatement of K by the model without reflex, as part of the intrinsic K, along K.
    share : Share
        The reflex along K.
    visible : tuple of (delay in s, part of K)
        Smallest reflex that the test detects in 95 % of such experiments; empty if one was
        detected.
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
        text = f"{group_name(self.keys)}: {self.outcome}, p = {self.p_value:.2g}"
        if self.outcome != "contaminated":
            return text
        delay, share = 1e3 * self.delay_s, 100 * self.share.value
        return f"{text}, {delay:.0f} ms after the onset, {share:.0f} % of the intrinsic K"

    @property
    def total(self) -> FloatArray:
        """K intrinsic and reflex together: the stiffness for a slow displacement."""
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

    #: A reflex is reported at this p or less, and only if it is at least this share of K.
    NAMED_AT_P: ClassVar[float] = LEVEL
    LEAST_SHARE: ClassVar[float] = NEGLIGIBLE_SHARE
    #: "No sign of a reflex" refers to a reflex this late (s).
    TELLING_S: ClassVar[float] = TELLING_S

    def seen_from(self, delay_s: float = TELLING_S) -> float:
        """Detection limit of a reflex (share of K) at the listed delay nearest to `delay_s`."""
        return min(self.visible, key=lambda pair: abs(pair[0] - delay_s))[1]
