"""Test an estimate of I, B, K for what its model leaves out.

An effect is judged by how much it changes I, B and K: the same reflex may be harmless with a broad
band and ruinous with a narrow one. A detected effect is estimated together with them; one that the
record cannot exclude widens their intervals. Both are reported.
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

#: A hypothesis of a smaller posterior probability than this is rejected.
UNLIKELY: Final = 1 - SURE
#: A residual below this share of the motion's power is rounding.
ENOUGH: Final = 1e-6
#: Smaller relative changes of I, B, K do not matter.
SMALL: Final = 5e-3
#: Degrees of freedom of intervals that use the residual's spectrum: each of its values comes from
#: about sixteen squares, and every parameter depends on several values.
_DOF: Final = 30.0
_NORMAL: Final = 1.959964
#: Largest factor by which a reflex, a skew or a bend can change I, the best-known parameter.
OTHER_INERTIA: Final = 1.5
#: About half of the fall in deviance by which an answer or a skew is detected.
_SEEN: Final = 6.0


@dataclass(frozen=True, eq=False)
class Doubt:
    """An estimate, and the tests of its assumptions.

    `parameters`: I, B, K of the limb that the record supports.
    `allowing`: the same, allowing for a late answer or a skew that the record does not exclude.
    `checks`: "reflex", "skew", "amplitude", "band".
    `seen`: True if more than I, B and K was detected: this explains their misfit.
    `chance`: probability that chance alone departs so far from I, B and K over frequency; 0 if
    this was not tested.
    """

    parameters: Parameters
    allowing: Parameters
    checks: tuple[Finding, ...]
    seen: bool = False
    chance: float = 0.0
    details: Mapping[str, Any] = field(default_factory=dict)


def doubt(estimate: Estimate, prepared: PreparedSamples, band: Band) -> Doubt:
    """Test I, B, K for late answers, channels out of step, and effects of amplitude.

    `band`: of the whole record, weighted as for the estimate.
    """
    own = estimate.parameters
    if explained(band, own.values) > 1 - ENOUGH:
        return Doubt(own, own, _nothing_left())
    try:
        record = doubted(prepared, band)
        driver = driver_of(record.band)
        result = contest(record, driver, own.values)
        deflection = float(np.std(prepared.angle))
        curved = bent(result, deflection)
        if curved.terms:
            with_bends = contest(record, driver, own.values, curved.terms)
            if _matters(result, with_bends, own):
                result = with_bends
        conclusion = _concluded(own, result, curved, deflection, prepared.source.sample_rate_hz)
        frequency = np.concatenate([bins.frequency_hz for bins in record.band.trials])
        if _another(own, conclusion.parameters):
            return _unlike(own, conclusion)
        return _over_bands(conclusion, result.excess_over_bands(frequency))
    except (InputError, EstimationError, np.linalg.LinAlgError) as error:
        return Doubt(own, own, (_cannot(error),))


def _another(own: Parameters, extended: Parameters) -> bool:
    """Return True if the additions replaced the limb instead of adding to it."""
    ratio = extended.values / own.values
    return bool((ratio <= 0).any() or abs(np.log(ratio[0])) > np.log(OTHER_INERTIA))


def _unlike(own: Parameters, extended: Doubt) -> Doubt:
    """Return the estimate without additions, with an interval that covers it with them."""
    with_additions = extended.parameters
    half = (
        np.abs(with_additions.values - own.values)
        + t_factor(with_additions.dof) * with_additions.sd
    )
    sd = np.maximum(half / t_factor(own.dof), own.sd)
    check = unlike_finding(own, with_additions)
    parameters = replace(own, covariance=_scaled(own.covariance, sd))
    return Doubt(parameters, parameters, (check,), True, details=extended.details)


def _over_bands(conclusion: Doubt, excess: FloatArray) -> Doubt:
    """Widen the intervals if no fitted kind of limb is the same in all parts of the band."""
    if (excess == 1).all():
        check = band_finding(conclusion.parameters, excess)
        return replace(conclusion, checks=(*conclusion.checks, check))
    wide = _widened(conclusion.parameters, excess)
    checks = (*conclusion.checks, band_finding(wide, excess))
    allowing = _widened(conclusion.allowing, excess)
    return Doubt(wide, allowing, checks, True, details=conclusion.details)


def _widened(parameters: Parameters, excess: FloatArray) -> Parameters:
    # C' (3, 3) = diag(excess) C diag(excess)
    covariance = parameters.covariance * np.outer(excess, excess)
    return replace(parameters, covariance=covariance, dof=min(parameters.dof, PARTS - 1))


def _nothing_left() -> tuple[Finding, ...]:
    message = "I, B and K leave nothing of the record"
    return tuple(Finding(name, "ok", message) for name in ("reflex", "skew", "amplitude"))


def _cannot(error: Exception) -> Finding:
    why = f"{error}".split(";")[0]
    return Finding("reflex", "cannot tell", f"late answers and skew could not be looked for: {why}")


def _matters(plain: Contest, bent: Contest, own: Parameters) -> bool:
    """Return True if the terms of amplitude change I, B, K significantly."""
    kind = Kind(late_angle=True, answers=())
    limbs = [result.fits[kind].values[0, :3] for result in (plain, bent)]
    enough = np.maximum(SMALL * np.abs(own.values), own.sd)
    return bool((np.abs(limbs[1] - limbs[0]) > enough).any())


def _concluded(
    own: Parameters, result: Contest, curved: Bent, deflection: float, rate_hz: float
) -> Doubt:
    stiffness = float(own.values[2])
    believed = posterior(result, stiffness)
    seen = bool(result.bends) or believed.of_neither < UNLIKELY
    allowing = _beside(own, believed) if seen else _allowing(own, believed)
    parameters = allowing if seen else own
    late, answer = _lateness(result, believed), _reflex(result, believed)
    amplitude = _amplitude(result, curved, stiffness, deflection)
    hidden = None if seen else Hidden.of(own, allowing)
    checks = findings(answer, late, amplitude, parameters, hidden, believed.of_neither, rate_hz)
    seen = seen and any(check.verdict in ("warning", "cannot tell") for check in checks)
    details = {"reflex": answer, "skew": late, "amplitude": amplitude}
    chance = 0.0 if seen else result.chance_of_limb()
    return Doubt(parameters, allowing, checks, seen, chance, details)


def _allowing(own: Parameters, believed: Posterior) -> Parameters:
    """Return the estimate, moved and widened by a possible lateness or answer."""
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
    """I, B, K with the detected effects, averaged over all models that are not excluded."""
    mean = believed.mean[:, :3]
    centre = believed.weight @ mean
    within = believed.covariance[:, :3, :3]
    covariance = np.tensordot(believed.weight, within + _outer(mean - centre), 1)
    # A part that the record excludes may have no minimum there: its variance may be negative.
    own_variance = np.maximum(np.diagonal(within, axis1=1, axis2=2), 0.0)
    sd = np.sqrt(own_variance) * t_factor(_DOF) / _NORMAL
    half = half_widths(believed.weight, mean, sd, centre)
    covariance = _scaled(covariance, half / t_factor(_DOF))
    return Parameters(own.names, own.units, centre, covariance, "mixture", _DOF)


def _outer(rows: FloatArray) -> FloatArray:
    """Each row's product with itself, (c, p, p)."""
    return np.asarray(rows[:, :, None] * rows[:, None, :])


def _scaled(covariance: FloatArray, sd: FloatArray) -> FloatArray:
    """Covariance with the same correlations and other standard errors (p,)."""
    factor = sd / np.sqrt(np.diag(covariance))
    return np.asarray(covariance * np.outer(factor, factor))


def _interval(
    believed: Posterior, combination: FloatArray, among: BoolArray
) -> tuple[float, tuple[float, float]]:
    """Mean and 95 % limits of a combination (6,) of I, B, K, T, K_r, B_r, over selected parts."""
    weight = believed.share(among)
    mean = (believed.mean[among] @ combination)[:, None]
    variance = np.einsum("cij,i,j->c", believed.covariance[among], combination, combination)
    sd = np.sqrt(np.maximum(variance, 0.0))[:, None]
    centre = weight @ mean
    half = half_widths(weight, mean, sd * t_factor(_DOF) / _NORMAL, centre)
    return float(centre[0]), (float(centre[0] - half[0]), float(centre[0] + half[0]))


#: Combinations that select I, B, K, T, K_r, B_r singly.
_ONE: Final = np.eye(6)


def _lateness(result: Contest, believed: Posterior) -> Lateness:
    value, limits = _interval(believed, _ONE[3], np.ones(len(believed.weight), dtype=bool))
    if_late = _interval(believed, _ONE[3], believed.late_angle)[0]
    information = result.fits[Kind(late_angle=True, answers=())].information[0]
    smallest = np.sqrt(2 * _SEEN * np.linalg.inv(information)[3, 3])
    return Lateness(value, limits, believed.of_lateness, if_late, float(smallest))


def _reflex(result: Contest, believed: Posterior) -> Reflex:
    among = believed.answers
    weight, best = believed.share(among), int(believed.log_weight[among].argmax())
    delay, muscle = believed.delay_s[among], believed.muscle_s[among]
    fit = result.fits[Kind(late_angle=False, answers=(0,))]
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
    """Limits of the middle 95 % of weighted values (c,)."""
    order = np.argsort(values)
    share = np.cumsum(weight[order])
    limits = [values[order][np.searchsorted(share, q)] for q in (0.025, 0.975 - 1e-12)]
    return float(limits[0]), float(limits[1])


def _amplitude(result: Contest, curved: Bent, stiffness: float, deflection: float) -> Amplitude:
    values = np.zeros(4)
    kind = Kind(late_angle=True, answers=())
    if result.bends:
        values[list(result.bends)] = result.fits[kind].values[0, -len(result.bends) :]
    return Amplitude(
        stiffens=STIFFENS[0] in result.bends,
        rubs=RUBS[0] in result.bends,
        more_stiffness=stiffening(values, deflection),
        friction=float(values[RUBS[0]]),
        deflection=deflection,
        smallest=curved.smallest / stiffness,
    )
