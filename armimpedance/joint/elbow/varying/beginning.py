"""Where every time-varying method begins: the subject's own torque, and a free course."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.linalg.lapack import dtbtrs

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import EstimationError
from armimpedance.joint.elbow.varying.autoregression import Autoregression
from armimpedance.joint.elbow.varying.course import Course
from armimpedance.joint.elbow.varying.data import VaryingData
from armimpedance.joint.elbow.varying.equation import linearise, start
from armimpedance.joint.elbow.varying.smoother import (
    INTENSITY_RANGE,
    START_INTENSITY,
    course_of,
    factor_of,
    settle,
)
from armimpedance.joint.elbow.varying.smoother_model import (
    DIFFERENCE,
    Levels,
    SmootherModel,
    smoother_model,
)
from armimpedance.joint.elbow.varying.voluntary import own_torque, residual_of

#: Rounds of the first courses: near enough to see what their residuals hold.
FIRST_ROUNDS: Final = 4
#: Freer than any course that can be told: +-30 % at 3 Hz asks for less, s^-1.5.
FREE_INTENSITY: Final = 30.0
#: The torque may change the inertia of a constant joint by this part.
INERTIA_KEPT: Final = 0.3
#: Rounds that look for the subject's own torque, the draws of each, and the change of its rms and
#: its innovation that ends them.
OWN_ROUNDS: Final = 12
OWN_DRAWS: Final = 8
#: Rounds in which the order may change.
ORDER_ROUNDS: Final = 3
OWN_SETTLED: Final = 0.01


@dataclass(frozen=True)
class Beginning:
    """Data with the subject's own torque, a course that is free to vary, levels that are near.

    `unexplained` is a sentence where the residuals hold much, and no such torque describes it.
    """

    data: VaryingData
    course: Course
    levels: Levels
    unexplained: str = ""


def begin(data: VaryingData, tick: Callable[[], None] = lambda: None) -> Beginning:
    """The data with the torque that the subject adds unasked, and a free course under it.

    A fast course must not be mistaken for such a torque: the torque has to show in the residuals of
    a course that is free to vary as fast as can be resolved. It is then estimated by expectation
    and maximisation: the uncertainty of the course is added to the power of the residuals.

    Parameters
    ----------
    data : VaryingData
    tick : function
        Called after each step.
    """
    constant = start(data)
    scale = np.array([np.abs(constant.B).mean(), np.abs(constant.K).mean()])
    usual = Levels(START_INTENSITY, START_INTENSITY, 1.0)
    course = settle(data, constant, usual, scale, strict=False, rounds=FIRST_ROUNDS)
    tick()
    if not _own_torque_again(data, course, usual, scale).data.own.order:
        return Beginning(data, course, usual)
    tick()
    free = Levels(FREE_INTENSITY, FREE_INTENSITY, 1.0)
    course = settle(data, course, free, scale, strict=False, rounds=FIRST_ROUNDS)
    tick()
    if not _own_torque_again(data, course, free, scale).data.own.order:
        return Beginning(data, course, free)
    begun = _maximised(data, constant, usual, scale, tick)
    if abs(begun.course.inertia / constant.inertia - 1) > INERTIA_KEPT:
        return Beginning(data, course, free, _no_torque(begun, constant))
    return begun


def with_own_torque(
    data: VaryingData, constant: Course, intensity: float, tick: Callable[[], None]
) -> Beginning | None:
    """The torque that the subject adds, found from above: all that a constant course leaves.

    None where the weights that it gives change the inertia: it is no such torque.

    Parameters
    ----------
    data : VaryingData
    constant : Course
    intensity : float
        Of B and K, from which the rounds start, s^-1.5.
    tick : function
        Called after each step.
    """
    scale = np.array([np.abs(constant.B).mean(), np.abs(constant.K).mean()])
    try:
        begun = _maximised(data, constant, Levels(intensity, intensity, 1.0), scale, tick)
    except EstimationError:
        return None
    kept = abs(begun.course.inertia / constant.inertia - 1) <= INERTIA_KEPT
    return begun if kept else None


def _no_torque(begun: Beginning, constant: Course) -> str:
    """Inertia is what fast motion says most surely: weights that change it are wrong, or it was."""
    return (
        "the residuals hold far more than the sensors' noise; weighed as a torque of the subject's "
        f"own, I would be {begun.course.inertia:.2g}, not {constant.inertia:.2g} kg m^2: such a "
        "torque that is large, or an equation that does not hold up to the band's edge (give a "
        "lower cut-off); B and K are not to be trusted, their bands rest on white noise; ask the "
        "subject to relax, or average over trials"
    )


def _maximised(
    data: VaryingData,
    constant: Course,
    levels: Levels,
    scale: FloatArray,
    tick: Callable[[], None],
) -> Beginning:
    """Rounds from above: what a constant course leaves, all taken for the subject's own."""
    begun = Beginning(replace(data, own=own_torque(residual_of(data, constant))), constant, levels)
    for turn in range(OWN_ROUNDS):
        before = begun.data.own
        near = before if turn >= ORDER_ROUNDS else None
        tick()
        begun = _own_torque_again(begun.data, begun.course, begun.levels, scale, near)
        own = begun.data.own
        moved = np.abs([own.rms - before.rms, own.sd - before.sd])
        if (moved <= OWN_SETTLED * np.array([own.rms, own.sd])).all():
            break
    return begun


def _own_torque_again(
    data: VaryingData,
    course: Course,
    levels: Levels,
    scale: FloatArray,
    near: Autoregression | None = None,
) -> Beginning:
    """One round of expectation and maximisation over v and the levels of B and K."""
    eq = linearise(data, course)
    model = smoother_model(data, eq, scale)
    factor = factor_of(model, levels)
    course = course_of(course, model, levels, factor)
    drawn = _draws(model, factor)
    at = eq.centre
    # torque x1 dB + x0 dK by which the course may be wrong, (R, M)
    doubt = eq.x1[:, None] * drawn[at, 1] + eq.x0[:, None] * drawn[at, 2]
    own = own_torque(residual_of(data, course, doubt), near)
    if own.order:
        levels = _expected_levels(model, course, drawn)
    return Beginning(replace(data, own=own), course, levels)


def _draws(model: SmootherModel, factor: FloatArray) -> FloatArray:
    """Draws (N, state, M) of the smoothed states about their mean."""
    white = np.random.default_rng(0).standard_normal((factor.shape[1], OWN_DRAWS))
    # C^T x = z: x has the covariance (C C^T)^-1
    x, info = dtbtrs(factor, white, uplo="L", trans="T")
    if info != 0:
        raise EstimationError("the smoother's information matrix is not positive definite")
    return np.asarray(x).reshape(-1, model.state, OWN_DRAWS)


def _expected_levels(model: SmootherModel, course: Course, drawn: FloatArray) -> Levels:
    """Levels that the second differences of the course and its draws have."""
    intensities = []
    for which, values in ((1, course.B), (2, course.K)):
        both = np.concatenate([values[:, None], values[:, None] + drawn[:, which]], axis=1)
        steps = sum(w * both[model.differences + j] for j, w in enumerate(DIFFERENCE))
        # E[(D x)^2] = (D mean)^2 + mean over draws of (D draw)^2, of draws about the mean
        mean, draws = np.asarray(steps)[:, :1], np.asarray(steps)[:, 1:]
        square = (mean**2).mean() + ((draws - mean) ** 2).mean()
        intensities.append(float(np.sqrt(square / model.unit[which - 1])))
    B, K = np.clip(intensities, *INTENSITY_RANGE)
    return Levels(float(B), float(K), 1.0)
