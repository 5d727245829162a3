"""The verb of this room: parameters of passive joints from their samples."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from armimpedance.errors import ArmImpedanceError, EstimationError, InputError
from armimpedance.passive.equations import Equations, check_excitation
from armimpedance.passive.linear import TwoFits
from armimpedance.passive.methods import DEFAULT_METHOD, Method, method_named
from armimpedance.passive.notes import joint_notes
from armimpedance.passive.rest_angle import rest_angle_note
from armimpedance.passive.result import CrossValidation, PassiveFit
from armimpedance.passive.samples import PassiveSamples
from armimpedance.passive.terms import RestAngle, Terms
from armimpedance.regression import Fit, NamedParameter, fit


def identify_passive(
    samples: PassiveSamples,
    *,
    rest_angle: RestAngle | Mapping[str, RestAngle],
    method: str = DEFAULT_METHOD,
    quadratic: bool = False,
    cross_validate: bool = True,
) -> tuple[PassiveFit, ...]:
    """Stiffness, viscosity and friction of every joint of the samples, one after another.

    Parameters
    ----------
    samples : PassiveSamples
    rest_angle : float, "free", or a mapping of joints to either
        q_r in rad. The source never gives it; free, it widens the interval of k.
    method : str
        One of `METHODS`.
    quadratic : bool
        Whether ``K (q - q_r)^2`` is fitted too.
    cross_validate : bool
        Whether every trial (or third of a single trial) is predicted from the others.

    Returns
    -------
    tuple of PassiveFit
        In the order of `samples.joints`.

    Raises
    ------
    InputError
        Unknown method or joint, too few samples.
    NotIdentifiableError
        The motion cannot show a parameter; it is named.
    EstimationError
        The search does not settle.
    """
    chosen = method_named(method)
    fits = []
    for j, joint in enumerate(samples.joints):
        terms = Terms(_rest_angle(rest_angle, joint, samples.joints), quadratic)
        fits.append(_identify(samples.only(j), j + 1, terms, chosen, cross_validate))
    return tuple(fits)


def _rest_angle(
    given: RestAngle | Mapping[str, RestAngle], joint: str, joints: Sequence[str]
) -> RestAngle:
    if not isinstance(given, Mapping):
        return given
    if joint not in given or set(given) - set(joints):
        raise InputError(
            f"rest angles of {', '.join(given)}", expected=f"of {', '.join(joints)}, each"
        )
    return given[joint]


def _identify(
    samples: PassiveSamples, number: int, terms: Terms, method: Method, cross_validate: bool
) -> PassiveFit:
    check_excitation(samples, terms)
    equations = method.equations(samples, terms)
    elsewhere = rest_angle_note(equations, terms, samples.sample_rate_hz)
    fits = _solved(samples, terms, method, elsewhere)
    torque_fit = _torque_fit(equations, fits.classical)
    W, Y = equations.stacked()
    parameters = _parameters(fits, terms, number)
    friction = W[:, 2] * fits.classical.parameters[2]
    share = 100 * float(np.sqrt((friction**2).mean() / (Y**2).mean()))
    cross: tuple[CrossValidation, ...] = ()
    failed: tuple[str, ...] = ()
    if cross_validate:
        cross, failed = _cross_validation(samples, terms, method, torque_fit)
    found = PassiveFit(
        joint=samples.joints[0],
        number=number,
        method=method.name,
        terms=terms,
        parameters=parameters,
        torque_fit=torque_fit,
        n=equations.n_rows,
        cond_raw=torque_fit.cond_raw,
        cond_scaled=torque_fit.cond_scaled,
        rank=torque_fit.rank,
        direct=torque_fit.validate(W, Y),
        cross=cross,
        friction_share_percent=share,
        cutoff_hz=samples.cutoff_hz,
    )
    return replace(found, warnings=(*joint_notes(found, samples, fits, elsewhere), *failed))


def _solved(
    samples: PassiveSamples, terms: Terms, method: Method, elsewhere: str | None
) -> TwoFits:
    """The method's fits; where its search fails, a rest angle that cannot be is the likely why."""
    try:
        return method.solve(samples, terms)
    except EstimationError as error:
        if elsewhere is None:
            raise
        raise EstimationError(f"{error}; {elsewhere}") from error


def _torque_fit(equations: Equations, solved: Fit) -> Fit:
    """The torque equations' own fit, with the parameters that the method found."""
    own = fit(
        equations.factors(),
        covariance="classical",
        parameter_names=equations.columns,
        parameter_units=equations.column_units,
    )
    return replace(own, coefficients=solved.coefficients)


def _parameters(fits: TwoFits, terms: Terms, number: int) -> tuple[NamedParameter, ...]:
    source, trusted = terms.parameters(fits.classical), terms.parameters(fits.robust)
    return tuple(
        NamedParameter(
            name=name,
            value=float(source.values[j]),
            sd=float(source.sd[j]),
            sd_robust=float(trusted.sd[j]),
            unit=source.units[j],
            dof=trusted.dof,
            joint=number,
        )
        for j, name in enumerate(terms.names)
    )


def _cross_validation(
    samples: PassiveSamples, terms: Terms, method: Method, torque_fit: Fit
) -> tuple[tuple[CrossValidation, ...], tuple[str, ...]]:
    """Each trial predicted from the others, and a sentence for each that cannot be."""
    parts = samples if samples.n_trials > 1 else samples.in_thirds()
    found, failed = [], []
    for row, name in enumerate(parts.trials):
        others = [r for r in range(parts.n_trials) if r != row]
        try:
            solved = method.solve(parts.select(others), terms).classical
            equations = method.equations(parts.select([row]), terms)
        except ArmImpedanceError as error:
            failed.append(f"not predicted from the others: {name} ({error})")
            continue
        predicting = replace(torque_fit, coefficients=solved.coefficients)
        found.append(CrossValidation(name, predicting.validate(*equations.stacked())))
    return tuple(found), tuple(failed)
