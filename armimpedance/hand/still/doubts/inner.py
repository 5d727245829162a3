"""A mode inside the limb: what moves while the hand is held, as the swivel of a free elbow.

A hand in space that hangs on more joints than it has directions is more than second order. With one
inner coordinate, its natural frequency w and damping ratio z, the limb answers

    M x'' + B x' + K x + S n n^T (x - x_slow),   x_slow'' + 2 z w x_slow' + w^2 x_slow = w^2 x:

at once with ``K + S n n^T``, at rest with K, which is what is asked for. A short disturbance shows
the sum, and the misfit stays below a hundredth of the force. The column of one departure is
``z = s n n^T (x - x_slow)``, s the mean of K's diagonal; n and w are not known, so that the
estimate is the mean over many of them, weighted by what the trials say (Bayesian model averaging;
see J. A. Hoeting and colleagues, Statistical Science 14 (1999) 382), and its covariance has their
spread. Numbers below 0 are excluded: an inner mode never makes the answer softer at once.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np
from scipy.special import ndtr

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.errors import InputError
from armimpedance.core.estimates import ImpedanceEstimate
from armimpedance.core.records import Recording, Window
from armimpedance.hand.still.modal import ModalEquation
from armimpedance.limb.arm import FREE_WRIST
from armimpedance.numerics.regression import t_factor

# The columns of modes inside the limb: what moves while the hand is held.
#
# `inner` has the equations. A free wrist adds a mass m that the hand carries along while it is
# slow, ``m n n^T x_slow''``: forearm and hand turn about a handle on a ball joint with a few Hz.
# Taken for the limb's own it makes K too small along the soft axes. M and B of such a limb are
# those of slow motion.

#: Axes from which on a limb has joints that the hand does not show.
FEWEST_AXES: Final = 3
#: Natural frequencies (Hz) that are tried, one damping ratio for all, and how many directions.
INNER_HZ: Final = (1.2, 1.8, 2.7, 4.0)
INNER_DAMPING: Final = 0.5
INNER_DIRECTIONS: Final = 24
#: Those of a mass that a free wrist carries along while it is slow.
WRIST_HZ: Final = (3.0, 5.0, 8.0)
#: In the name of such a mass' column.
CARRIED: Final = "carried"


def inner_columns(
    window: Window, equation: ModalEquation, theta: FloatArray, free_wrist: bool
) -> dict[str, FloatArray]:
    """The columns (T, d, n) of inner modes along many directions; none in fewer than three axes."""
    d = equation.axes
    if d < FEWEST_AXES:
        return {}
    used = window.usable
    x = window.position[used] - window.position_at_onset[used][:, None]
    rate = window.sample_rate_hz
    mass, _, scale = (float(np.trace(part)) / d for part in theta.reshape(3, d, d))
    signals = {f"inner {hz}": scale * (x - _slow(x, hz, rate)[0]) for hz in INNER_HZ}
    if free_wrist:
        signals |= {f"inner {hz} {CARRIED}": mass * _carried(x, hz, rate) for hz in WRIST_HZ}
    columns = {}
    for name, signal in signals.items():
        late = np.tensordot(signal, equation.modes.smooth, axes=(1, 1))
        for i, n in enumerate(half_sphere(INNER_DIRECTIONS)):
            along = np.tensordot(late, n, axes=(1, 0))
            columns[f"{name} {i}"] = n[None, :, None] * along[:, None]
    return columns


def half_sphere(count: int) -> FloatArray:
    """Unit vectors evenly over half a sphere: a spiral of the golden angle.

    Parameters
    ----------
    count : int

    Returns
    -------
    (count, 3)
    """
    steps = np.arange(count) + 0.5
    z, turn = steps / count, np.pi * (1 + np.sqrt(5.0)) * steps
    level = np.sqrt(1 - z**2)
    return np.stack([level * np.cos(turn), level * np.sin(turn), z], axis=1)


def _slow(x: FloatArray, hz: float, rate_hz: float) -> tuple[FloatArray, FloatArray]:
    """What a mode at rest makes of a displacement (T, S, d), and its rate of change.

    A low-pass of the second order.
    """
    w = 2 * np.pi * hz
    A = np.array([[0.0, 1.0], [-(w**2), -2 * INNER_DAMPING * w]])
    values, vectors = np.linalg.eig(A)
    step = ((vectors * np.exp(values / rate_hz)) @ np.linalg.inv(vectors)).real
    push = np.linalg.solve(A, step - np.eye(2)) @ np.array([0.0, w**2])
    out, state = np.zeros((2, *x.shape)), np.zeros((2, len(x), x.shape[2]))
    for n in range(1, x.shape[1]):
        middle = (x[:, n] + x[:, n - 1]) / 2
        state = np.tensordot(step, state, axes=1) + push[:, None, None] * middle
        out[:, :, n] = state
    return out[0], out[1]


def _carried(x: FloatArray, hz: float, rate_hz: float) -> FloatArray:
    """The second derivative of what `_slow` makes, from the mode's equation."""
    w, (place, speed) = 2 * np.pi * hz, _slow(x, hz, rate_hz)
    return np.asarray(w**2 * (x - place) - 2 * INNER_DAMPING * w * speed)


#: Column of the trial table: whether the upper arm was kept from turning about its axis.
ELBOW: Final = "elbow"
Elbow = Literal["held", "free"]
#: And whether forearm and hand could turn: "locked" or "free".
WRIST: Final = "wrist"
#: Size of S beforehand, parts of K's mean diagonal, and the probability of a mode at all.
USUAL: Final = 0.3
BEFOREHAND: Final = {"free": 0.99, None: 0.9}
#: What is less of the softest stiffness is not told.
LEAST_TOLD: Final = 0.05


@dataclass(frozen=True)
class Inner:
    """What an inner mode makes of M, B and K (3 d^2,), row by row.

    `probability`: of a mode at all, by the trials.
    `wrong` (3 d^2,): by how much the second-order fit is wrong, the mean.
    `spread` (3 d^2, 3 d^2): covariance about that mean.
    `hz`: natural frequency that is likeliest.
    `wrist`: whether a free wrist was allowed for, too.
    """

    probability: float
    wrong: FloatArray
    spread: FloatArray
    hz: float
    wrist: bool = False


def freedom_told(recording: Recording, rows: IntArray) -> Elbow | None:
    """Whether joints beyond the hand's axes were held or free in these trials; None: nobody said.

    A wrist that is free counts as much as an elbow.

    `rows` (R,) int: trials.
    Returns: "free" where the elbow or the wrist was.
    Raises InputError: a column says something else.
    """
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


def averaged_inner(
    found: dict[str, tuple[float, float, float]], shifts: dict[str, FloatArray], elbow: Elbow | None
) -> Inner:
    """Mean over the modes and none.

    Parameters
    ----------
    found : column -> (size, expected error, t quantile over the normal one)
    shifts : column -> (3 d^2,)
        By how much M, B, K are wrong for one unit.
    elbow : {"free", None}

    Returns
    -------
    Inner
    """
    names, prior = list(found), BEFOREHAND[elbow]
    told = [_half_normal(size, error * wider) for size, error, wider in found.values()]
    odds = np.array([one[0] for one in told]) + np.log(prior / len(names) / (1 - prior))
    top = max(0.0, float(odds.max()))
    weight = np.exp(odds - top)
    total = float(weight.sum() + np.exp(-top))
    p = weight / total
    means, squares = np.array([one[1] for one in told]), np.array([one[2] for one in told])
    G = np.array([shifts[name] for name in names])
    wrong = (p * means) @ G
    # E[(k g)(k g)^T] over the modes, less that of the mean
    spread = (G.T * (p * squares)) @ G - np.outer(wrong, wrong)
    hz = float(names[int(np.argmax(p * means))].split()[1])
    return Inner(float(p.sum()), wrong, spread, hz, any(CARRIED in name for name in names))


def _half_normal(size: float, error: float) -> tuple[float, float, float]:
    """Log Bayes factor against none, mean and mean square of a number that is never negative."""
    part = USUAL**2 / (error**2 + USUAL**2)
    mean, sd = part * size, float(np.sqrt(part)) * error
    above = float(ndtr(mean / sd))
    if above < 1e-12:
        return -50.0, 0.0, 0.0
    factor = 0.5 * np.log1p(-part) + size**2 * part / (2 * error**2) + np.log(2 * above)
    edge = float(np.exp(-((mean / sd) ** 2) / 2) / np.sqrt(2 * np.pi)) / above
    first = mean + sd * edge
    variance = sd**2 * (1 - edge * (edge + mean / sd))
    return float(factor), first, max(variance, 0.0) + first**2


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
    whose, hint = "elbow", "`elbow` 'held' in the trial table leaves it out"
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
    if could < LEAST_TOLD * abs(before) and not inner.wrist:
        return None
    axis = f"K along its softest axis is {before:.3g} as of a second-order limb, {after:.3g} +- "
    if inner.wrist:
        return (
            f"inner mode: a free wrist gives way (some {inner.hz:g} Hz): {axis}{half:.2g} with "
            "that allowed for; take no M and B from a short disturbance; lock the wrist, or stay "
            "out for a second"
        )
    return (
        f"inner mode: an elbow that swivels (some {inner.hz:g} Hz) hides stiffness from a short "
        f"disturbance: {axis}{half:.2g} with the swivel allowed for; hold the elbow, or stay out "
        "for 0.3 s and longer"
    )
