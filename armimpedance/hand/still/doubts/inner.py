"""What a mode inside the limb makes of an estimate, as the swivel of a free elbow.

A hand in space that hangs on more joints than it has directions is more than second order
(`inner_modes`). A short disturbance shows a sum, and the misfit stays below a hundredth of the
force. Direction, frequency and damping of the mode are not known, so that the estimate is the mean
over many of them, weighted by what the trials say (Bayesian model averaging; see J. A. Hoeting and
colleagues, Statistical Science 14 (1999) 382), and its covariance has their spread. Numbers below 0
are excluded: an inner mode never makes the answer softer at once.
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

#: Column of the trial table: whether the upper arm was kept from turning about its axis.
ELBOW: Final = "elbow"
Elbow = Literal["held", "free"]
#: And whether forearm and hand could turn: "locked" or "free".
WRIST: Final = "wrist"
#: Size of S beforehand, parts of K's mean diagonal, and the probability of a mode at all.
USUAL: Final = 0.3
BEFOREHAND: Final = {"free": 0.99, None: 0.9, "held": 0.01}
#: What such a mode leaves of an error that it explains, as a part: a real limb has more than one,
#: and not just those that are tried. Of 40 arms with quiet sensors it left .3 to .5.
OF_MODEL: Final = 0.5
#: Error of a size by a column that is not quite the limb's own, as a part of it: without it the
#: trials would choose among columns all of which are a little wrong.
OF_COLUMN: Final = 0.1
#: Trials that make a mode so many times as likely as none name it.
NAMED: Final = 300.0
#: What is less of the softest stiffness is not told.
LEAST_TOLD: Final = 0.05
#: Axes from which on a limb has joints that the hand does not show.
FEWEST_AXES: Final = 3


@dataclass(frozen=True)
class Inner:
    """What an inner mode makes of M, B and K (3 d^2,), row by row.

    `probability`: of a mode at all, by the trials.
    `wrong` (3 d^2,): by how much the second-order fit is wrong, the mean.
    `spread` (3 d^2, 3 d^2): covariance about that mean.
    `ratio`: how many times as likely the trials make a mode as none.
    `size`: of S, the mean.
    `mode`: that which is likeliest.
    `wrist`: whether a free wrist was allowed for, too.
    `elbow`: what was said.
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
        """Whether the trials show it."""
        return self.ratio > NAMED

    @property
    def contradicts(self) -> bool:
        """Whether the elbow was said to be held and was not."""
        return self.elbow == "held" and self.seen


def freedom_told(recording: Recording, rows: IntArray) -> Elbow | None:
    """Whether joints beyond the hand's axes were held or free in these trials; None: nobody said.

    A wrist that is free counts as much as an elbow.

    `rows` (R,) int: trials.
    Returns: "free" where the elbow or the wrist was; None in the plane, where nothing hides.
    Raises InputError: a column says something else.
    """
    if recording.position.shape[1] < FEWEST_AXES:
        return None
    return "free" if is_wrist_free(recording, rows) else elbow_told(recording, rows)


def is_wrist_free(recording: Recording, rows: IntArray) -> bool:
    """Whether forearm and hand could turn in these trials.

    Parameters
    ----------
    recording : Recording
    rows : (R,) int
        Trials.

    Returns
    -------
    bool
        What the column `wrist` says, else whether seven angles were recorded.

    Raises
    ------
    InputError
        The column says something else than locked or free.
    """
    said = _said(recording, rows, WRIST, "locked")
    angles = recording.joint_angles
    seven = angles is not None and angles.shape[1] == FREE_WRIST
    return "free" in said if said else seven


def elbow_told(recording: Recording, rows: IntArray) -> Elbow | None:
    """Whether the elbow was held or free in these trials; None where it is not stated.

    Parameters
    ----------
    recording : Recording
    rows : (R,) int
        Trials.

    Returns
    -------
    {"held", "free"} or None
        "free" where one of them was.

    Raises
    ------
    InputError
        The column says something else.
    """
    said = _said(recording, rows, ELBOW, "held")
    if not said:
        return None
    return "free" if "free" in said else "held"


def _said(recording: Recording, rows: IntArray, column: str, kept: str) -> set[str]:
    """The words of a column of these trials, of `kept` and "free"; none without the column."""
    if column not in recording.trials:
        return set()
    said = {str(v) for v in recording.trials[column].iloc[rows].dropna()} - {""}
    if unknown := sorted(said - {kept, "free"}):
        problem, expected = f"{column} {unknown[0]!r}", f"{kept} or free"
        raise InputError(problem, column=column, expected=expected)
    return said


def averaged_inner(fits: InnerFits, elbow: Elbow | None) -> Inner:
    """Mean over the modes and none.

    Parameters
    ----------
    fits : InnerFits
        With errors as they are, not as the noise's covariance has them.
    elbow : {"free", "held", None}
        What was said of it.

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
    # E[S g] and E[(S g)(S g)^T] over modes and directions, less that of the mean
    G = fits.shift.reshape(factor.size, -1)
    wrong = (p * mean).ravel() @ G
    spread = (G.T * (p * square).ravel()) @ G - np.outer(wrong, wrong)
    left = OF_MODEL**2 * (wrong.reshape(3, -1) ** 2).mean(axis=1)
    spread = spread + np.diag(np.repeat(left, len(wrong) // 3))
    likeliest = fits.modes[int(np.argmax((p * mean).sum(axis=1)))]
    size = float((among * mean).sum())
    wrist = any(mode.carried for mode in fits.modes)
    return Inner(probability, wrong, spread, ratio, size, likeliest, wrist, elbow)


def _half_normal(size: FloatArray, error: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Log Bayes factors against none, means and mean squares of numbers never negative."""
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
    """The estimate with an inner mode allowed for, and a warning where that matters.

    Parameters
    ----------
    one : ImpedanceEstimate
    inner : Inner
    correct : bool
        Take off what is likely wrong; else the intervals hold it.

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
    told = _told(plain, one, inner)
    return one if told is None else replace(one, warnings=(*one.warnings, told))


def _main(spread: FloatArray, wrong: FloatArray) -> FloatArray:
    """The largest axis (3 d^2,) of a covariance, on the side of what is wrong.

    One prior says in all conditions how large a mode is: where it says too little of one, it does
    of the others.
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


def _told(plain: ImpedanceEstimate, one: ImpedanceEstimate, inner: Inner) -> str | None:
    """What a reader must know of the softest stiffness."""
    q = one.k**2
    symmetric = (plain.stiffness + plain.stiffness.T) / 2
    n = np.linalg.eigh(symmetric)[1][:, 0]
    w = np.kron(n, n)
    before, after = (float(n @ e.stiffness @ n) for e in (plain, one))
    block = one.covariance[2 * q :, 2 * q :]
    half = t_factor(one.dof) * float(np.sqrt(max(float(w @ block @ w), 0.0)))
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
    said = "the elbow was said to be held, and " if inner.contradicts else ""
    return (
        f"inner mode: {said}an elbow that swivels ({hz}) hides stiffness from a short "
        f"disturbance: {axis}{half:.2g} with the swivel allowed for; hold the elbow, or stay out "
        "for 0.3 s and longer"
    )
