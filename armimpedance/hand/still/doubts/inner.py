"""Effect of a mode inside the limb on an estimate, such as the swivel of a free elbow.

A hand in space that hangs on more joints than it has directions is more than second order
(`inner_modes`). A short disturbance shows a sum, and the misfit stays below a hundredth of the
force. Direction, frequency and damping of the mode are unknown. So the estimate is the mean over
many modes, weighted by their likelihood (Bayesian model averaging; see J. A. Hoeting and
colleagues, Statistical Science 14 (1999) 382), and its covariance includes their spread. Sizes
below 0 are excluded: an inner mode never makes the instantaneous response softer.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np
from scipy.special import log_ndtr

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.errors import InputError
from armimpedance.core.estimates import ImpedanceEstimate
from armimpedance.core.records import Recording
from armimpedance.hand.still.doubts.inner_fit import InnerFits
from armimpedance.hand.still.doubts.inner_modes import InnerMode
from armimpedance.limb.arm import FREE_WRIST
from armimpedance.numerics.regression import t_factor

#: Column of the trial table: "held" if the upper arm was kept from turning about its axis, else
#: "free".
ELBOW: Final = "elbow"
Elbow = Literal["held", "free"]
#: Column of the trial table: "locked" or "free", for forearm and hand.
WRIST: Final = "wrist"
#: Prior standard deviation of S, as a share of K's mean diagonal, and the prior probability of a
#: mode.
USUAL: Final = 0.3
BEFOREHAND: Final = {"free": 0.99, None: 0.9, "held": 0.01}
#: Share of an error that remains after a mode has explained it: a real limb has more than one mode,
#: and other ones than those that are tried. With 40 arms and quiet sensors .3 to .5 remained.
OF_MODEL: Final = 0.5
#: Relative error of a size because its column is not exactly the limb's. Without it the trials
#: would choose sharply among columns all of which are slightly wrong.
OF_COLUMN: Final = 0.1
#: A mode is reported if the trials make it so many times as likely as no mode.
NAMED: Final = 300.0
#: Smaller shares of the softest stiffness are not reported.
LEAST_TOLD: Final = 0.05
#: Number of axes from which on a limb has joints that the hand does not show.
FEWEST_AXES: Final = 3


@dataclass(frozen=True)
class Inner:
    """Effect of an inner mode on M, B and K (3 d^2,), row by row.

    `probability`: posterior probability of a mode.
    `wrong` (3 d^2,): error of the second-order fit, the mean over modes.
    `spread` (3 d^2, 3 d^2): covariance about that mean.
    `ratio`: Bayes factor of a mode against none.
    `size`: S, the mean over modes.
    `mode`: the likeliest one.
    `wrist`: True if the modes of a free wrist were included.
    `elbow`: stated by the user.
    """

    probability: float
    wrong: FloatArray
    spread: FloatArray
    ratio: float
    size: float
    mode: InnerMode
    wrist: bool = False
    elbow: Elbow | None = None

    @property
    def seen(self) -> bool:
        """True if the trials show a mode."""
        return self.ratio > NAMED

    @property
    def contradicts(self) -> bool:
        """True if the elbow was stated to be held, but the trials show a mode."""
        return self.elbow == "held" and self.seen


def stated_freedom(recording: Recording, rows: IntArray) -> Elbow | None:
    """Stated freedom of joints beyond the hand's axes in these trials; None if not stated.

    A free wrist counts as much as a free elbow.

    `rows` (R,) int: trials.
    Returns: "free" if the elbow or the wrist was free; None in the plane, where no joint is hidden.
    Raises InputError: a column has an unknown value.
    """
    if recording.position.shape[1] < FEWEST_AXES:
        return None
    return "free" if is_wrist_free(recording, rows) else elbow_told(recording, rows)


def is_wrist_free(recording: Recording, rows: IntArray) -> bool:
    """True if forearm and hand could turn in these trials.

    Parameters
    ----------
    recording : Recording
    rows : (R,) int
        Trials.

    Returns
    -------
    bool
        From the column `wrist`; without it True if seven angles were recorded.

    Raises
    ------
    InputError
        The column holds another value than locked or free.
    """
    values = _stated(recording, rows, WRIST, "locked")
    angles = recording.joint_angles
    seven = angles is not None and angles.shape[1] == FREE_WRIST
    return "free" in values if values else seven


def elbow_told(recording: Recording, rows: IntArray) -> Elbow | None:
    """Stated freedom of the elbow in these trials; None if not stated.

    Parameters
    ----------
    recording : Recording
    rows : (R,) int
        Trials.

    Returns
    -------
    {"held", "free"} or None
        "free" if it was free in one of the trials.

    Raises
    ------
    InputError
        The column holds another value.
    """
    values = _stated(recording, rows, ELBOW, "held")
    if not values:
        return None
    return "free" if "free" in values else "held"


def _stated(recording: Recording, rows: IntArray, column: str, constrained: str) -> set[str]:
    """Values of a column in these trials, each `kept` or "free"; empty without the column."""
    if column not in recording.trials:
        return set()
    values = {str(v) for v in recording.trials[column].iloc[rows].dropna()} - {""}
    if unknown := sorted(values - {constrained, "free"}):
        problem, expected = f"{column} {unknown[0]!r}", f"{constrained} or free"
        raise InputError(problem, column=column, expected=expected)
    return values


def averaged_inner(fits: InnerFits, elbow: Elbow | None) -> Inner:
    """Average over all modes and over no mode, weighted by their probabilities.

    Parameters
    ----------
    fits : InnerFits
        With errors measured between trials, not those of the noise's covariance.
    elbow : {"free", "held", None}
        Stated by the user.

    Returns
    -------
    Inner
    """
    prior = BEFOREHAND[elbow]
    error = np.hypot(fits.error, OF_COLUMN * fits.size)
    factor, mean, square = _half_normal(fits.size, error)
    log = factor - np.log(factor.size)
    top = float(log.max())
    ratio = float(np.exp(log - top).sum() * np.exp(min(top, 500.0)))
    weight = np.exp(log - top)
    among = weight / weight.sum()
    probability = ratio * prior / (ratio * prior + 1 - prior)
    p = probability * among
    # E[S g], and the covariance E[(S g)(S g)^T] - E[S g] E[S g]^T, over modes and directions
    G = fits.shift.reshape(factor.size, -1)
    wrong = (p * mean).ravel() @ G
    spread = (G.T * (p * square).ravel()) @ G - np.outer(wrong, wrong)
    residual = OF_MODEL**2 * (wrong.reshape(3, -1) ** 2).mean(axis=1)
    spread = spread + np.diag(np.repeat(residual, len(wrong) // 3))
    likeliest = fits.modes[int(np.argmax((p * mean).sum(axis=1)))]
    size = float((among * mean).sum())
    wrist = any(mode.carried for mode in fits.modes)
    return Inner(probability, wrong, spread, ratio, size, likeliest, wrist, elbow)


def _half_normal(size: FloatArray, error: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Log Bayes factors against none, means and mean squares of numbers that are never negative."""
    part = USUAL**2 / (error**2 + USUAL**2)
    mean, sd = part * size, np.sqrt(part) * error
    z = mean / sd
    above = log_ndtr(z)
    factor = 0.5 * np.log1p(-part) + size**2 * part / (2 * error**2) + np.log(2) + above
    edge = np.exp(-(z**2) / 2 - above) / np.sqrt(2 * np.pi)
    first = np.maximum(mean + sd * edge, 0.0)
    variance = np.maximum(sd**2 * (1 - edge * (edge + z)), 0.0)
    return factor, first, variance + first**2


def with_inner(one: ImpedanceEstimate, inner: Inner, *, correct: bool) -> ImpedanceEstimate:
    """The estimate with an inner mode allowed for, and a warning if that matters.

    Parameters
    ----------
    one : ImpedanceEstimate
    inner : Inner
    correct : bool
        Subtract the mean error from M, B and K; else only the intervals include it.

    Returns
    -------
    ImpedanceEstimate
    """
    d = one.k
    wrong, spread = inner.wrong, inner.spread
    plain, with_handle = one, one.inertia_with_handle
    if correct:
        M, B, K = wrong.reshape(3, d, d)
        one = replace(
            one,
            inertia=one.inertia - M,
            inertia_with_handle=None if with_handle is None else with_handle - M,
            viscosity=one.viscosity - B,
            stiffness=one.stiffness - K,
        )
    else:
        spread = spread + np.outer(wrong, wrong)
    one = replace(
        one,
        covariance=one.covariance + spread,
        bound=None if one.bound is None else one.bound + spread,
        shared_errors={**one.shared_errors, "inner mode": _main(spread, wrong)},
        provenance=(*one.provenance, _note(inner, correct)),
    )
    warning = _warning(plain, one, inner)
    return one if warning is None else replace(one, warnings=(*one.warnings, warning))


def _main(spread: FloatArray, wrong: FloatArray) -> FloatArray:
    """Largest principal axis (3 d^2,) of a covariance, with the sign of the mean error.

    One prior holds for the size of a mode in all conditions: if it is too small in one, it is too
    small in the others.
    """
    values, vectors = np.linalg.eigh(spread)
    main = np.sqrt(max(values[-1], 0.0)) * vectors[:, -1]
    return np.asarray(-main if main @ wrong < 0 else main)


def _note(inner: Inner, correct: bool) -> str:
    whose, hint = "elbow", "`elbow` 'held' in the trial table takes it as unlikely"
    if inner.wrist:
        whose, hint = "elbow and wrist", "a locked wrist leaves it out"
    done = (
        "is taken off M, B, K and stands in their intervals" if correct else "is in the intervals"
    )
    return (
        f"a mode inside the limb, as of a free {whose} (probability {inner.probability:.2f}), "
        f"{done}; {hint}"
    )


def _warning(plain: ImpedanceEstimate, corrected: ImpedanceEstimate, inner: Inner) -> str | None:
    """Warning about the softest stiffness; None if the mode hardly changes it."""
    q = corrected.k**2
    symmetric = (plain.stiffness + plain.stiffness.T) / 2
    n = np.linalg.eigh(symmetric)[1][:, 0]
    w = np.kron(n, n)
    before, after = (float(n @ e.stiffness @ n) for e in (plain, corrected))
    block = corrected.covariance[2 * q :, 2 * q :]
    half = t_factor(corrected.dof) * float(np.sqrt(max(float(w @ block @ w), 0.0)))
    could = abs(float(w @ inner.wrong[2 * q :])) + float(
        np.sqrt(max(float(w @ inner.spread[2 * q :, 2 * q :] @ w), 0.0))
    )
    if could < LEAST_TOLD * abs(before) and not inner.wrist and not inner.contradicts:
        return None
    axis = f"K along its softest axis is {before:.3g} as of a second-order limb, {after:.3g} +- "
    hz = f"some {inner.mode.hz:g} Hz"
    if inner.wrist:
        return (
            f"inner mode: a free wrist gives way ({hz}): {axis}{half:.2g} with "
            "that allowed for; take no M and B from a short disturbance; lock the wrist, or stay "
            "out for a second"
        )
    statement = "the elbow was said to be held, and " if inner.contradicts else ""
    return (
        f"inner mode: {statement}an elbow that swivels ({hz}) hides stiffness from a short "
        f"disturbance: {axis}{half:.2g} with the swivel allowed for; hold the elbow, or stay out "
        "for 0.3 s and longer"
    )
