"""Identify base parameters from a motion recording in one call.

For a body on force plates the rows are those of the root's wrench; motions that excite well are
fitted, the others are held out. For a robot the rows are those of every joint, with measured torque
and joint terms.
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

#: Draws of added noise: the mean shift is then known to .4 of its spread.
_NOISE_DRAWS: Final = 6
#: Scaled condition above which small errors of the motion change the parameters strongly.
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
        Recording with force plates (a body) or torque (a robot).
    method : {"weighted", "consistent", "ls", "prior"}
        Rows weighted by their residuals; physically consistent segments; plain least squares;
        physically consistent with a prior.
    choice : RowChoice, optional
        Default: for a body the root's wrench at 6 Hz, for a fixed root all rows unfiltered.
    motions : names, int or None
        Conditions to fit; an integer: so many at most, chosen greedily; None: all.
    prior : Skeleton, optional
        Masses and inertias to start from; by default the recording's skeleton.
    prior_sd : float
        Relative standard deviation of the prior's masses: .3 for 30 %.
    block_s : float
        Blocks of time for robust standard errors, s: longer than the residuals are correlated.
    data_dependent : bool
        True to fit the base parameters that these motions show, instead of refusing if they show
        fewer than the structure has.
    noise_draws : int, optional
        Number of draws of added noise to estimate the bias from noise of the coordinates
        (`angle_noise`), which is then removed; 0: it is not removed. Default: 6, and 0 for plain
        least squares or if there is no band in which the noise is visible.
    check : bool
        True to refuse a recording with impossible units, frame or weight.
    progress : function, optional
        Called with the number of steps done and their total: trials, then draws of noise.

    Returns
    -------
    BodyFit

    Raises
    ------
    InputError
        Something is missing or in another unit or frame; the message names it.
    NotIdentifiableError
        The motions do not show all parameters; the error names them.
    EstimationError
        The physically consistent fit does not converge.
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
    start = WeightedSolution(fitted, base, least, solution, inflation, noise, *expected)
    if way.improve is not None:
        solution = way.improve(start)
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
    return _result(method, recording, choice, equations, chosen, start, solution)


def _draws(
    requested: int | None, method: BodyMethod, recording: MotionRecording, choice: RowChoice
) -> int:
    """Number of draws of noise.

    Raises InputError: a single draw, which shows no spread, or draws that have no effect.
    """
    usable = method.weighting != "none" and can_tell_noise(recording, choice)
    if requested is None:
        return _NOISE_DRAWS if usable else 0
    if requested != 0 and requested < 2:
        raise InputError(f"{requested} draws of noise", expected="2 or more, or 0")
    if requested and not usable:
        raise InputError(
            "draws of noise have no effect here",
            expected="weighted rows, and a filter far below half of the sample rate",
        )
    return requested


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
    """Bias of the estimate from noise of the angles; None without draws."""
    if not draws:
        return None

    def estimate(recording: MotionRecording) -> FloatArray:
        return fit_base(body_equations(recording, choice), base, "levels").values

    return noise_shift(fitted, choice, estimate, least.values, draws=draws, progress=progress)


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
    """Refuse motions in which a parameter's columns contain only rounding.

    When columns are scaled to unit length, rounding looks like excitation: still postures without
    noise would seem to show every inertia.
    """
    p = len(fitted.columns)
    try:
        shown = base_parameters(fitted.stacked()[:p, :p], fitted.columns, fitted.column_units)
    except EstimationError:
        return  # noise of the motion: no column is rounding only
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
    start: WeightedSolution,
    solution: BodySolution,
) -> BodyFit:
    base, least = start.base, start.least
    phi = base.lift(solution.values) if solution.phi is None else solution.phi
    direct = start.equations.validate(phi)
    squares = (least.weights**2 * direct.squares).sum()
    residual = (least.weights**2 * direct.residual_squares).sum()
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
        vaf=float(1 - residual / squares) if squares > 0 else float("nan"),
        recording=recording,
        rows=rows,
        choice=chosen,
        fitted=direct,
        held_out=equations.subset(list(chosen.rest)).validate(phi) if chosen.rest else None,
        inflation=start.inflation,
        noise=start.noise,
        warnings=(*warnings, *warnings_of(solution.checks)),
        checks=solution.checks,
    )
