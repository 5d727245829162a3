"""The checks before a fit of force on motion: can it be a limb, and is it the model's?"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import permutations, product
from typing import Any, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, lengths, once_per_record
from armimpedance.core.conventions import (
    AXES,
    LARGEST_ANGLE_RAD,
    POSITION_UNIT,
    group_name,
    perturbation_columns,
)
from armimpedance.core.errors import ArmImpedanceError
from armimpedance.core.findings import Finding
from armimpedance.core.records import Recording, Window
from armimpedance.hand.still.doubts.departures import check_departures
from armimpedance.hand.still.doubts.filter import in_step
from armimpedance.hand.still.estimation import DEFAULT_BY, Options, groups_of
from armimpedance.hand.still.methods import exact
from armimpedance.hand.still.prepared import fit_names, to_matrix_order
from armimpedance.numerics.criticism import check_hand_size, check_joint_size
from armimpedance.numerics.regression import fit, t_factor
from armimpedance.numerics.signals import (
    FEWEST_AT_REST,
    cut_windows,
    disturbance_times,
    multiple_coherence,
    rms_at_rest,
)

# Can this be a limb? Units, sign and axes of force and position, judged by the inertia.
#
# Of M, B and K the inertia is known best, by measurement and beforehand: it is symmetric and
# positive definite whatever the person does, and its size follows from the body's. A fit with
# forces or positions in other units, with another sign or along other axes finds ``c Q M`` instead,
# c the ratio of the units and Q orthogonal.

#: A disturbance moves the limb by less than this (m, rad).
WAY: Final = {"hand": 0.3, "joint": 1.0}
#: Without lengths: no hand is further from its shoulder (m).
LONGEST_ARM_M: Final = 1.2
#: Times the arm's length at which a hand's distance from the shoulder is told, and refused.
NEAR: Final = 1.05
FAR: Final = 1.3
#: A judgement needs the inertia within this part of itself.
LARGEST_ERROR: Final = 0.25
#: Standard errors beyond which a difference is no chance.
SIGNIFICANT: Final = 4.5
#: Force before a disturbance, as a part of that in it, from which on it may be what moves the hand.
OWN_FORCE: Final = 0.4
#: Force and position axes turned against each other by this much are told, by more are refused.
TURNED_DEG: Final = (1.5, 20.0)


@dataclass(frozen=True)
class _Inertia:
    """M (d, d) with the handle, its covariance, and what motion and force were like.

    `way`: of the disturbances. `at_rest`: force before them, as a part of that in them, and `hz`:
    where most of it lies.
    """

    keys: Mapping[str, Any]
    matrix: FloatArray
    covariance: FloatArray
    dof: float
    way: float
    at_rest: float
    hz: float

    @property
    def mean(self) -> float:
        """Mean over the axes of the inertia's size, whatever its sign and axes."""
        return float(np.linalg.svd(self.matrix, compute_uv=False).mean())

    @property
    def error(self) -> float:
        """Standard error of an element."""
        return float(np.sqrt(np.diag(self.covariance).max()))

    @property
    def known(self) -> bool:
        """Whether the smallest inertia is far enough from nothing to have a direction."""
        least = float(np.linalg.svd(self.matrix, compute_uv=False)[-1])
        return self.error < min(LARGEST_ERROR * self.mean, least / SIGNIFICANT)


def check_limb(recording: Recording) -> tuple[Finding, ...]:
    """Units, reach, sign and axes, from a quick fit of every condition.

    `recording`: with disturbances that return.
    Returns: "units", "reach", "force sign" (only where it is wrong) and "axes"; empty where no
    condition can be fitted, which an estimate will say better.
    """
    if recording.perturbation != "returning":
        return ()
    found = _inertias(recording)
    if not found:
        return ()
    checks = [_units(recording, found), _reach(recording)]
    known = [one for one in found if one.known]
    if not known:
        text = "inertia is not known well enough to tell the sign and axes of force and position"
        return (*checks, Finding("axes", "cannot tell", text))
    wrong = next((wrong for one in known if (wrong := _exchanged(one)) is not None), None)
    return (*checks, _turned(_mean(known)) if wrong is None else wrong)


def _mean(found: Sequence[_Inertia]) -> _Inertia:
    """The mean of several conditions: sensors have the same axes in all of them."""
    n = len(found)
    return replace(
        found[0],
        matrix=np.sum([one.matrix for one in found], axis=0) / n,
        covariance=np.sum([one.covariance for one in found], axis=0) / n**2,
        dof=sum(one.dof for one in found),
    )


def _inertias(recording: Recording) -> list[_Inertia]:
    """A quick fit of every condition that can be fitted; of all trials together where none can."""
    timing = disturbance_times(recording)
    for by in (DEFAULT_BY, ()):
        found = []
        for keys, rows in groups_of(recording, by):
            try:
                found.append(_inertia(cut_windows(recording, rows, timing), recording, keys))
            except ArmImpedanceError:
                continue
        if found:
            return found
    return []


def _inertia(window: Window, recording: Recording, keys: Mapping[str, Any]) -> _Inertia:
    d = recording.axes
    factors = exact.prepare(window, recording.kind).factors
    names, units = fit_names(recording.kind, d)
    solved = fit(factors, covariance="cr3", parameter_names=names, parameter_units=units)
    ordered = to_matrix_order(solved.parameters, solved.covariance, d)
    place = window.position[window.usable]
    moved = lengths(place - place[:, :1])
    way = float(np.median(moved.max(axis=1)))
    size = d * d
    matrix, covariance = ordered[0, :size].reshape(d, d), ordered[1 : 1 + size, :size]
    return _Inertia(keys, matrix, covariance, solved.dof, way, *_own_force(window))


def _own_force(window: Window) -> tuple[float, float]:
    """Rms of the force before the onset over that after it, and the frequency of most of it, Hz."""
    rest = window.lag_s <= 0
    if rest.sum() < FEWEST_AT_REST:
        return 0.0, 0.0
    noise, response = rms_at_rest(window)
    before = window.force[window.usable][:, rest]
    lines = np.fft.rfft(before - before.mean(axis=1, keepdims=True), 8 * before.shape[1], axis=1)
    power = (np.abs(lines) ** 2).sum(axis=(0, 2))
    hz = float(np.argmax(power)) * window.sample_rate_hz / (8 * before.shape[1])
    return noise / max(response, 1e-300), hz


def _units(recording: Recording, found: Sequence[_Inertia]) -> Finding:
    """Size of the inertia and of the movement against what a limb can have."""
    kind, mass = recording.kind, recording.subject.mass_kg
    length = POSITION_UNIT[kind]
    if kind == "joint" and (turn := float(np.abs(recording.position).max())) > LARGEST_ANGLE_RAD:
        text = f"angles up to {turn:.4g} rad, more than a turn: are these degrees?"
        return Finding("units", "unusable", text)
    way = float(np.median([one.way for one in found]))
    if way > WAY[kind]:
        text = f"disturbances of {way:.3g} {length}: is the position in another unit than {length}?"
        return Finding("units", "unusable", text)
    mean = float(np.median([one.mean for one in found]))
    error = float(np.median([one.error for one in found]))
    if kind == "joint":
        size = check_joint_size("inertia", mean, error)
        return replace(size, verdict="unusable") if size.verdict == "warning" else size
    return check_hand_size(mean, error, mass)


def _reach(recording: Recording) -> Finding:
    """Whether the hand is within the arm's length of the shoulder."""
    if recording.kind != "hand" or recording.shoulder_m is None:
        return Finding("reach", "ok", "no shoulder to measure it from")
    upper, fore = recording.subject.upper_arm_m, recording.subject.forearm_hand_m
    known = upper is not None and fore is not None
    longest = upper + fore if known else LONGEST_ARM_M  # type: ignore[operator]
    far = float(np.median(lengths(recording.position - recording.shoulder_m)))
    text = f"the hand is {far:.3g} m from the shoulder, the arm {longest:.3g} m long"
    if far > FAR * longest:
        return Finding("reach", "unusable", f"{text}: check the unit of position and shoulder_m")
    if far > NEAR * longest:
        return Finding("reach", "warning", f"{text}: check the lengths and shoulder_m")
    return Finding("reach", "ok", text, smallest=f"{NEAR:g} times the arm's length")


def _orthogonal(matrix: FloatArray) -> FloatArray:
    """Q (d, d) of the polar decomposition ``M = Q P``, P positive definite."""
    left, _, right = np.linalg.svd(matrix)
    # (d, d) (d, d)
    return np.asarray(left @ right)


def _exchanged(one: _Inertia) -> Finding | None:
    """What is wrong where sign or axes of one condition are quite other ones; None else."""
    Q = _orthogonal(one.matrix)
    nearest = max(_signed_permutations(len(Q)), key=lambda C: float(np.trace(Q.T @ C)))
    where = group_name(one.keys)
    if (nearest == np.eye(len(Q))).all():
        return None
    if one.at_rest > OWN_FORCE:
        text = (
            f"{where}: force at rest is {100 * one.at_rest:.0f} % of that in the disturbance, most "
            f"at some {one.hz:.0f} Hz, and inertia is not positive: a tremor that moves the robot, "
            "not the robot the hand; push more strongly, or with a robot that yields less (or the "
            "force has another sign, `force_by`)"
        )
        return Finding("tremor", "unusable", text)
    if (nearest == -np.eye(len(Q))).all():
        text = (
            f"{where}: inertia is negative: the force has the other sign; is it that of the "
            "device on the limb (force_by)?"
        )
        return Finding("force sign", "unusable", text)
    text = (
        f"{where}: inertia is not positive: {_difference(nearest)} in force or position; compare "
        "the axes of the two sensors"
    )
    return Finding("axes", "unusable", text)


def _turned(mean: _Inertia) -> Finding:
    """Whether the axes of force are turned against those of position."""
    angle, error = _angle_deg(_orthogonal(mean.matrix)), _angle_error_deg(mean)
    certain = SIGNIFICANT * t_factor(mean.dof) / t_factor(np.inf) * error
    told, refused = (max(limit, certain) for limit in TURNED_DEG)
    if angle <= told:
        text = "inertia is symmetric and positive: force and position have the same axes"
        return Finding("axes", "ok", text, smallest=f"{told:.1f} deg")
    text = (
        f"inertia is not symmetric: the axes of force are turned by {angle:.1f} deg (sd "
        f"{error:.1f}) against those of position, or the channels of a sensor are crossed; turn "
        "the force back, or calibrate the sensor"
    )
    return Finding("axes", "unusable" if angle > refused else "warning", text)


def _signed_permutations(d: int) -> Iterator[FloatArray]:
    """All ways to exchange and mirror d axes, (d, d) each."""
    for order in permutations(range(d)):
        for signs in product((1.0, -1.0), repeat=d):
            yield np.eye(d)[list(order)] * np.array(signs)


def _difference(C: FloatArray) -> str:
    """What a signed permutation does to the axes, in words."""
    d = len(C)
    names = AXES[:d]
    moved = [name for i, name in enumerate(names) if C[i, i] == 0]
    mirrored = [name for i, name in enumerate(names) if C[i, i] < 0]
    words = [f"axes {' and '.join(moved)} are exchanged"] if moved else []
    words += [f"axis {name} is mirrored" for name in mirrored]
    if moved and C[C != 0].min() < 0 and not mirrored:
        words.append("one of them is mirrored")
    return ", ".join(words)


def _angle_deg(Q: FloatArray) -> float:
    """By how much a rotation (d, d) turns; 0 with one axis."""
    d = len(Q)
    if d == 1:
        return 0.0
    cosine = np.trace(Q) / 2 if d == 2 else (np.trace(Q) - 1) / 2
    return float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))


def _angle_error_deg(one: _Inertia) -> float:
    """Standard error of that angle: of the antisymmetric part over the mean inertia."""
    d = len(one.matrix)
    if d == 1:
        return 0.0
    swap = np.arange(d * d).reshape(d, d).T.ravel()
    A = (np.eye(d * d) - np.eye(d * d)[swap]) / 2
    spread = float(np.trace(A @ one.covariance @ A.T)) / 2
    return float(np.degrees(np.sqrt(spread) / one.mean))


#: Motion that explains less of the force than this gives no M, B and K; trials that are asked.
LEAST_COHERENCE: Final = 0.3
MOST_COHERENT: Final = 5


@once_per_record
def check_response(recording: Recording) -> tuple[Finding, ...]:
    """Units, reach, sign and axes; then filter, delay, reflex, amplitude and lack of fit.

    Parameters
    ----------
    recording : Recording

    Returns
    -------
    tuple of Finding
        Empty where the perturbation is stochastic; without the second half where the first one
        says that no number would mean anything.

    Examples
    --------
    >>> from manipulandum_sim.hand import simulate
    >>> recording, _ = simulate("cocontraction", seed=1, sets=1, conditions=["cocontraction_10"])
    >>> from armimpedance.hand.still import check_response
    >>> [check.name for check in check_response(recording)][:4]
    ['units', 'reach', 'axes', 'delay']
    """
    limb = check_limb(recording)
    if not limb or any(finding.verdict == "unusable" for finding in limb):
        return limb
    recording, found = in_step(recording)
    departures = check_departures(recording)
    if found is None:
        return (*limb, *departures)
    # what is left of a delay beside the one that was found is in its interval
    return (*limb, found.finding, *(o for o in departures if o.name != found.finding.name))


def check_driven(recording: Recording) -> list[Finding]:
    """Whether force follows motion well enough for a fit of force on motion, over all frequencies.

    Only `estimate` fits so: `elbow` weighs by noise, and finds what was imposed.

    Returns: empty where the perturbation is not stochastic.
    """
    if recording.perturbation != "stochastic":
        return []
    found = []
    told = recording.imposed in ("force", "torque")
    if told or any(name in recording.extra for name in perturbation_columns(recording.axes)):
        text = (
            "the device imposes the force: noise of the motion makes M, B and K too small here; "
            "`random` takes a hand and `elbow` a joint that is moved so"
        )
        found.append(Finding("imposed", "warning", text))
    low, high = Options().band_hz
    shared = []
    for row in range(min(recording.n_trials, MOST_COHERENT)):
        at = recording.samples_of(row)
        try:
            coherence = multiple_coherence(
                recording.position[at], recording.force[at], recording.sample_rate_hz
            )
            shared.append(coherence.mean(low, high))
        except ArmImpedanceError:
            continue
    if not shared:
        return found
    text = f"motion explains {100 * np.mean(shared):.0f} % of the force from {low:g} to {high:g} Hz"
    if np.mean(shared) >= LEAST_COHERENCE:
        return [*found, Finding("coherence", "ok", text, smallest=f"{100 * LEAST_COHERENCE:g} %")]
    hint = "nothing that a fit could use moved the limb there; of a joint `elbow` may tell more"
    return [*found, Finding("coherence", "unusable", f"{text}: {hint}")]
