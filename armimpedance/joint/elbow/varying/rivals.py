"""Compare a course that varies with a torque of the subject's own, by their likelihoods.

A course that is free to vary can follow a slow torque v of the subject, since ``K(t) theta`` and v
are both slow. They differ because v continues while the joint stands still. The marginal
likelihood, with the courses integrated out, makes use of this (`smoother.negative_log`).
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.signal import savgol_filter

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import EstimationError, InputError, NotIdentifiableError
from armimpedance.core.findings import Finding
from armimpedance.joint.elbow.doubts.pathway import ReflexArc, behind
from armimpedance.joint.elbow.elbow_result import ElbowFit
from armimpedance.joint.elbow.samples import JointSamples
from armimpedance.joint.elbow.stationary.identify import identify_elbow
from armimpedance.joint.elbow.stationary.preparation import Cutoff
from armimpedance.joint.elbow.varying.beginning import (
    Beginning,
    own_torque,
    residual_of,
    with_own_torque,
)
from armimpedance.joint.elbow.varying.data import VaryingData
from armimpedance.joint.elbow.varying.equation import start
from armimpedance.joint.elbow.varying.method import EstimatedCourse
from armimpedance.joint.elbow.varying.smoother import SmoothedCourse, smooth
from armimpedance.numerics.regression import t_factor

#: Start intensities (s^-1.5) of B and K for the search for a torque of the subject's own.
FIRST_INTENSITIES: Final = (0.3, 3.0)
#: White torque noise above this multiple of the sensor's is a torque of the subject's own.
MUCH_NOISE: Final = 3.0
#: Difference of log likelihood up to which both explanations are kept.
EQUAL: Final = 15.0
#: Factor by which the subject's torque may be slower than it seems, since a course can follow the
#: slowest part of it.
SLOWER: Final = 4.0
#: Detection limit of the subject's own torque, over the torque's noise.
FLOORS: Final = 5.0


@dataclass(frozen=True, eq=False)
class ExplainedCourse:
    """Course of the likelier explanation, and others that its bands must cover.

    `data`: with the subject's own torque of this explanation.
    `made`: the course.
    `others`: with a slower torque of the subject, which a short record does not exclude; and by the
    other explanation, if that is about as likely.
    """

    data: VaryingData
    made: SmoothedCourse
    others: tuple[SmoothedCourse, ...]
    finding: Finding


def explained(begun: Beginning, tick: Callable[[], None]) -> ExplainedCourse:
    """Smooth with and, if the residuals require it, without a torque of the subject's own.

    Raises EstimationError: no explanation converges.
    """
    results: list[tuple[float, VaryingData, SmoothedCourse]] = []
    first: EstimationError | None = None
    for attempt in _candidates(begun, tick):
        # levels found together with the subject's torque are near; else the search starts wide
        near = attempt.levels if attempt.data.own.order else None
        try:
            smoothed = smooth(attempt.data, attempt.course, near=near, tick=tick)
        except EstimationError as error:
            first = first or error
            continue
        results.append((_log_likelihood(attempt.data, smoothed), attempt.data, smoothed))
    if not results:
        raise first or EstimationError("B(t) and K(t) do not settle")
    results.sort(key=_likeliest, reverse=True)
    best, data, smoothed = results[0]
    alike = [
        attempt
        for attempt in results[1:]
        if bool(attempt[1].own.order) != bool(data.own.order) and abs(best - attempt[0]) < EQUAL
    ]
    others = [attempt[2] for attempt in alike[:1]]
    if data.own.order:
        slow = replace(data, own=data.own.slower(SLOWER))
        with suppress(EstimationError):
            others.append(smooth(slow, smoothed.course, smoothed.levels, tick=tick))
    finding = _finding(data, smoothed, alike[0][1] if alike else None)
    if finding.verdict == "ok" and begun.unexplained:
        finding = replace(finding, verdict="warning", message=begun.unexplained)
    return ExplainedCourse(data, smoothed, tuple(others), finding)


def beside_rivals(
    course: EstimatedCourse, begun: Beginning, tick: Callable[[], None]
) -> EstimatedCourse:
    """Add the test for the subject's own torque to a course of a method without such a test.

    If there may be one, the bands are widened to cover the smoother's explanations too.
    """
    try:
        comparison = explained(begun, tick)
    except EstimationError as error:
        message = f"a torque of the subject's own could not be looked for: {error}"
        return replace(
            course, checks=(*course.checks, Finding("voluntary", "cannot tell", message))
        )
    course = replace(course, checks=(*course.checks, comparison.finding))
    if comparison.finding.verdict == "ok":
        return course
    sd_B, sd_K = course.sd_B, course.sd_K
    for rival in (comparison.made, *comparison.others):
        at = course.at
        sd_B = hull(course.B, sd_B, rival.course.B[at], rival.sd_B[at])
        sd_K = hull(course.K, sd_K, rival.course.K[at], rival.sd_K[at])
    return replace(course, sd_B=sd_B, sd_K=sd_K)


def hull(value: FloatArray, sd: FloatArray, other: FloatArray, other_sd: FloatArray) -> FloatArray:
    """Standard errors about `value` whose band reaches as far as that of another estimate."""
    z = t_factor(np.inf)
    return np.maximum(sd, np.abs(other - value) / z + other_sd)


def _candidates(begun: Beginning, tick: Callable[[], None]) -> list[Beginning]:
    """The given start, and alternatives with a torque of the subject's own if it has none."""
    constant = start(begun.data)
    if begun.data.own.order or not own_torque(residual_of(begun.data, constant)).order:
        return [begun]
    rivals = [
        with_own_torque(begun.data, constant, intensity, tick) for intensity in FIRST_INTENSITIES
    ]
    return [begun, *(rival for rival in rivals if rival is not None and rival.data.own.order)]


def _likeliest(candidate: tuple[float, VaryingData, SmoothedCourse]) -> tuple[bool, float]:
    """Sort key of explanations: those with more white noise than the sensor has come last."""
    value, data, smoothed = candidate
    return bool(data.own.order) or smoothed.levels.torque <= MUCH_NOISE, value


def _log_likelihood(data: VaryingData, smoothed: SmoothedCourse) -> float:
    """Marginal log likelihood, comparable between processes of the subject's torque."""
    own = data.own
    if not own.order:
        return smoothed.log_likelihood
    A = own.operator(np.diff(data.offsets))
    # density of v: det (A / sd), A lower triangular
    normal = float(np.log(A[0]).sum()) - len(data.angle) * float(np.log(own.sd))
    return smoothed.log_likelihood + normal - own.order * float(np.log(len(data.angle))) / 2


def _finding(data: VaryingData, fit: SmoothedCourse, rival: VaryingData | None) -> Finding:
    floor = float(np.sqrt((data.sd_torque**2).mean()))
    smallest = f"{FLOORS * floor:.2g} N m"
    rms = max(data.own.rms, 0.0 if rival is None else rival.own.rms)
    if rival is not None and rms > FLOORS * floor:
        message = (
            f"a course that varies and a torque of the subject's own ({rms:.2g} N m, rms) explain "
            "the record alike: the bands hold both"
        )
        return Finding("voluntary", "cannot tell", message, smallest)
    if data.own.order and rms > floor:
        message = (
            f"the record holds a torque of {data.own.rms:.2g} N m (rms) that I, B and K do not "
            "explain: the subject's own, or a reflex, channels out of step, a stiffness that "
            "depends on the deflection (`elbow` on a part where nothing changes tells which); the "
            "bands allow for an own one that goes on alike, but where K changes at once, or with "
            "the torque, they may miss it; ask the subject to relax, or average over trials"
        )
        return Finding("voluntary", "warning", message, smallest)
    if fit.levels.torque > MUCH_NOISE:
        message = (
            f"the residuals are {fit.levels.torque:.1f} times the torque sensor's noise, and no "
            "process of the subject's own torque describes them: such a torque none the less, or a "
            "joint that is not of second order (`elbow` on a part where nothing changes tells "
            "which); B and K are not to be trusted here, and their bands rest on white noise; ask "
            "the subject to relax"
        )
        return Finding("voluntary", "warning", message, smallest)
    return Finding("voluntary", "ok", "no torque of the subject's own is seen", smallest)


# The record without its variation is that of a constant joint, and is tested like one.
#
# ``tau - (B(t) - B) theta' - (K(t) - K) theta``, with the means B and K of a course, obeys the
# equation of a constant joint if the course is right. It is tested as in `stationary` for late
# answers, channels out of step, and a stiffness that depends on the deflection. A course that is
# free to vary would hide these, because it follows them. A detected effect is removed from the
# record before the course is estimated again. The bands include the I, B and K of the constant
# joint, and their uncertainty.

#: Effects that are tested.
NAMES: Final = ("reflex", "skew", "amplitude")
#: Effects that can be removed from the record.
_TAKEN_OFF: Final = ("reflex", "skew")
#: Half of the window in which the velocity is computed from the angle, s.
_HALF_S: Final = 6e-3
_CUBIC: Final = 3


@dataclass(frozen=True, eq=False)
class AtRest:
    """Fit of a constant joint to the record without its variation.

    `fit`: None if no constant joint could be fitted.
    `why`: the reason for that.
    """

    fit: ElbowFit | None
    why: str = ""

    @property
    def checks(self) -> tuple[Finding, ...]:
        """Findings on late answers, skew and amplitude, from the record without its variation."""
        if self.fit is None:
            message = f"late answers, skew and amplitude could not be looked for: {self.why}"
            return (Finding("reflex", "cannot tell", message),)
        return tuple(c for c in self.fit.checks if c.name in NAMES)

    @property
    def named(self) -> tuple[str, ...]:
        """Names of the detected effects."""
        return tuple(c.name for c in self.checks if c.verdict == "warning")

    @property
    def corrects(self) -> bool:
        """True if an effect was detected that can be removed."""
        return any(name in _TAKEN_OFF for name in self.named)

    def corrected(self, samples: JointSamples) -> JointSamples:
        """Samples with the detected skew and late answer removed."""
        if self.fit is None:
            return samples
        torque, angle = np.array(samples.torque), np.array(samples.angle)
        reflex, skew = self.fit.details["reflex"], self.fit.details["skew"]
        lag = skew.value_s if "skew" in self.named else 0.0
        for row in range(samples.n_trials):
            part = samples.samples_of(row)
            measured = samples.angle[part]
            angle[part] = later(measured, -lag * samples.sample_rate_hz)
            if "reflex" in self.named:
                centred, rate = angle[part] - angle[part].mean(), samples.sample_rate_hz
                likeliest = reflex.likeliest
                answer = likeliest.K_r * centred + likeliest.B_r * velocity(centred, rate)
                torque[part] -= behind(
                    answer, ReflexArc(likeliest.delay_s, likeliest.muscle_s), rate
                )
        return replace(samples, torque=torque, angle=angle)

    def beside(self, course: EstimatedCourse) -> EstimatedCourse:
        """Widen the course's bands by I, B and K of the constant joint.

        If an effect was detected, the uncertainty of the constant joint's fit is added. If none
        was, and the means differ significantly from the constant I, B, K, the bands cover the
        difference.
        """
        if self.fit is None:
            return replace(course, checks=(*course.checks, *self.checks))
        p = self.fit.parameters
        means = np.array([course.inertia, course.B.mean(), course.K.mean()])
        own = np.array([course.sd_inertia, np.median(course.sd_B), np.median(course.sd_K)])
        gap = np.abs(means - p.values)
        if self.named:
            more = np.hypot(p.sd, gap)
        else:
            allowed = t_factor(p.dof) * p.sd + t_factor(np.inf) * own
            more = np.where(gap > allowed, gap, 0.0)
        return replace(
            course,
            sd_inertia=float(np.hypot(course.sd_inertia, more[0])),
            sd_B=np.hypot(course.sd_B, more[1]),
            sd_K=np.hypot(course.sd_K, more[2]),
            checks=(*course.checks, *self.checks),
        )


def at_rest(
    samples: JointSamples, data: VaryingData, course: EstimatedCourse, cutoff_hz: float | None
) -> AtRest:
    """Fit a constant joint to the record without the variation of a course.

    `samples`: as recorded.
    `data`: of the same samples.
    `cutoff_hz`: as for `identify_varying`.
    """
    torque = np.array(samples.torque)
    variation = course.B - course.B.mean(), course.K - course.K.mean()
    trial = data.trial_of[course.at]
    for row in range(samples.n_trials):
        part, points = samples.samples_of(row), trial == row
        at = (course.at[points] - data.offsets[row]) * data.every
        angle = samples.angle[part] - samples.angle[part].mean()
        B, K = (np.interp(np.arange(len(angle)), at, values[points]) for values in variation)
        torque[part] -= B * velocity(angle, samples.sample_rate_hz) + K * angle
    try:
        edge: Cutoff = "auto" if cutoff_hz is None else cutoff_hz
        return AtRest(identify_elbow(replace(samples, torque=torque), cutoff_hz=edge))
    except (InputError, NotIdentifiableError, EstimationError) as error:
        return AtRest(None, f"{error}".split(";")[0])


def velocity(angle: FloatArray, rate_hz: float) -> FloatArray:
    """Velocity (S,), from the slope of a cubic through neighbouring samples, per second."""
    width = max(2 * round(_HALF_S * rate_hz) + 1, _CUBIC + 2)
    return np.asarray(savgol_filter(angle, width, _CUBIC, deriv=1, delta=1 / rate_hz))


def later(signal: FloatArray, samples: float) -> FloatArray:
    """Signal (S,) delayed by so many samples; its first and last values are held."""
    now = np.arange(len(signal))
    return np.asarray(np.interp(now - samples, now, signal))
