"""The verb of this folder: an estimate, held against what its model leaves out.

Judged by what it does to I, B and K: an answer of a given size may cost nothing at a broad band
and everything at a narrow one. What is seen is estimated beside them, what cannot be told widens
their intervals, and both are said.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray
from armimpedance.core.errors import EstimationError, InputError
from armimpedance.core.findings import Finding
from armimpedance.joint.elbow.doubts.contest import (
    PARTS,
    RUBS,
    STIFFENS,
    Bent,
    Contest,
    bent,
    contest,
    stiffening,
)
from armimpedance.joint.elbow.doubts.findings import (
    SURE,
    Amplitude,
    Hidden,
    LateAnswer,
    Lateness,
    Reflex,
    band_finding,
    findings,
    unlike_finding,
)
from armimpedance.joint.elbow.doubts.kinds import Kind
from armimpedance.joint.elbow.doubts.posterior import Posterior, half_widths, posterior
from armimpedance.joint.elbow.doubts.record import doubted
from armimpedance.joint.elbow.stationary.band import Band, explained
from armimpedance.joint.elbow.stationary.estimate import Estimate
from armimpedance.joint.elbow.stationary.instruments import driver_of
from armimpedance.joint.elbow.stationary.preparation import PreparedSamples
from armimpedance.numerics.regression import Parameters, t_factor

#: What the record leaves less likely than this is out.
UNLIKELY: Final = 1 - SURE
#: A residual below this part of the motion is rounding.
ENOUGH: Final = 1e-6
#: Smaller changes of I, B, K are of no consequence.
SMALL: Final = 5e-3
#: Degrees of freedom of intervals that rest on the residual's spectrum: each of its values holds
#: some sixteen squares, and every parameter draws on several.
_DOF: Final = 30.0
_NORMAL: Final = 1.959964
#: A reflex, a skew or a bend moves the inertia by less than this factor: it is known the best.
OTHER_INERTIA: Final = 1.5
#: Half of the deviance that an answer or a skew must be worth to be seen, about.
_SEEN: Final = 6.0


@dataclass(frozen=True, eq=False)
class Doubt:
    """An estimate after its doubts.

    `parameters`: of the limb that the record asks for.
    `allowing`: the same were there a late answer or a skew that it does not exclude.
    `checks`: "reflex", "skew", "amplitude".
    `seen`: the limb has more than I, B and K: what they leave is explained.
    `chance`: probability that chance alone departs so far from I, B and K over frequency; 0 where
    this was not asked.
    """

    parameters: Parameters
    allowing: Parameters
    checks: tuple[Finding, ...]
    seen: bool = False
    chance: float = 0.0
    details: Mapping[str, Any] = field(default_factory=dict)


def doubt(estimate: Estimate, prepared: PreparedSamples, band: Band) -> Doubt:
    """Hold I, B, K against late answers, channels out of step, and amplitude.

    `band`: the whole record, weighed as the estimate was.
    """
    own = estimate.parameters
    if explained(band, own.values) > 1 - ENOUGH:
        return Doubt(own, own, _nothing_left())
    try:
        record = doubted(prepared, band)
        driver = driver_of(record.band)
        made = contest(record, driver, own.values)
        deflection = float(np.std(prepared.angle))
        curved = bent(made, deflection)
        if curved.terms:
            again = contest(record, driver, own.values, curved.terms)
            if _matters(made, again, own):
                made = again
        found = _concluded(own, made, curved, deflection, prepared.source.sample_rate_hz)
        frequency = np.concatenate([bins.frequency_hz for bins in record.band.trials])
        if _another(own, found.parameters):
            return _unlike(own, found)
        return _over_bands(found, made.excess_over_bands(frequency))
    except (InputError, EstimationError, np.linalg.LinAlgError) as error:
        return Doubt(own, own, (_cannot(error),))


def _another(own: Parameters, found: Parameters) -> bool:
    """Whether what was added took the place of the limb, instead of standing beside it."""
    change = found.values / own.values
    return bool((change <= 0).any() or abs(np.log(change[0])) > np.log(OTHER_INERTIA))


def _unlike(own: Parameters, found: Doubt) -> Doubt:
    """The estimate without additions; its interval holds what it would be with them."""
    other = found.parameters
    wide = np.abs(other.values - own.values) + t_factor(other.dof) * other.sd
    sd = np.maximum(wide / t_factor(own.dof), own.sd)
    check = unlike_finding(own, other)
    parameters = replace(own, covariance=_scaled(own.covariance, sd))
    return Doubt(parameters, parameters, (check,), True, details=found.details)


def _over_bands(found: Doubt, excess: FloatArray) -> Doubt:
    """Widened where no kind of limb that was fitted is the same in all parts of the band."""
    if (excess == 1).all():
        check = band_finding(found.parameters, excess)
        return replace(found, checks=(*found.checks, check))
    wide = _widened(found.parameters, excess)
    checks = (*found.checks, band_finding(wide, excess))
    allowing = _widened(found.allowing, excess)
    return Doubt(wide, allowing, checks, True, details=found.details)


def _widened(parameters: Parameters, excess: FloatArray) -> Parameters:
    # C' (3, 3) = diag(excess) C diag(excess)
    covariance = parameters.covariance * np.outer(excess, excess)
    return replace(parameters, covariance=covariance, dof=min(parameters.dof, PARTS - 1))


def _nothing_left() -> tuple[Finding, ...]:
    said = "I, B and K leave nothing of the record"
    return tuple(Finding(name, "ok", said) for name in ("reflex", "skew", "amplitude"))


def _cannot(error: Exception) -> Finding:
    why = f"{error}".split(";")[0]
    return Finding("reflex", "cannot tell", f"late answers and skew could not be looked for: {why}")


def _matters(made: Contest, again: Contest, own: Parameters) -> bool:
    """Whether the terms of amplitude move I, B, K by what is not lost in their error."""
    kind = Kind(late_angle=True, answers=())
    limbs = [one.fits[kind].values[0, :3] for one in (made, again)]
    enough = np.maximum(SMALL * np.abs(own.values), own.sd)
    return bool((np.abs(limbs[1] - limbs[0]) > enough).any())


def _concluded(
    own: Parameters, made: Contest, curved: Bent, deflection: float, rate_hz: float
) -> Doubt:
    stiffness = float(own.values[2])
    believed = posterior(made, stiffness)
    seen = bool(made.bends) or believed.of_neither < UNLIKELY
    allowing = _beside(own, believed) if seen else _allowing(own, believed)
    parameters = allowing if seen else own
    late, answer = _lateness(made, believed), _reflex(made, believed)
    amplitude = _amplitude(made, curved, stiffness, deflection)
    hidden = None if seen else Hidden.of(own, allowing)
    checks = findings(answer, late, amplitude, parameters, hidden, believed.of_neither, rate_hz)
    seen = seen and any(one.verdict in ("warning", "cannot tell") for one in checks)
    details = {"reflex": answer, "skew": late, "amplitude": amplitude}
    chance = 0.0 if seen else made.chance_of_limb()
    return Doubt(parameters, allowing, checks, seen, chance, details)


def _allowing(own: Parameters, believed: Posterior) -> Parameters:
    """The estimate, moved and widened by what lateness or answer would do to it, were there one."""
    among = believed.late_angle | believed.answers
    weight, shifts, excess = believed.share(among), believed.shift[among], believed.excess[among]
    shift = weight @ shifts
    spread = excess + _outer(shifts - shift)
    covariance = own.covariance + np.tensordot(weight, spread, 1)
    more = np.maximum(np.diagonal(excess, axis1=1, axis2=2), 0.0)
    sd = np.sqrt(own.sd**2 + more) * t_factor(own.dof) / _NORMAL
    half = half_widths(weight, shifts, sd, shift)
    covariance = _scaled(covariance, half / t_factor(own.dof))
    return replace(own, values=own.values + shift, covariance=covariance)


def _beside(own: Parameters, believed: Posterior) -> Parameters:
    """I, B, K beside what was seen, over all that the record leaves of it."""
    mean = believed.mean[:, :3]
    centre = believed.weight @ mean
    within = believed.covariance[:, :3, :3]
    covariance = np.tensordot(believed.weight, within + _outer(mean - centre), 1)
    # A part that the record excludes may have no minimum there, and so a variance below zero.
    own_variance = np.maximum(np.diagonal(within, axis1=1, axis2=2), 0.0)
    sd = np.sqrt(own_variance) * t_factor(_DOF) / _NORMAL
    half = half_widths(believed.weight, mean, sd, centre)
    covariance = _scaled(covariance, half / t_factor(_DOF))
    return Parameters(own.names, own.units, centre, covariance, "mixture", _DOF)


def _outer(rows: FloatArray) -> FloatArray:
    """Each row's product with itself, (c, p, p)."""
    return np.asarray(rows[:, :, None] * rows[:, None, :])


def _scaled(covariance: FloatArray, sd: FloatArray) -> FloatArray:
    """The same correlations with other standard errors (p,)."""
    by = sd / np.sqrt(np.diag(covariance))
    return np.asarray(covariance * np.outer(by, by))


def _interval(
    believed: Posterior, combination: FloatArray, among: BoolArray
) -> tuple[float, tuple[float, float]]:
    """Mean and 95 % limits of a combination (6,) of I, B, K, T, K_r, B_r over some of the parts."""
    weight = believed.share(among)
    mean = (believed.mean[among] @ combination)[:, None]
    variance = np.einsum("cij,i,j->c", believed.covariance[among], combination, combination)
    sd = np.sqrt(np.maximum(variance, 0.0))[:, None]
    centre = weight @ mean
    half = half_widths(weight, mean, sd * t_factor(_DOF) / _NORMAL, centre)
    return float(centre[0]), (float(centre[0] - half[0]), float(centre[0] + half[0]))


#: I, B, K, T, K_r, B_r one by one.
_ONE: Final = np.eye(6)


def _lateness(made: Contest, believed: Posterior) -> Lateness:
    value, limits = _interval(believed, _ONE[3], np.ones(len(believed.weight), dtype=bool))
    if_late = _interval(believed, _ONE[3], believed.late_angle)[0]
    information = made.fits[Kind(late_angle=True, answers=())].information[0]
    smallest = np.sqrt(2 * _SEEN * np.linalg.inv(information)[3, 3])
    return Lateness(value, limits, believed.of_lateness, if_late, float(smallest))


def _reflex(made: Contest, believed: Posterior) -> Reflex:
    among = believed.answers
    weight, best = believed.share(among), int(believed.log_weight[among].argmax())
    delay, muscle = believed.delay_s[among], believed.muscle_s[among]
    fit = made.fits[Kind(late_angle=False, answers=(0,))]
    typical = int((np.abs(fit.delay_s - 0.06) + fit.muscle_s).argmin())
    variance = np.linalg.inv(fit.information[typical])[3, 3]
    (K_r, ci95), (B_r, B_r_ci95), (total, total_ci95) = (
        _interval(believed, combination, among)
        for combination in (_ONE[4], _ONE[5], _ONE[2] + _ONE[4])
    )
    answer = believed.mean[among][best, 4:]
    return Reflex(
        K_r,
        ci95,
        B_r,
        B_r_ci95,
        float(weight @ delay),
        _middle(delay, weight),
        float(weight @ muscle),
        _middle(muscle, weight),
        believed.of_answer,
        float(np.sqrt(2 * _SEEN * variance)),
        total,
        total_ci95,
        LateAnswer(float(answer[0]), float(answer[1]), float(delay[best]), float(muscle[best])),
    )


def _middle(values: FloatArray, weight: FloatArray) -> tuple[float, float]:
    """Where the middle 95 % of (c,) values lie."""
    order = np.argsort(values)
    share = np.cumsum(weight[order])
    limits = [values[order][np.searchsorted(share, q)] for q in (0.025, 0.975 - 1e-12)]
    return float(limits[0]), float(limits[1])


def _amplitude(made: Contest, curved: Bent, stiffness: float, deflection: float) -> Amplitude:
    values = np.zeros(4)
    kind = Kind(late_angle=True, answers=())
    if made.bends:
        values[list(made.bends)] = made.fits[kind].values[0, -len(made.bends) :]
    return Amplitude(
        stiffens=STIFFENS[0] in made.bends,
        rubs=RUBS[0] in made.bends,
        more_stiffness=stiffening(values, deflection),
        friction=float(values[RUBS[0]]),
        deflection=deflection,
        smallest=curved.smallest / stiffness,
    )
