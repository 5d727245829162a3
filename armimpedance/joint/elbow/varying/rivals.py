"""A course that varies, or a torque of the subject's own? Both are fitted, the likelihood decides.

A course that is free to vary follows a slow torque v as well as it follows itself: ``K(t) theta``
and v are both slow. What tells them apart is that v goes on where the joint stands still, and the
marginal likelihood, the courses integrated out, knows that (`smoother.negative_log`).
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

#: Intensities (s^-1.5) of B and K from which a torque of the subject's own is looked for.
FIRST_INTENSITIES: Final = (0.3, 3.0)
#: White torque noise above this many times the sensor's is a torque of the subject's own.
MUCH_NOISE: Final = 3.0
#: Difference of log likelihood within which both explanations stand.
EQUAL: Final = 15.0
#: Times by which the subject's slowest torque may be slower than it seems: a course takes the
#: slowest part of it for its own.
SLOWER: Final = 4.0
#: Torque of the subject's own over the torque's noise that is seen.
FLOORS: Final = 5.0


@dataclass(frozen=True, eq=False)
class ExplainedCourse:
    """The course by the likelier explanation, and others that its bands must hold as well.

    `data`: with the subject's own torque of this explanation.
    `others`: by a torque of the subject's own that is slower, which so short a record does not
    exclude; by the other explanation, where that is about as likely.
    """

    data: VaryingData
    made: SmoothedCourse
    others: tuple[SmoothedCourse, ...]
    finding: Finding


def explained(begun: Beginning, tick: Callable[[], None]) -> ExplainedCourse:
    """Smooth with and, where the residuals ask for it, without a torque of the subject's own.

    Raises EstimationError: no explanation settles.
    """
    found: list[tuple[float, VaryingData, SmoothedCourse]] = []
    first: EstimationError | None = None
    for one in _candidates(begun, tick):
        # levels chosen together with the subject's torque are near; else the search begins wide
        near = one.levels if one.data.own.order else None
        try:
            made = smooth(one.data, one.course, near=near, tick=tick)
        except EstimationError as error:
            first = first or error
            continue
        found.append((_log_likelihood(one.data, made), one.data, made))
    if not found:
        raise first or EstimationError("B(t) and K(t) do not settle")
    found.sort(key=_likeliest, reverse=True)
    best, data, made = found[0]
    alike = [
        one
        for one in found[1:]
        if bool(one[1].own.order) != bool(data.own.order) and abs(best - one[0]) < EQUAL
    ]
    others = [one[2] for one in alike[:1]]
    if data.own.order:
        slow = replace(data, own=data.own.slower(SLOWER))
        with suppress(EstimationError):
            others.append(smooth(slow, made.course, made.levels, tick=tick))
    finding = _finding(data, made, alike[0][1] if alike else None)
    if finding.verdict == "ok" and begun.unexplained:
        finding = replace(finding, verdict="warning", message=begun.unexplained)
    return ExplainedCourse(data, made, tuple(others), finding)


def beside_rivals(
    course: EstimatedCourse, begun: Beginning, tick: Callable[[], None]
) -> EstimatedCourse:
    """A course of a method that does not judge the subject's own torque, with that judgement.

    Where there may be one, its bands hold those of the smoother's explanations too.
    """
    try:
        both = explained(begun, tick)
    except EstimationError as error:
        said = f"a torque of the subject's own could not be looked for: {error}"
        return replace(course, checks=(*course.checks, Finding("voluntary", "cannot tell", said)))
    course = replace(course, checks=(*course.checks, both.finding))
    if both.finding.verdict == "ok":
        return course
    sd_B, sd_K = course.sd_B, course.sd_K
    for other in (both.made, *both.others):
        at = course.at
        sd_B = hull(course.B, sd_B, other.course.B[at], other.sd_B[at])
        sd_K = hull(course.K, sd_K, other.course.K[at], other.sd_K[at])
    return replace(course, sd_B=sd_B, sd_K=sd_K)


def hull(value: FloatArray, sd: FloatArray, other: FloatArray, other_sd: FloatArray) -> FloatArray:
    """Standard errors about `value` whose band reaches as far as that of another estimate."""
    z = t_factor(np.inf)
    return np.maximum(sd, np.abs(other - value) / z + other_sd)


def _candidates(begun: Beginning, tick: Callable[[], None]) -> list[Beginning]:
    """What began, and rivals with a torque of the subject's own where that is not in it."""
    constant = start(begun.data)
    if begun.data.own.order or not own_torque(residual_of(begun.data, constant)).order:
        return [begun]
    rivals = [with_own_torque(begun.data, constant, each, tick) for each in FIRST_INTENSITIES]
    return [begun, *(one for one in rivals if one is not None and one.data.own.order)]


def _likeliest(found: tuple[float, VaryingData, SmoothedCourse]) -> tuple[bool, float]:
    """Order of explanations: one that needs white noise the sensor has not got comes last."""
    value, data, made = found
    return bool(data.own.order) or made.levels.torque <= MUCH_NOISE, value


def _log_likelihood(data: VaryingData, made: SmoothedCourse) -> float:
    """Marginal log likelihood, comparable between processes of the subject's torque."""
    own = data.own
    if not own.order:
        return made.log_likelihood
    A = own.operator(np.diff(data.offsets))
    # density of v: det (A / sd), A lower triangular
    normal = float(np.log(A[0]).sum()) - len(data.angle) * float(np.log(own.sd))
    return made.log_likelihood + normal - own.order * float(np.log(len(data.angle))) / 2


def _finding(data: VaryingData, made: SmoothedCourse, other: VaryingData | None) -> Finding:
    floor = float(np.sqrt((data.sd_torque**2).mean()))
    smallest = f"{FLOORS * floor:.2g} N m"
    rms = max(data.own.rms, 0.0 if other is None else other.own.rms)
    if other is not None and rms > FLOORS * floor:
        said = (
            f"a course that varies and a torque of the subject's own ({rms:.2g} N m, rms) explain "
            "the record alike: the bands hold both"
        )
        return Finding("voluntary", "cannot tell", said, smallest)
    if data.own.order and rms > floor:
        said = (
            f"the record holds a torque of {data.own.rms:.2g} N m (rms) that I, B and K do not "
            "explain: the subject's own, or a reflex, channels out of step, a stiffness that "
            "depends on the deflection (`elbow` on a part where nothing changes tells which); the "
            "bands allow for an own one that goes on alike, but where K changes at once, or with "
            "the torque, they may miss it; ask the subject to relax, or average over trials"
        )
        return Finding("voluntary", "warning", said, smallest)
    if made.levels.torque > MUCH_NOISE:
        said = (
            f"the residuals are {made.levels.torque:.1f} times the torque sensor's noise, and no "
            "process of the subject's own torque describes them: such a torque none the less, or a "
            "joint that is not of second order (`elbow` on a part where nothing changes tells "
            "which); B and K are not to be trusted here, and their bands rest on white noise; ask "
            "the subject to relax"
        )
        return Finding("voluntary", "warning", said, smallest)
    return Finding("voluntary", "ok", "no torque of the subject's own is seen", smallest)


# The record less what varies is that of a limb at rest, and is doubted like one.
#
# ``tau - (B(t) - B) theta' - (K(t) - K) theta``, with the means B and K of a course, obeys the
# equation of a constant joint as far as the course is right. Whatever `stationary` can doubt of one
# (late answers, channels out of step, a stiffness that depends on the deflection) is looked for in
# it: a course that is free to vary hides these, for it follows them where it can. What is found is
# taken off the record before the course is estimated again; what a limb at rest would have for I, B
# and K, and how surely, is in the bands.

#: What is looked for.
NAMES: Final = ("reflex", "skew", "amplitude")
#: What can be taken off the record.
_TAKEN_OFF: Final = ("reflex", "skew")
#: Half of the window in which the velocity is read off the angle, s.
_HALF_S: Final = 6e-3
_CUBIC: Final = 3


@dataclass(frozen=True, eq=False)
class AtRest:
    """A constant joint's fit to the record less what varies.

    `fit`: None: no joint at rest could be fitted.
    `why`: then, why not.
    """

    fit: ElbowFit | None
    why: str = ""

    @property
    def checks(self) -> tuple[Finding, ...]:
        """What was doubted, each with the word that it is of the record less what varies."""
        if self.fit is None:
            said = f"late answers, skew and amplitude could not be looked for: {self.why}"
            return (Finding("reflex", "cannot tell", said),)
        return tuple(c for c in self.fit.checks if c.name in NAMES)

    @property
    def named(self) -> tuple[str, ...]:
        """What was found."""
        return tuple(c.name for c in self.checks if c.verdict == "warning")

    @property
    def corrects(self) -> bool:
        """Whether something was found that can be taken off."""
        return any(name in _TAKEN_OFF for name in self.named)

    def corrected(self, samples: JointSamples) -> JointSamples:
        """The samples in step and without the late answer, as far as these were found."""
        if self.fit is None:
            return samples
        torque, angle = np.array(samples.torque), np.array(samples.angle)
        reflex, skew = self.fit.details["reflex"], self.fit.details["skew"]
        lag = skew.value_s if "skew" in self.named else 0.0
        for row in range(samples.n_trials):
            here = samples.samples_of(row)
            measured = samples.angle[here]
            angle[here] = later(measured, -lag * samples.sample_rate_hz)
            if "reflex" in self.named:
                about, rate = angle[here] - angle[here].mean(), samples.sample_rate_hz
                one = reflex.likeliest
                answer = one.K_r * about + one.B_r * velocity(about, rate)
                torque[here] -= behind(answer, ReflexArc(one.delay_s, one.muscle_s), rate)
        return replace(samples, torque=torque, angle=angle)

    def beside(self, course: EstimatedCourse) -> EstimatedCourse:
        """The course, its bands wide enough for what the limb at rest says of I, B and K.

        What was found is as uncertain as it is there. Where nothing was found, and the means
        differ from I, B, K at rest by more than both allow, the bands hold the difference.
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
    """Fit a constant joint to the record less what varies of a course.

    `samples`: as recorded.
    `data`: of the same samples.
    `cutoff_hz`: as of `identify_varying`.
    """
    torque = np.array(samples.torque)
    about = course.B - course.B.mean(), course.K - course.K.mean()
    trial = data.trial_of[course.at]
    for row in range(samples.n_trials):
        here, mine = samples.samples_of(row), trial == row
        at = (course.at[mine] - data.offsets[row]) * data.every
        angle = samples.angle[here] - samples.angle[here].mean()
        B, K = (np.interp(np.arange(len(angle)), at, values[mine]) for values in about)
        torque[here] -= B * velocity(angle, samples.sample_rate_hz) + K * angle
    try:
        edge: Cutoff = "auto" if cutoff_hz is None else cutoff_hz
        return AtRest(identify_elbow(replace(samples, torque=torque), cutoff_hz=edge))
    except (InputError, NotIdentifiableError, EstimationError) as error:
        return AtRest(None, f"{error}".split(";")[0])


def velocity(angle: FloatArray, rate_hz: float) -> FloatArray:
    """Slope of the cubic through a few samples about each of (S,), per second."""
    width = max(2 * round(_HALF_S * rate_hz) + 1, _CUBIC + 2)
    return np.asarray(savgol_filter(angle, width, _CUBIC, deriv=1, delta=1 / rate_hz))


def later(signal: FloatArray, samples: float) -> FloatArray:
    """(S,) as it was so many samples ago, its first and last value held."""
    now = np.arange(len(signal))
    return np.asarray(np.interp(now - samples, now, signal))
