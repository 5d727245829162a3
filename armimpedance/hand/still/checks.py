"""Checks before a fit of force on motion: are the data those of a limb, and of this model?"""

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

# Are the data those of a limb? Units, sign and axes of force and position, judged by the inertia.
# Of M, B and K the inertia is determined best, by measurement and a priori: it is symmetric and
# positive definite whatever the person does, and its size follows from the body's. A fit with
# forces or positions in other units, with another sign or along other axes gives ``c Q M`` instead,
# c the ratio of the units and Q orthogonal.

#: Largest displacement by a disturbance (m, rad).
WAY: Final = {"hand": 0.3, "joint": 1.0}
#: Largest distance of a hand from its shoulder if lengths are unknown (m).
LONGEST_ARM_M: Final = 1.2
#: Distances of the hand from the shoulder, in arm's lengths, above which a warning is given, and
#: the recording refused.
NEAR: Final = 1.05
FAR: Final = 1.3
#: Largest relative standard error of the inertia for a judgement.
LARGEST_ERROR: Final = 0.25
#: Standard errors beyond which a difference is significant.
SIGNIFICANT: Final = 4.5
#: The force before a disturbance may be what moves the hand if it exceeds this share of the force
#: in it.
OWN_FORCE: Final = 0.4
#: Angles between the axes of force and position above which a warning is given, and the recording
#: refused.
TURNED_DEG: Final = (1.5, 20.0)


@dataclass(frozen=True)
class _Inertia:
    """M (d, d) with the handle, its covariance, and measures of motion and force.

    `way`: displacement by the disturbances. `at_rest`: force before them, as a share of that in
    them, and `hz`: its main frequency.
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
        """Mean singular value of the inertia: its size, whatever its sign and axes."""
        return float(np.linalg.svd(self.matrix, compute_uv=False).mean())

    @property
    def error(self) -> float:
        """Standard error of an element."""
        return float(np.sqrt(np.diag(self.covariance).max()))

    @property
    def known(self) -> bool:
        """True if the smallest inertia is significant, so that directions are determined."""
        least = float(np.linalg.svd(self.matrix, compute_uv=False)[-1])
        return self.error < min(LARGEST_ERROR * self.mean, least / SIGNIFICANT)


def check_limb(recording: Recording) -> tuple[Finding, ...]:
    """Check units, reach, sign and axes by a quick fit of every condition.

    `recording`: with disturbances that return.
    Returns: "units", "reach", "force sign" (only if it is wrong) and "axes". Empty if no condition
    can be fitted; the estimate then gives a better message.
    """
    if recording.perturbation != "returning":
        return ()
    inertias = _inertias(recording)
    if not inertias:
        return ()
    checks = [_units(recording, inertias), _reach(recording)]
    precise = [inertia for inertia in inertias if inertia.known]
    if not precise:
        text = "inertia is not known well enough to tell the sign and axes of force and position"
        return (*checks, Finding("axes", "cannot tell", text))
    wrong = next((wrong for inertia in precise if (wrong := _exchanged(inertia)) is not None), None)
    return (*checks, _turned(_mean(precise)) if wrong is None else wrong)


def _mean(inertias: Sequence[_Inertia]) -> _Inertia:
    """Mean of several conditions: sensors have the same axes in all of them."""
    n = len(inertias)
    return replace(
        inertias[0],
        matrix=np.sum([inertia.matrix for inertia in inertias], axis=0) / n,
        covariance=np.sum([inertia.covariance for inertia in inertias], axis=0) / n**2,
        dof=sum(inertia.dof for inertia in inertias),
    )


def _inertias(recording: Recording) -> list[_Inertia]:
    """Quick fits of the conditions that can be fitted, or of all trials together if none can."""
    timing = disturbance_times(recording)
    for by in (DEFAULT_BY, ()):
        inertias = []
        for keys, rows in groups_of(recording, by):
            try:
                inertias.append(_inertia(cut_windows(recording, rows, timing), recording, keys))
            except ArmImpedanceError:
                continue
        if inertias:
            return inertias
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
    """Ratio of the force's rms before the onset to that after it, and its main frequency, Hz."""
    rest = window.lag_s <= 0
    if rest.sum() < FEWEST_AT_REST:
        return 0.0, 0.0
    noise, response = rms_at_rest(window)
    before = window.force[window.usable][:, rest]
    lines = np.fft.rfft(before - before.mean(axis=1, keepdims=True), 8 * before.shape[1], axis=1)
    power = (np.abs(lines) ** 2).sum(axis=(0, 2))
    hz = float(np.argmax(power)) * window.sample_rate_hz / (8 * before.shape[1])
    return noise / max(response, 1e-300), hz


def _units(recording: Recording, inertias: Sequence[_Inertia]) -> Finding:
    """Check the size of the inertia and of the movement against those possible for a limb."""
    kind, mass = recording.kind, recording.subject.mass_kg
    length = POSITION_UNIT[kind]
    if kind == "joint" and (turn := float(np.abs(recording.position).max())) > LARGEST_ANGLE_RAD:
        text = f"angles up to {turn:.4g} rad, more than a turn: are these degrees?"
        return Finding("units", "unusable", text)
    way = float(np.median([inertia.way for inertia in inertias]))
    if way > WAY[kind]:
        text = f"disturbances of {way:.3g} {length}: is the position in another unit than {length}?"
        return Finding("units", "unusable", text)
    mean = float(np.median([inertia.mean for inertia in inertias]))
    error = float(np.median([inertia.error for inertia in inertias]))
    if kind == "joint":
        size = check_joint_size("inertia", mean, error)
        return replace(size, verdict="unusable") if size.verdict == "warning" else size
    return check_hand_size(mean, error, mass)


def _reach(recording: Recording) -> Finding:
    """Check that the hand is within the arm's length of the shoulder."""
    if recording.kind != "hand" or recording.shoulder_m is None:
        return Finding("reach", "ok", "no shoulder to measure it from")
    upper, fore = recording.subject.upper_arm_m, recording.subject.forearm_hand_m
    both = upper is not None and fore is not None
    longest = upper + fore if both else LONGEST_ARM_M  # type: ignore[operator]
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
    """Finding on a wrong sign or exchanged axes in one condition; None if they are right."""
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
    """Check that the axes of force are not turned against those of position."""
    angle, error = _angle_deg(_orthogonal(mean.matrix)), _angle_error_deg(mean)
    certain = SIGNIFICANT * t_factor(mean.dof) / t_factor(np.inf) * error
    limit, refused = (max(angle_limit, certain) for angle_limit in TURNED_DEG)
    if angle <= limit:
        text = "inertia is symmetric and positive: force and position have the same axes"
        return Finding("axes", "ok", text, smallest=f"{limit:.1f} deg")
    text = (
        f"inertia is not symmetric: the axes of force are turned by {angle:.1f} deg (sd "
        f"{error:.1f}) against those of position, or the channels of a sensor are crossed; turn "
        "the force back, or calibrate the sensor"
    )
    return Finding("axes", "unusable" if angle > refused else "warning", text)


def _signed_permutations(d: int) -> Iterator[FloatArray]:
    """Yield all ways to exchange and mirror d axes, (d, d) each."""
    for order in permutations(range(d)):
        for signs in product((1.0, -1.0), repeat=d):
            yield np.eye(d)[list(order)] * np.array(signs)


def _difference(C: FloatArray) -> str:
    """Effect of a signed permutation on the axes, in words."""
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
    """Angle of a rotation (d, d), deg; 0 with one axis."""
    d = len(Q)
    if d == 1:
        return 0.0
    cosine = np.trace(Q) / 2 if d == 2 else (np.trace(Q) - 1) / 2
    return float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))


def _angle_error_deg(one: _Inertia) -> float:
    """Standard error of that angle, from the antisymmetric part relative to the mean inertia."""
    d = len(one.matrix)
    if d == 1:
        return 0.0
    swap = np.arange(d * d).reshape(d, d).T.ravel()
    A = (np.eye(d * d) - np.eye(d * d)[swap]) / 2
    spread = float(np.trace(A @ one.covariance @ A.T)) / 2
    return float(np.degrees(np.sqrt(spread) / one.mean))


#: Smallest share of the force explained by motion for a fit of M, B and K; largest number of trials
#: that are checked.
LEAST_COHERENCE: Final = 0.3
MOST_COHERENT: Final = 5


@once_per_record
def check_response(recording: Recording) -> tuple[Finding, ...]:
    """Check units, reach, sign and axes; then filter, delay, reflex, amplitude and lack of fit.

    Parameters
    ----------
    recording : Recording

    Returns
    -------
    tuple of Finding
        Empty if the perturbation is stochastic. Only the first half if it shows that the data are
        unusable.

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
    recording, detected = in_step(recording)
    departures = check_departures(recording)
    if detected is None:
        return (*limb, *departures)
    # the remaining delay after the detected one is removed is in its interval
    return (*limb, detected.finding, *(o for o in departures if o.name != detected.finding.name))


def check_driven(recording: Recording) -> list[Finding]:
    """Check that the force follows the motion well enough for a fit of force on motion.

    Only `estimate` fits so: `elbow` weights by noise, and detects the imposed channel.

    Returns: empty if the perturbation is not stochastic.
    """
    if recording.perturbation != "stochastic":
        return []
    findings = []
    imposed = recording.imposed in ("force", "torque")
    if imposed or any(name in recording.extra for name in perturbation_columns(recording.axes)):
        text = (
            "the device imposes the force: noise of the motion makes M, B and K too small here; "
            "`random` takes a hand and `elbow` a joint that is moved so"
        )
        findings.append(Finding("imposed", "warning", text))
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
        return findings
    text = f"motion explains {100 * np.mean(shared):.0f} % of the force from {low:g} to {high:g} Hz"
    if np.mean(shared) >= LEAST_COHERENCE:
        return [
            *findings,
            Finding("coherence", "ok", text, smallest=f"{100 * LEAST_COHERENCE:g} %"),
        ]
    hint = "nothing that a fit could use moved the limb there; of a joint `elbow` may tell more"
    return [*findings, Finding("coherence", "unusable", f"{text}: {hint}")]
