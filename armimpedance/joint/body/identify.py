"""From a motion recording to identified base parameters: the whole way in one call.

A body on force plates: rows of the root's wrench, motions chosen by how they excite, the rest held
out. A robot: rows of every joint, torque measured, terms for what a joint adds of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final, Literal

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import EstimationError, InputError, NotIdentifiableError
from armimpedance.core.findings import warnings_of
from armimpedance.core.motion import MotionRecording
from armimpedance.core.progress import Progress
from armimpedance.core.skeleton import Skeleton
from armimpedance.joint.body.angle_noise import (
    NoiseShift,
    can_tell_noise,
    no_noise_finding,
    noise_shift,
)
from armimpedance.joint.body.base_parameters import (
    BaseParameters,
    MotionChoice,
    base_parameters,
    choose_motions,
    essential_base_parameters,
    motion_conditions,
    scaled_condition,
)
from armimpedance.joint.body.checks import check_body
from armimpedance.joint.body.equations import BodyEquations, body_equations
from armimpedance.joint.body.estimate import (
    BaseFit,
    BodySolution,
    WeightedSolution,
    clustered_covariance,
    fit_base,
)
from armimpedance.joint.body.methods import METHODS, BodyMethod
from armimpedance.joint.body.plates import plates_findings, weight_finding
from armimpedance.joint.body.result import BodyFit
from armimpedance.joint.body.rows import RowChoice

#: Draws of added noise: the mean shift is then known to .4 of its own spread.
_NOISE_DRAWS: Final = 6
#: Scaled condition above which small errors of the motion decide the parameters.
_POOR_CONDITION: Final = 100.0


def identify_body(
    recording: MotionRecording,
    *,
    method: str = "weighted",
    choice: RowChoice | None = None,
    motions: Sequence[str] | int | None = 4,
    prior: Skeleton | None = None,
    prior_sd: float = 0.3,
    block_s: float = 1.0,
    data_dependent: bool = False,
    noise_draws: int | None = None,
    check: bool = True,
    progress: Progress | None = None,
) -> BodyFit:
    """Identify the base parameters of a body or a robot.

    Parameters
    ----------
    recording : MotionRecording
        With force plates (a body) or torque (a robot).
    method : {"weighted", "consistent", "ls", "prior"}
        Rows weighted by their residuals; every segment physically possible; plain; possible with a
        prior.
    choice : RowChoice, optional
        Default: for a body the root's wrench at 6 Hz, for a fixed root all rows unfiltered.
    motions : names, or how many, or None
        Which trials to fit, by condition; an integer chooses greedily; None takes all.
    prior : Skeleton, optional
        Masses and inertias to start from; by default the recording's skeleton.
    prior_sd : float
        How well the prior's masses are trusted, relative: .3 for 30 %.
    block_s : float
        Blocks of time for robust standard errors, s: longer than the residuals' memory.
    data_dependent : bool
        Take the base parameters that these motions show, instead of refusing when they show fewer
        than the structure has.
    noise_draws : int, optional
        How often noise of the coordinates is added to learn what it does (`angle_noise`), which is
        then taken off; 0 leaves it in. Default: 6, and none for plain least squares or where no
        band is left in which the noise shows.
    check : bool
        Refuse a recording whose units, frame or weight cannot be.
    progress : function, optional
        Called with how much is done, of how much: trials, then draws of noise.

    Returns
    -------
    BodyFit

    Raises
    ------
    InputError
        Something is missing or in another unit or frame; one line says what.
    NotIdentifiableError
        The motions show too little; names the parameters.
    EstimationError
        The physically consistent fit does not settle.
    """
    way, skeleton = METHODS.named(method), recording.skeleton
    if choice is None:
        choice = RowChoice(cutoff_hz=6.0) if skeleton.floating else RowChoice(rows="all")
    draws = _draws(noise_draws, way, recording, choice)
    if check:
        check_body(recording)
    equations = body_equations(recording, choice, progress)
    base = _base(equations, skeleton, choice, data_dependent)
    chosen = _chosen(equations, base, motions)
    fitted = equations.subset(list(chosen.chosen))
    _refuse_silence(fitted, base)
    least = _least_squares(fitted, base, way.weighting)
    robust = clustered_covariance(
        recording, choice, base, least, block_s=block_s, trials=chosen.chosen
    )
    inflation = float(np.median(np.diag(robust) / np.diag(least.fit.covariance)))
    fitted_motion = recording.select(chosen.chosen)
    noise = _noise_shift(fitted_motion, choice, base, least, draws, progress)
    solution = BodySolution(least.values, least.fit.covariance, robust).without(noise)
    expected = (prior or skeleton, prior_sd)
    given = WeightedSolution(fitted, base, least, solution, inflation, noise, *expected)
    if way.improve is not None:
        solution = way.improve(given)
    checks = (
        *solution.checks,
        no_noise_finding(recording, choice) if noise is None else noise.finding,
        *plates_findings(
            recording,
            choice,
            base,
            least,
            chosen.chosen,
            block_s=block_s,
            noise_share=None if noise is None else noise.share,
        ),
        *weight_finding(recording),
    )
    solution = replace(solution, checks=checks)
    return _result(method, recording, choice, equations, chosen, given, solution)


def _draws(
    asked: int | None, method: BodyMethod, recording: MotionRecording, choice: RowChoice
) -> int:
    """How often noise is added.

    Raises InputError: a number that shows no spread, or any where it would have no effect.
    """
    usable = method.weighting != "none" and can_tell_noise(recording, choice)
    if asked is None:
        return _NOISE_DRAWS if usable else 0
    if asked != 0 and asked < 2:
        raise InputError(f"{asked} draws of noise", expected="2 or more, or 0")
    if asked and not usable:
        raise InputError(
            "draws of noise have no effect here",
            expected="weighted rows, and a filter far below half of the sample rate",
        )
    return asked


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
) -> NoiseShift | None:
    """What noise of the angles has done to the estimate; None where nothing is drawn."""
    if not draws:
        return None

    def again(recording: MotionRecording) -> FloatArray:
        return fit_base(body_equations(recording, choice), base, "levels").values

    return noise_shift(fitted, choice, again, least.values, draws=draws, progress=progress)


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


def _result(
    method: str,
    recording: MotionRecording,
    rows: RowChoice,
    equations: BodyEquations,
    chosen: MotionChoice,
    given: WeightedSolution,
    solution: BodySolution,
) -> BodyFit:
    base, least = given.base, given.least
    phi = base.lift(solution.values) if solution.phi is None else solution.phi
    direct = given.equations.validate(phi)
    squares = (least.weights**2 * direct.squares).sum()
    left = (least.weights**2 * direct.residual_squares).sum()
    warnings = least.fit.warnings
    if least.fit.cond_scaled > _POOR_CONDITION:
        poor = (
            f"the motions excite poorly (scaled condition {least.fit.cond_scaled:.0f}): small "
            "errors of the motion decide some parameters"
        )
        warnings = (*warnings, poor)
    return BodyFit(
        method=method,
        base=base,
        parameters=solution.parameters(base, least.fit.dof),
        phi=solution.phi,
        phi_sd=solution.phi_sd,
        least=least.fit,
        vaf=float(1 - left / squares) if squares > 0 else float("nan"),
        recording=recording,
        rows=rows,
        choice=chosen,
        fitted=direct,
        held_out=equations.subset(list(chosen.rest)).validate(phi) if chosen.rest else None,
        inflation=given.inflation,
        noise=given.noise,
        warnings=(*warnings, *warnings_of(solution.checks)),
        checks=solution.checks,
    )
