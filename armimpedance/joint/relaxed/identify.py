"""Estimate the parameters of passive joints from their samples."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from armimpedance.core.errors import ArmImpedanceError, EstimationError, InputError
from armimpedance.core.progress import Progress
from armimpedance.joint.relaxed.doubts.checks import doubts
from armimpedance.joint.relaxed.equations import RestAngle, Terms, check_excitation
from armimpedance.joint.relaxed.hinge import harmonics_at
from armimpedance.joint.relaxed.linear import TwoFits, rest_angle_note
from armimpedance.joint.relaxed.methods import METHODS
from armimpedance.joint.relaxed.passive_fit import CrossValidation, PassiveFit, PassiveFits
from armimpedance.joint.relaxed.samples import PassiveSamples
from armimpedance.numerics.regression import Fit, Parameters

if TYPE_CHECKING:
    from armimpedance.joint.relaxed.passive_fit import PassiveFit

# Warnings for a reader of a passive joint's parameters.

#: Scaled condition number above which the columns are hard to separate.
_HARD: Final = 30.0


def joint_notes(
    fitted: PassiveFit, samples: PassiveSamples, fits: TwoFits, elsewhere: str | None
) -> tuple[str, ...]:
    """Warnings on one joint, the samples' own first; `elsewhere`: sentence on a contradicted rest
    angle.
    """
    notes = [*samples.notes, *fits.classical.warnings, *([elsewhere] if elsewhere else [])]
    h = fitted.parameters["h"]
    f = fitted.parameters["f"].value if fitted.terms.friction else 0.0
    doubtless = fitted.terms.friction and fitted.parameters["f"].ci95[1] < 0
    condition = fitted.torque_fit.cond_scaled
    if condition > _HARD:
        notes.append(
            f"ill-conditioned: scaled condition number {condition:.0f}; the motion shows "
            "the terms together rather than each"
        )
    if doubtless:
        notes.append(_negative_friction(f, h.value, natural_frequency(fitted, samples)))
    if h.value < 0:
        notes.append(f"negative viscosity {h.value:.3g} N m s/rad: not dissipative")
    if fitted.parameters["k"].value < 0:
        doubt = "" if elsewhere else "; is the torque's sign right?"
        notes.append(f"negative stiffness: no passive joint has one{doubt}")
    if fitted.terms.free:
        notes.append("rest angle unknown and fitted: the interval of k may be several times wider")
    return tuple(notes)


def natural_frequency(fitted: PassiveFit, samples: PassiveSamples) -> float:
    """Angular frequency of the free joint, rad/s.

    ``sqrt((k + dg/dq) / I)`` at the mean angle if the limb's dynamics are known; otherwise that
    of the recorded swing, ``rms(qd) / sd(q)``.
    """
    q, qd = samples.q[:, 0], samples.qd[:, 0]
    swing = float(np.sqrt((qd**2).mean()) / np.std(q))
    if samples.hinges is None:
        return swing
    mean = np.concatenate(samples.hinges[0].coefficients).mean(axis=0)
    step, at = 1e-4, float(q.mean())
    slope = (harmonics_at(np.array(at + step)) - harmonics_at(np.array(at - step))) / (2 * step)
    stiffness = fitted.parameters["k"].value + float(mean[2:] @ slope)
    return float(np.sqrt(stiffness / mean[0])) if stiffness > 0 else swing


def limit_cycle_rad(f: float, h: float, omega: float) -> float:
    """Amplitude ``4 |f| / (pi h omega)`` of the swing that a negative friction sustains, rad.

    By the describing function of the sign: friction supplies the energy that viscosity absorbs.
    """
    return 4 * abs(f) / (np.pi * h * omega)


def _negative_friction(f: float, h: float, omega: float) -> str:
    message = f"negative friction {f:.3g} N m: not dissipative"
    if h <= 0:
        return f"{message}; with h <= 0 nothing would end the swing that it drives"
    amplitude = limit_cycle_rad(f, h, omega)
    return f"{message}; a limit cycle of amplitude {amplitude:.3g} rad at {omega:.3g} rad/s"


def identify_passive(
    samples: PassiveSamples,
    *,
    rest_angle: RestAngle | Mapping[str, RestAngle],
    method: str | None = None,
    quadratic: bool = False,
    friction: bool = True,
    cross_validate: bool = True,
    progress: Progress | None = None,
) -> PassiveFits:
    """Estimate stiffness, viscosity and friction of every joint of the samples.

    Parameters
    ----------
    samples : PassiveSamples
    rest_angle : float, "free", or a mapping of joints to either
        q_r in rad; a joint that a mapping does not name is free. The source does not state q_r; a
        free q_r widens the interval of k.
    method : str, optional
        One of `METHODS`; by default the table's default, or `parallel` if the samples have neither
        the limb's dynamics nor a measured torque.
    quadratic : bool
        True to fit ``K (q - q_r)^2`` too.
    friction : bool
        True to fit ``f sign(qd)``; False for a joint that is known to have no dry friction.
    cross_validate : bool
        True to predict every trial (or third of a single trial) from the others.
    progress : function, optional
        Called with the number of joints that are done and their total.

    Returns
    -------
    PassiveFits
        In the order of `samples.joints`.

    Raises
    ------
    InputError
        Unknown method or joint, too few samples.
    NotIdentifiableError
        The motion cannot show a parameter; it is named.
    EstimationError
        The search does not converge.
    """
    raw = samples.hinges is not None or samples.measured_torque is not None
    name = method or (METHODS.default if raw else "parallel")
    METHODS.named(name)
    fits = []
    for j, joint in enumerate(samples.joints):
        terms = Terms(_rest_angle(rest_angle, joint, samples.joints), quadratic, friction)
        fits.append(_identify(samples.only(j), j + 1, terms, name, cross_validate))
        if progress is not None:
            progress(j + 1, len(samples.joints))
    return PassiveFits(tuple(fits), samples)


def _rest_angle(
    stated: RestAngle | Mapping[str, RestAngle], joint: str, joints: Sequence[str]
) -> RestAngle:
    if not isinstance(stated, Mapping):
        return stated
    if set(stated) - set(joints):
        raise InputError(f"rest angles of {', '.join(stated)}", expected=f"of {', '.join(joints)}")
    return stated.get(joint, "free")


def _identify(
    samples: PassiveSamples, number: int, terms: Terms, method: str, cross_validate: bool
) -> PassiveFit:
    check_excitation(samples, terms)
    equations = METHODS[method].equations(samples, terms)
    elsewhere = rest_angle_note(equations, terms, samples.sample_rate_hz)
    fits = _solved(samples, terms, method, elsewhere)
    # the torque equations' own fit, with the parameters estimated by the method
    torque_fit = replace(equations.fit(), coefficients=fits.classical.coefficients)
    W, Y = equations.stacked()
    dry = terms.columns.index("f") if terms.friction else slice(0)
    friction = W[:, dry] * fits.classical.parameters[dry]
    cross: tuple[CrossValidation, ...] = ()
    failed: tuple[str, ...] = ()
    if cross_validate:
        cross, failed = _cross_validation(samples, terms, method, torque_fit)
    fitted = PassiveFit(
        joint=samples.joints[0],
        number=number,
        method=method,
        terms=terms,
        parameters=_parameters(fits, terms),
        torque_fit=torque_fit,
        direct=torque_fit.validate(W, Y),
        cross=cross,
        friction_share_percent=100 * float(np.sqrt((friction**2).sum() / (Y**2).sum())),
        cutoff_hz=samples.cutoff_hz,
    )
    notes = (*joint_notes(fitted, samples, fits, elsewhere), *failed)
    return replace(fitted, warnings=notes).doubted(*doubts(samples, terms, method, fits, elsewhere))


def _solved(samples: PassiveSamples, terms: Terms, method: str, elsewhere: str | None) -> TwoFits:
    """Fits of the method; if its search fails, name a wrong rest angle as the probable reason."""
    try:
        return METHODS[method].solve(samples, terms)
    except EstimationError as error:
        if elsewhere is None:
            raise
        raise EstimationError(f"{error}; {elsewhere}") from error


def _parameters(fits: TwoFits, terms: Terms) -> Parameters:
    source, trusted = terms.parameters(fits.classical), terms.parameters(fits.robust)
    return replace(trusted, values=source.values, plain_covariance=source.covariance)


def _cross_validation(
    samples: PassiveSamples, terms: Terms, method: str, torque_fit: Fit
) -> tuple[tuple[CrossValidation, ...], tuple[str, ...]]:
    """Predict each trial from the others; a sentence for each trial for which that fails."""
    parts = samples if samples.n_trials > 1 else samples.in_thirds()
    predicted, failed = [], []
    for row, name in enumerate(parts.trials):
        others = [r for r in range(parts.n_trials) if r != row]
        try:
            solved = METHODS[method].solve(parts.select(others), terms).classical
            equations = METHODS[method].equations(parts.select([row]), terms)
        except ArmImpedanceError as error:
            failed.append(f"not predicted from the others: {name} ({error})")
            continue
        predicting = replace(torque_fit, coefficients=solved.coefficients)
        predicted.append(CrossValidation(name, predicting.validate(*equations.stacked())))
    return tuple(predicted), tuple(failed)
