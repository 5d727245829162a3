"""The record less what varies is that of a limb at rest, and is doubted like one.

``tau - (B(t) - B) theta' - (K(t) - K) theta``, with the means B and K of a course, obeys the
equation of a constant joint as far as the course is right. Whatever `stationary` can doubt of one
(late answers, channels out of step, a stiffness that depends on the deflection) is looked for in
it: a course that is free to vary hides these, for it follows them where it can. What is found is
taken off the record before the course is estimated again; what a limb at rest would have for I, B
and K, and how surely, is in the bands.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.signal import savgol_filter

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import EstimationError, InputError, NotIdentifiableError
from armimpedance.core.findings import Finding
from armimpedance.joint.elbow.result import ElbowFit
from armimpedance.joint.elbow.samples import JointSamples
from armimpedance.joint.elbow.stationary.identify import identify_elbow
from armimpedance.joint.elbow.stationary.preparation import Cutoff
from armimpedance.joint.elbow.varying.data import VaryingData
from armimpedance.joint.elbow.varying.estimated import EstimatedCourse
from armimpedance.numerics.regression import t_factor

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

    Attributes
    ----------
    fit : ElbowFit or None
        None: no joint at rest could be fitted.
    why : str
        Then, why not.
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
                about = angle[here] - angle[here].mean()
                answer = reflex.K_r * about + reflex.B_r * velocity(about, samples.sample_rate_hz)
                torque[here] -= later(answer, reflex.delay_s * samples.sample_rate_hz)
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

    Parameters
    ----------
    samples : JointSamples
        As recorded.
    data : VaryingData
        Of the same samples.
    course : EstimatedCourse
    cutoff_hz : float or None
        As of `identify_varying`.
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
