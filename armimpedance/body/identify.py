"""From a motion recording to identified base parameters: the whole way in one call.

A body on force plates: rows of the root's wrench, motions chosen by how they excite, the rest held
out. A robot: rows of every joint, torque measured, terms for what a joint adds of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from armimpedance.arrays import FloatArray
from armimpedance.body.angle_noise import NoiseShift, Progress, can_tell_noise, noise_shift
from armimpedance.body.base_parameters import (
    BaseParameters,
    base_parameters,
    essential_base_parameters,
)
from armimpedance.body.checks import check_body
from armimpedance.body.consistent import ConsistentFit, fit_consistent
from armimpedance.body.equations import BodyEquations, body_equations
from armimpedance.body.estimate import BaseFit, clustered_covariance, fit_base
from armimpedance.body.exciting import (
    MotionChoice,
    choose_motions,
    motion_conditions,
    scaled_condition,
)
from armimpedance.body.parameters import inertial_parameters, moving_segments
from armimpedance.body.result import BodyFit
from armimpedance.body.rows import RowChoice
from armimpedance.body.validation import validate
from armimpedance.errors import EstimationError, InputError, NotIdentifiableError
from armimpedance.motion import MotionRecording
from armimpedance.skeleton import Skeleton

Method = Literal["least_squares", "weighted", "consistent", "prior"]
METHODS: tuple[Method, ...] = ("least_squares", "weighted", "consistent", "prior")
#: Human motion on force plates: slower than this, and noise of differentiated angles above it.
CUTOFF_HZ = 6.0
#: Draws of added noise: the mean shift is then known to .4 of its own spread.
NOISE_DRAWS = 6
#: Scaled condition above which small errors of the motion decide the parameters.
_POOR_CONDITION = 100.0


@dataclass(frozen=True)
class _Found:
    """Base values, covariances, and all parameters where the method has them."""

    values: FloatArray
    covariance: FloatArray
    robust: FloatArray
    phi: FloatArray | None = None
    phi_sd: FloatArray | None = None


def identify_body(
    recording: MotionRecording,
    *,
    method: Method = "weighted",
    choice: RowChoice | None = None,
    motions: Sequence[str] | int | None = 4,
    prior: Skeleton | None = None,
    prior_sd: float = 0.3,
    block_s: float = 1.0,
    data_dependent: bool = False,
    noise_draws: int = NOISE_DRAWS,
    check: bool = True,
    progress: Progress | None = None,
) -> BodyFit:
    """Identify the base parameters of a body or a robot.

    Parameters
    ----------
    recording : MotionRecording
        With force plates (a body) or torque (a robot).
    method : {"least_squares", "weighted", "consistent", "prior"}
        Plain; rows weighted by their residuals; every segment physically possible; the same with a
        prior.
    choice : RowChoice, optional
        Default: for a body the root's wrench at `CUTOFF_HZ`, for a fixed root all rows unfiltered.
    motions : names, or how many, or None
        Which trials to fit, by condition; an integer chooses greedily; None takes all.
    prior : Skeleton, optional
        Masses and inertias to start from; by default the recording's skeleton.
    prior_sd : float
        Relative; see `consistent.fit_consistent`.
    block_s : float
        Blocks of time for robust standard errors: longer than the residuals' memory.
    data_dependent : bool
        Take the base parameters that these motions show, instead of refusing when they show fewer
        than the structure has.
    noise_draws : int
        How often noise of the coordinates is added to learn what it does (`angle_noise`), which is
        then taken off; 0 leaves it in. Never for plain least squares, nor without a filter.
    check : bool
        Refuse a recording whose units, frame or weight cannot be.
    progress : function, optional
        Called with how many draws of noise are done, of how many.

    Raises
    ------
    InputError
        Something is missing or in another unit or frame; one line says what.
    NotIdentifiableError
        The motions show too little; names the parameters.
    EstimationError
        The physically consistent fit does not settle.
    """
    if method not in METHODS:
        raise InputError(f"no method {method!r}", expected=", ".join(METHODS))
    skeleton = recording.skeleton
    if choice is None:
        choice = RowChoice(cutoff_hz=CUTOFF_HZ) if skeleton.floating else RowChoice(rows="all")
    if check:
        check_body(recording)
    equations = body_equations(recording, choice)
    base = _base(equations, skeleton, choice, data_dependent)
    chosen = _chosen(equations, base, motions)
    fitted = equations.subset(list(chosen.chosen))
    _refuse_silence(fitted, base)
    least = _least_squares(fitted, base, "none" if method == "least_squares" else "levels")
    robust = clustered_covariance(
        recording, choice, base, least, block_s=block_s, trials=chosen.chosen
    )
    inflation = float(np.median(np.diag(robust) / np.diag(least.fit.covariance)))
    noise = None
    if noise_draws > 0 and method != "least_squares" and can_tell_noise(recording, choice):
        fitted_motion = recording.select(chosen.chosen)
        noise = _noise_shift(fitted_motion, choice, base, least, noise_draws, progress)
    found = _without_noise(_Found(least.values, least.fit.covariance, robust), noise)
    if method in ("consistent", "prior"):
        better = fit_consistent(
            fitted,
            base,
            least.weights,
            _guess(prior or skeleton),
            prior_sd=prior_sd if method == "prior" else None,
            inflation=max(inflation, 1.0),
            about=None if noise is None else found.values,
        )
        found = _of_consistent(better, base, found, inflation)
    return _result(method, equations, base, chosen, least, found, inflation, noise)


def _base(
    equations: BodyEquations, skeleton: Skeleton, choice: RowChoice, data_dependent: bool
) -> BaseParameters:
    if not data_dependent:
        return essential_base_parameters(skeleton, choice)
    p = len(equations.columns)
    return base_parameters(equations.stacked()[:p, :p], equations.columns, equations.column_units)


def _noise_shift(
    fitted: MotionRecording,
    choice: RowChoice,
    base: BaseParameters,
    least: BaseFit,
    draws: int,
    progress: Progress | None,
) -> NoiseShift:
    def again(recording: MotionRecording) -> FloatArray:
        return fit_base(body_equations(recording, choice), base, "levels").values

    return noise_shift(fitted, choice, again, least.values, draws=draws, progress=progress)


def _without_noise(found: _Found, noise: NoiseShift | None) -> _Found:
    if noise is None:
        return found
    return replace(
        found,
        values=found.values - noise.shift,
        covariance=found.covariance + noise.covariance,
        robust=found.robust + noise.covariance,
    )


def _guess(skeleton: Skeleton) -> FloatArray:
    massless = [s.name for s in moving_segments(skeleton) if not s.mass_kg > 0]
    if massless:
        raise InputError(
            f"no mass of {massless[0]} to start from",
            expected="a prior skeleton with masses and inertias, from a table for example",
        )
    return inertial_parameters(skeleton)


def _chosen(
    equations: BodyEquations, base: BaseParameters, motions: Sequence[str] | int | None
) -> MotionChoice:
    if isinstance(motions, int):
        return choose_motions(equations, base, most=motions)
    names = tuple(equations.motions if motions is None else motions)
    unknown = [name for name in names if name not in equations.motions]
    if unknown or not names:
        raise InputError(
            f"no motion {unknown[0] if unknown else ''!r}", expected=", ".join(equations.motions)
        )
    trials = [t for t, motion in enumerate(equations.motions) if motion in names]
    return MotionChoice(
        tuple(trials),
        tuple(equations.motions[t] for t in trials),
        (scaled_condition(equations.subset(trials), base),),
        motion_conditions(equations, base),
    )


def _refuse_silence(fitted: BodyEquations, base: BaseParameters) -> None:
    """Refuse motions in which a parameter's columns hold rounding only.

    Scaled to unit length, rounding looks like excitation: still postures without noise would show
    every inertia.
    """
    p = len(fitted.columns)
    try:
        shown = base_parameters(fitted.stacked()[:p, :p], fitted.columns, fitted.column_units)
    except EstimationError:
        return  # noise of the motion: nothing is rounding only
    if shown.rank < base.rank:
        lost = tuple(name for name in base.names if name not in shown.names)
        named = f"{', '.join(lost[:3])}{' …' if len(lost) > 3 else ''}"
        raise NotIdentifiableError(
            f"{', '.join(dict.fromkeys(fitted.motions))} excite too little: {shown.rank} of "
            f"{base.rank} parameters show, not {named}",
            lost,
        )


def _least_squares(
    fitted: BodyEquations, base: BaseParameters, weighting: Literal["none", "levels"]
) -> BaseFit:
    try:
        return fit_base(fitted, base, weighting)
    except NotIdentifiableError as error:
        raise NotIdentifiableError(
            f"{', '.join(fitted.motions)} excite too little: {error}", error.parameters
        ) from error


def _of_consistent(
    better: ConsistentFit, base: BaseParameters, least: _Found, inflation: float
) -> _Found:
    """With a prior the curvature says how far to trust; without, the least-squares fit does."""
    if better.covariance is None:
        return replace(least, values=better.base, phi=better.phi)
    # C_b (b, b) = B (b, p) C (p, p) B^T
    robust = base.mapping @ better.covariance @ base.mapping.T
    sd = np.sqrt(np.diag(better.covariance))
    return _Found(better.base, robust / max(inflation, 1.0), robust, better.phi, sd)


def _result(
    method: Method,
    equations: BodyEquations,
    base: BaseParameters,
    chosen: MotionChoice,
    least: BaseFit,
    found: _Found,
    inflation: float,
    noise: NoiseShift | None,
) -> BodyFit:
    phi = base.lift(found.values) if found.phi is None else found.phi
    fitted = equations.subset(list(chosen.chosen))
    direct = validate(fitted, phi)
    squares = (least.weights**2 * direct.squares).sum()
    left = (least.weights**2 * direct.residual_squares).sum()
    warnings = list(least.fit.warnings)
    if least.fit.cond_scaled > _POOR_CONDITION:
        warnings.append(
            f"the motions excite poorly (scaled condition {least.fit.cond_scaled:.0f}): small "
            "errors of the motion decide some parameters"
        )
    return BodyFit(
        method=method,
        base=base,
        values=found.values,
        covariance=found.covariance,
        covariance_robust=found.robust,
        dof=least.fit.dof,
        phi=found.phi,
        phi_sd=found.phi_sd,
        cond_raw=least.fit.cond_raw,
        cond_scaled=least.fit.cond_scaled,
        n_rows=least.fit.n_rows,
        r2=least.fit.r2,
        vaf=float(1 - left / squares) if squares > 0 else float("nan"),
        choice=chosen,
        fitted=direct,
        held_out=validate(equations.subset(list(chosen.rest)), phi) if chosen.rest else None,
        inflation=inflation,
        noise=noise,
        warnings=tuple(warnings),
    )
