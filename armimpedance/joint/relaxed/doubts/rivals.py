"""Compare causes that make a passive joint move unlike the model.

Each cause is an alternative model with one or two more parameters. Its gain is that of twice the
log likelihood, with a slow torque of muscles allowed for in both models. Causes are compared by
their gain less ``log N`` for every parameter (G. Schwarz, Ann. Stat. 6 (1978) 461-464). All causes
that explain as much as the best are reported. Slow torque is tested together with the best one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.special import chdtri

from armimpedance.core.arrays import FloatArray
from armimpedance.core.findings import Finding
from armimpedance.joint.relaxed.doubts.cause import LEVEL, SEEN, Cause, Inquiry
from armimpedance.joint.relaxed.doubts.evidence import (
    LATEST_S,
    RowEvidence,
    TorqueRows,
    WhiteFit,
    swing_evidence,
    torque_rows,
)
from armimpedance.joint.relaxed.doubts.film_causes import axes_of_file, clock_and_mass
from armimpedance.joint.relaxed.doubts.friction_laws import (
    BRISTLES,
    COULOMB,
    DRAG,
    STICKING,
    FrictionLaw,
)
from armimpedance.joint.relaxed.equations import Terms
from armimpedance.joint.relaxed.samples import PassiveSamples

#: Difference of twice the log likelihood up to which causes count as equal (odds of 20).
_EQUAL: Final = 6.0
#: Relative error of a law's size, since its columns follow the model's motion.
_OF_SIZE: Final = 0.05
#: Tried delays, s: first over the whole range, then finely about the best.
_COARSE_S: Final = np.linspace(-LATEST_S, LATEST_S, 41)
_FINE_S: Final = np.linspace(-0.005, 0.005, 21)


def cause_findings(samples: PassiveSamples, terms: Terms) -> tuple[Finding, ...]:
    """Findings on all causes that samples of a single joint can show.

    `samples`: with the limb's dynamics or a measured torque.
    `terms`: the rest angle is fitted in any case, since a wrong one would look like a cause.
    Raises EstimationError, NotIdentifiableError, InputError: the model cannot be fitted.
    """
    terms = replace(terms, rest_angle="free")
    if samples.hinges is not None:
        inquiry = _inquiry(terms, swing_evidence(samples, terms))
        causes = [
            _amplitude(samples, inquiry),
            *clock_and_mass(inquiry),
            axes_of_file(samples, inquiry),
        ]
    else:
        rows = torque_rows(samples, terms)
        inquiry = _inquiry(terms, *rows.evidence())
        causes = [
            _amplitude(samples, inquiry),
            _weight(inquiry),
            _inertia(inquiry),
            _skew(inquiry, rows),
        ]
    causes += [_damping(samples, inquiry), _friction(inquiry)]
    best = max(causes, key=lambda cause: (cause.seen, cause.worth))
    equal = [cause for cause in causes if cause.seen and best.worth - cause.worth <= _EQUAL]
    fits = (best.fit, best.alone) if best.seen else (inquiry.base, inquiry.alone)
    return (*(_judged(cause, equal) for cause in causes), _voluntary(*fits))


def _inquiry(terms: Terms, evidence: RowEvidence) -> Inquiry:
    fits = (evidence.fit(terms.columns, slow=slow) for slow in (True, False))
    return Inquiry(terms, evidence, *fits)


def _judged(cause: Cause, equal: Sequence[Cause]) -> Finding:
    """Finding on a cause, given those that explain the data best."""
    others = ", ".join(c.name for c in equal if c is not cause)
    if cause in equal:
        tie = f"; these data show the same of {others}" if others else ""
        return Finding(cause.name, "warning", cause.says + tie, cause.smallest)
    instead = f" (what looks like it is better explained by {others})" if cause.seen else ""
    return Finding(cause.name, "ok", cause.fine + instead, cause.smallest)


def _voluntary(fit: WhiteFit, alone: WhiteFit) -> Finding:
    """Finding on a slow torque besides the passive one."""
    name = "voluntary"
    smallest = f"a torque of {SEEN * alone.bump_sd_Nm:.2g} N m that comes and goes within .5 s"
    if alone.deviance - fit.deviance <= chdtri(1, LEVEL):
        return Finding(name, "ok", "no slow torque beside the passive one", smallest)
    return Finding(
        name,
        "warning",
        f"a slow torque that the motion does not make, some {fit.slow_Nm:.2g} N m: muscles were "
        "not silent, or something touched the limb; ask the person to relax, look at the EMG, "
        "leave such trials out",
        smallest,
    )


def _amplitude(samples: PassiveSamples, inquiry: Inquiry) -> Cause:
    """Stiffness that changes with the angle: terms of second and third order."""
    terms = inquiry.terms
    columns = ("C",) if terms.quadratic else ("K", "C")
    fit, alone, gain = inquiry.ask(columns)
    low, high = np.quantile(samples.q[:, 0], [0.05, 0.95])
    slope = np.array([2 * (high - low), 3 * (high**2 - low**2)])[-len(columns) :]
    size, spread = fit.values[-len(columns) :], fit.covariance[-len(columns) :, -len(columns) :]
    change, error = float(slope @ size), float(np.sqrt(slope @ spread @ slope))
    hint = "" if terms.quadratic else "; --quadratic fits the part that is even"
    return Cause(
        "amplitude",
        gain,
        len(columns),
        inquiry.price,
        f"the stiffness changes with the angle, by {change:+.2g} +- {error:.1g} N m/rad from end "
        "to end of the motion: k, h, f and q_r are those of a straight line through a "
        f"curve{hint}, and smaller swings show less of it",
        "the stiffness is the same all over the motion",
        f"a change of {SEEN * error:.2g} N m/rad from end to end of the motion",
        fit,
        alone,
    )


def _damping(samples: PassiveSamples, inquiry: Inquiry) -> Cause:
    """Damping by the square of the velocity."""
    law = _Tried(DRAG, *inquiry.ask(DRAG.columns))
    h, size, error = float(law.fit.values[1]), law.size, law.error
    fast = float(np.quantile(np.abs(samples.qd[:, 0]), 0.95))
    return Cause(
        "damping",
        law.gain,
        1,
        inquiry.price,
        f"{DRAG.says}, {size:.3g} +- {error:.1g} N m s^2/rad^2: h and f are those of a straight "
        f"line through a curve; h is then {h:.3g} N m s/rad at rest and {h + 2 * size * fast:.3g} "
        f"at {fast:.2g} rad/s",
        "damping is in proportion to the velocity",
        f"{SEEN * error:.2g} N m s^2/rad^2",
        law.fit,
        law.alone,
    )


def _friction(inquiry: Inquiry) -> Cause:
    """Another law of dry friction: Coulomb if the model has none, larger at rest, or a
    bristle's."""
    dry = inquiry.terms.friction
    laws = (*STICKING, *BRISTLES) if dry else (COULOMB,)
    tried = [_Tried(law, *inquiry.ask(law.columns)) for law in laws]
    more = [candidate for candidate in tried if candidate.size > 0]
    best = max(
        more or tried,
        key=lambda candidate: candidate.gain - inquiry.price * len(candidate.law.columns),
    )
    says = best.law.says if more else "it is smaller where the motion turns than elsewhere"
    return Cause(
        "friction",
        best.gain,
        # the law's size, and its scale if there is a choice
        len(best.law.columns) + dry,
        inquiry.price,
        f"{says}, {best.size:.2g} +- {best.error:.1g} N m: f is that of another law; k is then "
        f"{best.fit.values[0]:.3g} N m/rad, h {best.fit.values[1]:.3g} N m s/rad",
        "dry friction is as its model has it",
        f"{SEEN * best.error:.2g} N m",
        best.fit,
        best.alone,
    )


@dataclass(frozen=True)
class _Tried:
    """A law of friction and the fits with it."""

    law: FrictionLaw
    fit: WhiteFit
    alone: WhiteFit
    gain: float

    @property
    def size(self) -> float:
        """Torque of the law, N m."""
        return float(self.fit.values[-len(self.law.columns) :].sum())

    @property
    def error(self) -> float:
        """Standard error of the torque, N m."""
        own = slice(-len(self.law.columns), None)
        of_fit = np.sqrt(self.fit.covariance[own, own].sum())
        return float(np.hypot(of_fit, _OF_SIZE * self.size))


def _weight(inquiry: Inquiry) -> Cause:
    """The limb's weight, for any zero of the angle."""
    fit, alone, gain = inquiry.ask(["cos", "sin"])
    size, error = _length(fit.values[-2:], fit.covariance[-2:, -2:])
    return Cause(
        "weight",
        gain,
        2,
        inquiry.price,
        f"the torque holds a part that goes with sine and cosine of the angle, {size:.2g} +- "
        f"{error:.1g} N m: the limb's weight was left in; record the limb at rest at several "
        f"angles and take that off (k is then {fit.values[0]:.3g} N m/rad)",
        "no weight is left in the torque",
        f"{SEEN * error:.2g} N m",
        fit,
        alone,
    )


def _inertia(inquiry: Inquiry) -> Cause:
    """The inertia of the limb or the device."""
    fit, alone, gain = inquiry.ask(["inertia"])
    size, error = float(fit.values[-1]), float(np.sqrt(fit.covariance[-1, -1]))
    return Cause(
        "inertia",
        gain,
        1,
        inquiry.price,
        f"the torque holds a part that goes with the acceleration, {size:.3g} +- {error:.1g} "
        "kg m^2: inertia was left in, or too much taken off; move slowly, or take off that of "
        f"limb and device (k is then {fit.values[0]:.3g} N m/rad)",
        "no inertia is left in the torque",
        f"{SEEN * error:.2g} kg m^2",
        fit,
        alone,
    )


def _skew(inquiry: Inquiry, rows: TorqueRows) -> Cause:
    """Delay of the torque after the angle."""
    columns = inquiry.terms.columns
    late, _, _ = _best_lateness(rows, columns, _COARSE_S)
    late, fit, alone = _best_lateness(rows, columns, late + _FINE_S)
    error = _error_of_lateness(rows, columns, late, fit.deviance)
    error = float(np.hypot(error, rows.reversal_error_s))
    gain = min(inquiry.base.deviance - fit.deviance, (late / error) ** 2)
    return Cause(
        "skew",
        gain,
        1,
        inquiry.price,
        f"the torque is {1e3 * late:+.1f} +- {1e3 * error:.1g} ms late on the angle: record both "
        "on one clock, or move one of them by that much "
        f"(h is then {fit.values[1]:.3g} N m s/rad)",
        "angle and torque are in step",
        f"{1e3 * SEEN * error:.2g} ms",
        fit,
        alone,
    )


def _best_lateness(
    rows: TorqueRows, columns: Sequence[str], tried: FloatArray
) -> tuple[float, WhiteFit, WhiteFit]:
    """Likeliest delay of those tried, its fit, and that without slow torque."""
    inside = np.unique(np.clip(tried, -LATEST_S, LATEST_S))
    evidence = rows.evidence(inside.tolist(), more=False)
    fits = [rows_late.fit(columns) for rows_late in evidence]
    best = int(np.argmin([fit.deviance for fit in fits]))
    return float(inside[best]), fits[best], evidence[best].fit(columns, slow=False)


def _error_of_lateness(
    rows: TorqueRows, columns: Sequence[str], late: float, deviance: float
) -> float:
    """Standard error from the rise of the deviance 2 ms before and after."""
    step = 0.002
    sides = rows.evidence([late - step, late + step], more=False)
    rise = float(np.mean([rows_late.fit(columns).deviance for rows_late in sides])) - deviance
    return float(step / np.sqrt(rise)) if rise > 0 else step


def _length(vector: FloatArray, covariance: FloatArray) -> tuple[float, float]:
    """Length of a vector (2,) and its standard error."""
    length = float(np.linalg.norm(vector))
    along = vector / length if length > 0 else np.array([1.0, 0.0])
    return length, float(np.sqrt(along @ covariance @ along))
