"""Fit one model of posture and activation to all experiments at once."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError, NotIdentifiableError
from armimpedance.core.findings import Finding
from armimpedance.core.progress import Progress, Steps
from armimpedance.limb.arm import MuscularArm, arm_named
from armimpedance.muscles.models.activation.checks import check_activation, unpredicted
from armimpedance.muscles.models.changed_gain import WhiteRows, gain_change
from armimpedance.muscles.models.combined.equations import EvaluatedEquations, MuscleEquations
from armimpedance.muscles.models.combined.lengths import corrected_lengths
from armimpedance.muscles.models.combined.model import MuscleModel
from armimpedance.muscles.models.combined.quality import muscle_quality, muscle_summary, shuffles
from armimpedance.muscles.models.combined.solver import (
    Measured,
    MusclePosterior,
    Prior,
    solve_posterior,
)
from armimpedance.muscles.models.fitted_model import ElementQuality
from armimpedance.muscles.models.from_estimates import HandRows
from armimpedance.muscles.models.rows import JointRows, spread_of
from armimpedance.muscles.models.workspace import Region
from armimpedance.numerics.regression import FitSummary

HIGHEST_MOMENT_ARM_ORDER: Final = 3
HIGHEST_ACTIVATION_ORDER: Final = 3
#: Standard deviations of the prior: what a muscle at rest may add to a joint's stiffness (N m/rad)
#: and viscosity (N m s/rad); passive joints beside muscles (elbow .4-1.8 N m/rad, Wiegner and Watts
#: 1986). Wide: several times what is known of human arms.
_REST_K, _REST_B = 30.0, 3.0
_PASSIVE_K, _PASSIVE_B = 2.0, 0.4
#: Of what full activation adds: so many times the arm's kappa times its largest tension, and that
#: times the ratio of viscosity to stiffness of Selen et al. 2009 (s).
_ACTIVE, _VISCOUS_S = 3.0, 0.05
#: Of the passive torque (N m) and of what its proportion to stiffness is wrong by.
_PASSIVE_TORQUE = 10.0
#: Least factor of standard errors that are found from residuals, and the least torque sd (N m).
_LEAST, _LEAST_TORQUE = 1e-3, 0.02
#: A muscle that was never more active than this does not count as measured.
_NO_ACTIVATION = 1e-6
#: A muscle that is nowhere further from a joint's axis does nothing there.
_LEAST_ARM_M = 1e-6


def fit_muscle_model(
    rows: JointRows | HandRows,
    arm: MuscularArm | str = "planar6",
    *,
    moment_arm_order: int = 2,
    activation_order: int = 1,
    prior_percent: float = 20.0,
    torque: bool = False,
    torque_sd: float | ArrayLike | None = None,
    proportion_sd: float = 0.1,
    curvature: bool = True,
    stiffness_per_tension: float | None = None,
    seed: int = 0,
    progress: Progress | None = None,
) -> MuscleModel:
    """Fit ``K_j(theta, alpha)`` and ``B_j`` of `combined.equations`, posterior mode.

    Tsuji (1997), eqs. (11), (30)-(38) in one model: polynomial moment arms and activations.

    Parameters
    ----------
    rows : JointRows or HandRows
        P conditions of any postures and activations: K and B of the joints, or K of a hand with
        all joints free.
    arm : MuscularArm or str
        The anatomical arm that corrections start from. A name such as "planar6", or the path of a
        table of moment arms, stands for its arm.
    moment_arm_order : int
        L of the corrections to moment arms.
    activation_order : int
        N.
    prior_percent : float
        Standard deviation of each correction in per cent of the anatomical moment arm.
    torque : bool
        Fit the joint torque too, tension in proportion to active stiffness.
    torque_sd : float or (P, n), optional
        N m; without it, found from the residuals.
    proportion_sd : float
        Standard deviation of single muscles about `stiffness_per_tension`, as a part of it.
    curvature : bool
        False leaves out what tension adds through the curvature of the muscles' lengths.
    stiffness_per_tension : float, optional
        1/m; default: the arm's.
    seed : int
        Seed of the shuffles behind the null R.

    progress : function, optional
        Called with what is done and what there is to do.

    Returns
    -------
    MuscleModel

    Raises
    ------
    InputError
        Rows without activation or (where asked) torque, or an order out of range.
    NotIdentifiableError
        A muscle that was never active.
    EstimationError
        The search does not arrive.
    """
    _check_orders(moment_arm_order, activation_order, prior_percent, proportion_sd)
    arm = arm_named(arm)
    if rows.joints != arm.paths.joints:
        problem = f"rows of {rows.joints} joints, an arm of {arm.paths.joints}"
        raise InputError(problem, expected="an arm with the rows' joints")
    rows = rows.of_muscles(arm.paths.muscles)
    alpha = check_activation(rows, arm, torque=torque)
    highest = alpha.max(axis=0)
    if (highest <= _NO_ACTIVATION).any():
        names = tuple(np.array(arm.paths.muscles)[highest <= _NO_ACTIVATION].tolist())
        raise NotIdentifiableError(f"never active: {', '.join(names)}", names)
    kappa = float(stiffness_per_tension or arm.stiffness_per_tension)
    lengths = corrected_lengths(
        arm, rows.joint_angles, order=moment_arm_order, prior_part=prior_percent / 100
    )
    equations = MuscleEquations(lengths, activation_order, highest, kappa, curvature)
    form = equations.at(rows.joint_angles, alpha)
    measured = _measured(rows, torque_sd if torque else None, torque=torque)
    prior = prior_of(equations, arm, proportion_sd, torque=torque)
    steps = Steps(progress, 1 + shuffles(rows.joints))
    posterior = solve_posterior(form, measured, prior, start_of(equations, prior))
    steps.step()
    quality = muscle_quality(form, measured, prior, posterior, seed, steps)
    changed = gain_change(_white(form, measured, posterior, alpha))
    posterior = _with_shared(posterior, rows)
    session: tuple[Finding, ...] = ()
    if changed is not None:
        session = (changed.finding(arm.paths.muscles, rows.labels),)
        if changed.seen:
            posterior = replace(posterior, covariance=posterior.covariance + changed.spread)
    summary = muscle_summary(form, measured, prior, posterior, session)
    return _model(arm.name, rows, form, posterior, quality, summary)


def _white(
    form: EvaluatedEquations, measured: Measured, posterior: MusclePosterior, alpha: FloatArray
) -> WhiteRows:
    """The rows of K and B, to be asked for a change of an EMG channel's gain."""
    layout, n = form.equations.layout, len(posterior.x)
    design, error, slopes = [], [], []
    for symbol, block, weight in zip("KB", posterior.blocks, posterior.weights, strict=False):
        P = len(weight)
        by_activation = form.by_activation(posterior.x, symbol) * alpha[:, None]
        slopes.append(weight @ measured.as_seen(form, posterior.x, symbol, by_activation))
        design.append(posterior.jacobian[block].reshape(P, -1, n))
        error.append(-posterior.error[block].reshape(P, -1))
    return WhiteRows(
        np.concatenate(design, axis=1),
        np.concatenate(error, axis=1),
        posterior.x,
        posterior.covariance,
        np.concatenate(slopes, axis=1),
        np.arange(n)[layout.f].reshape(layout.muscles, -1)[:, 1:],
    )


def _with_shared(posterior: MusclePosterior, rows: JointRows | HandRows) -> MusclePosterior:
    """The posterior with what errors that all rows share add to its covariance."""
    covariance = np.array(posterior.covariance)
    for symbol, block, weight in zip("KB", posterior.blocks, posterior.weights, strict=False):
        P, E = weight.shape[:2]
        design = posterior.jacobian[block].reshape(P, E, len(covariance))
        covariance += spread_of(posterior.covariance, design, weight, rows.shared(symbol))
    return replace(posterior, covariance=covariance)


def _check_orders(
    moment_arm_order: int, activation_order: int, prior_percent: float, proportion_sd: float
) -> None:
    for name, value, low, high in (
        ("moment_arm_order", moment_arm_order, 0, HIGHEST_MOMENT_ARM_ORDER),
        ("activation_order", activation_order, 1, HIGHEST_ACTIVATION_ORDER),
    ):
        if isinstance(value, bool) or value != int(value) or not low <= value <= high:
            raise InputError(f"{name} {value}", expected=f"{low} to {high}")
    for name, size in (("prior_percent", prior_percent), ("proportion_sd", proportion_sd)):
        if not (np.isfinite(size) and size > 0):
            raise InputError(f"{name} {size}", expected="a positive number")


def _measured(
    rows: JointRows | HandRows, torque_sd: float | ArrayLike | None, *, torque: bool
) -> Measured:
    (K, K_sd), (B, B_sd) = rows.elements("K"), rows.elements("B")
    tau = np.asarray(rows.torque) if torque else None
    tau_sd = None
    if tau is not None:
        tau_sd = np.broadcast_to(0.3 if torque_sd is None else torque_sd, tau.shape).astype(float)
        if not (np.isfinite(tau_sd).all() and (tau_sd > 0).all()):
            raise InputError("a torque_sd that is not positive", expected="more than 0 N m")
    exact = np.zeros_like(np.asarray(rows.activation))
    has_errors = (
        rows.stiffness_sd is not None,
        rows.viscosity_sd is not None,
        torque_sd is not None,
    )
    least_torque = 1.0 if tau_sd is None else _LEAST_TORQUE / float(np.sqrt((tau_sd**2).mean()))
    least = [_LEAST, _LEAST, least_torque]
    return Measured(
        stiffness=K,
        viscosity=B,
        stiffness_sd=_unknown(K) if K_sd is None else K_sd,
        viscosity_sd=_unknown(B) if B_sd is None else B_sd,
        torque=tau,
        torque_sd=tau_sd,
        activation_sd=exact if rows.activation_sd is None else rows.activation_sd,
        known=has_errors,
        least=np.where(has_errors, 1.0, least),
        kept=rows.kept,
        moving=rows.moving,
        hand=rows if isinstance(rows, HandRows) else None,
    )


def _unknown(values: FloatArray) -> FloatArray:
    """Standard errors to start from where none are stated."""
    return np.full_like(values, 0.1 * np.sqrt((values**2).mean()))


def prior_of(
    equations: MuscleEquations, arm: MuscularArm, proportion_sd: float, *, torque: bool
) -> Prior:
    layout = equations.layout
    n = layout.e.stop if torque else layout.n
    sd, low = np.ones(n), np.full(n, -np.inf)
    G = arm.paths.moment_arms(arm.angle_range.mean(axis=1))
    farthest = np.abs(G).max(axis=1)
    if (farthest < _LEAST_ARM_M).any():
        name = arm.paths.muscles[int(farthest.argmin())]
        raise InputError(f"{name} has no moment arm at a joint", expected="1 um or more")
    rest = 1 / farthest**2
    active = arm.max_tension * equations.highest * equations.stiffness_per_tension
    shape = (layout.muscles, layout.order + 1)
    for at, at_rest, full in (
        (layout.f, _REST_K * rest, _ACTIVE * active),
        (layout.b, _REST_B * rest, _ACTIVE * _VISCOUS_S * active),
    ):
        sizes = np.repeat(full[:, None] / layout.order, shape[1], axis=1)
        sizes[:, 0] = at_rest
        sd[at], low[at] = sizes.ravel(), 0.0
    sd[layout.passive_K], low[layout.passive_K] = _PASSIVE_K, 0.0
    sd[layout.passive_B], low[layout.passive_B] = _PASSIVE_B, 0.0
    if torque:
        sd[layout.tau_p], sd[layout.e] = _PASSIVE_TORQUE, proportion_sd
    return Prior(np.zeros(n), sd, low)


def start_of(equations: MuscleEquations, prior: Prior) -> FloatArray:
    """The anatomical arm, its muscles at sizes that the prior makes likely."""
    layout = equations.layout
    x = np.zeros(len(prior.sd))
    x[layout.f] = prior.sd[layout.f] / 5
    x[layout.b] = prior.sd[layout.b] / 5
    x[layout.passive_K], x[layout.passive_B] = _PASSIVE_K / 5, _PASSIVE_B / 5
    return x


def _model(
    arm: str,
    rows: JointRows | HandRows,
    form: EvaluatedEquations,
    posterior: MusclePosterior,
    quality: tuple[ElementQuality, ...],
    summary: FitSummary,
) -> MuscleModel:
    equations = form.equations
    lengths, n = equations.lengths, equations.layout.n
    hull = Region.of(lengths.scaling.scaled(rows.joint_angles))
    model = MuscleModel(
        arm=arm,
        muscles=lengths.muscles,
        order=equations.order,
        stiffness_per_tension=equations.stiffness_per_tension,
        curvature=equations.curvature,
        exponents=lengths.exponents,
        base=lengths.base,
        muscle=lengths.muscle,
        change=lengths.change,
        box=lengths.box,
        highest=equations.highest,
        values=posterior.x[:n],
        covariance=posterior.covariance[:n, :n],
        dof=float(max(len(posterior.error) - posterior.spent, 1.0)),
        measured=hull.vertices,
        quality=quality,
        summary=summary,
        scatter=(float(posterior.scatter[0]), float(posterior.scatter[1])),
    )
    least = model.smallest_eigenvalue()
    indefinite = (
        f"K_j is not positive definite in the whole workspace: smallest eigenvalue {least:.3g} "
        "N m/rad, from the curvature of the muscles' lengths",
    )
    more = (*unpredicted(quality), *(indefinite if least <= 0 else ()))
    return replace(model, summary=replace(summary, warnings=(*summary.warnings, *more)))


# A person as the prior of `fit muscles` has it: what a calibration can be planned for.


@dataclass(frozen=True)
class TypicalMuscles:
    """The equations of an arm with likely parameters, before anything was measured.

    Attributes
    ----------
    equations : MuscleEquations
    values : (n,)
        The parameters where the search for a person's begins.
    prior_sd : (n,)
        Standard deviations of the parameters before anything was measured.
    """

    equations: MuscleEquations
    values: FloatArray
    prior_sd: FloatArray


def typical_muscles(
    arm: MuscularArm,
    joint_angles: FloatArray,
    activation: FloatArray,
    *,
    moment_arm_order: int = 2,
    activation_order: int = 1,
    prior_percent: float = 20.0,
) -> TypicalMuscles:
    """The form that `fit_muscle_model` would fit to such conditions.

    Parameters
    ----------
    arm : MuscularArm
    joint_angles : (P, n)
        rad.
    activation : (P, m)
        0..1.
    moment_arm_order, activation_order, prior_percent
        As for `fit_muscle_model`.

    Returns
    -------
    TypicalMuscles

    Raises
    ------
    InputError
        Other joints or muscles than the arm's, or a muscle that is never active.
    """
    if joint_angles.shape[1] != arm.paths.joints:
        problem = f"postures of {joint_angles.shape[1]} joints, an arm of {arm.paths.joints}"
        raise InputError(problem, expected="an arm with the postures' joints")
    highest = activation.max(axis=0)
    if not (highest > 0).all():
        name = arm.paths.muscles[int(highest.argmin())]
        raise InputError(f"{name} is never active", expected="a level of co-contraction above 0")
    lengths = corrected_lengths(
        arm, joint_angles, order=moment_arm_order, prior_part=prior_percent / 100
    )
    kappa = arm.stiffness_per_tension
    equations = MuscleEquations(lengths, activation_order, highest, kappa, True)
    prior = prior_of(equations, arm, 0.1, torque=False)
    return TypicalMuscles(equations, start_of(equations, prior), np.asarray(prior.sd))
