"""Estimation of M, B, K and a reflex from random perturbations, for each group of trials."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.errors import InputError, NotIdentifiableError
from armimpedance.core.estimates import ImpedanceEstimate, Quality
from armimpedance.core.findings import warnings_of
from armimpedance.core.progress import Progress
from armimpedance.core.records import Recording
from armimpedance.hand.random.commands import (
    Commands,
    check_follows,
    check_joints,
    commands_of,
)
from armimpedance.hand.random.doubts import (
    doubts_of,
    misfit_of,
    of_elbow,
    of_wrist,
    refuse_impossible,
)
from armimpedance.hand.random.equations import (
    Averaged,
    allow_for_inner,
    averaged,
    equations_at,
    noise_weight,
    residual,
)
from armimpedance.hand.random.lines import (
    Complex,
    Explained,
    Lines,
    explained_by,
    itself,
    lines_of,
    share_explained,
)
from armimpedance.hand.random.pieces import check_pieces
from armimpedance.hand.random.random_fit import RandomFit, ReflexPart, response_matrix
from armimpedance.hand.still import elbow_told, groups_of, is_wrist_free
from armimpedance.numerics.criticism import refuse_size

METHOD: Final = "refined instruments"
#: Number of rounds in which the noise's spectrum and the parameters are estimated in turn.
ROUNDS: Final = 3
#: A larger lag (s) is corrected before the next round, since its column is linear about zero.
SMALL_LAG_S: Final = 2e-4
#: Smallest reciprocal condition of the scaled equations.
LEAST_RCOND: Final = 1e-10


@dataclass(frozen=True, eq=False)
class _Solved:
    """Result of the rounds: lines with the lag corrected, the weights and the parameters."""

    lines: Lines
    weight: Complex
    left: Complex
    answer: Averaged
    lag_s: float


def identify_random(
    recording: Recording,
    by: Sequence[str] = ("condition",),
    band_hz: tuple[float, float] | None = None,
    progress: Progress | None = None,
) -> list[RandomFit]:
    """Fit every group of trials.

    Parameters
    ----------
    recording : Recording
        Of a hand, or of two or three joints, under a random perturbation.
    by : sequence of str
        Columns of the groups.
    band_hz : (low, high), optional
        Default: the band in which the commands have power, at most 25 Hz.
    progress : callable, optional
        Called with ``(groups done, groups in all)``.

    Returns
    -------
    list of RandomFit
        One for each group.

    Raises
    ------
    InputError
        The recording lacks commands, is short, its limb does not follow its commands, or, for
        joints, it holds degrees or does not state which torque it holds.
    NotIdentifiableError
        The motion does not determine M, B and K.
    EstimationError
        The inertia is negative or of an impossible size: a unit, a sign or the axes differ from
        those stated in the recording.
    """
    if recording.perturbation != "stochastic":
        raise InputError(
            f"a perturbation that is {recording.perturbation!r}",
            column="perturbation",
            expected="'stochastic' in recording.json",
        )
    if recording.axes < 2:
        raise InputError("one axis", expected="two or three (`elbow` takes one joint)")
    of_joints = check_joints(recording)
    commands, groups = commands_of(recording), tuple(groups_of(recording, by))
    fits = []
    for done, (keys, rows) in enumerate(groups, 1):
        fit = _of_group(recording, commands, keys, rows, band_hz)
        refuse_size(fit.estimate, recording.subject.mass_kg)
        fits.append(replace(fit, estimate=fit.estimate.marked(of_joints)))
        if progress is not None:
            progress(done, len(groups))
    return fits


def _of_group(
    recording: Recording,
    commands: Commands,
    keys: Mapping[str, Any],
    rows: IntArray,
    band_hz: tuple[float, float] | None,
) -> RandomFit:
    all_lines = lines_of(recording, rows, commands.values)
    band = all_lines.excited_band() if band_hz is None else band_hz
    lines = all_lines.within(band)
    explained = explained_by(lines) if commands.told else itself(lines)
    if commands.told:
        check_follows(*_shares(lines, explained))
    solved = _in_turns(lines, explained)
    refuse_impossible(solved.answer, lines.axes)
    return _fit(recording, commands, keys, rows, band, explained, solved)


def _shares(lines: Lines, explained: Explained) -> tuple[FloatArray, FloatArray]:
    """Trials, and the explained share of each trial's motion: of all axes, in equal units."""
    trials = np.unique(lines.trial)
    shares = []
    for t in trials:
        at = lines.trial == t
        shares.append(float(share_explained(lines.motion[0][at], explained.motion[at]).max()))
    return trials.astype(float), np.array(shares)


def _in_turns(lines: Lines, explained: Explained) -> _Solved:
    """Estimate parameters and noise in turn, starting from equal weights."""
    d, lag_s = lines.axes, 0.0
    weight: Complex = np.broadcast_to(np.eye(d, dtype=complex), (len(lines.frequency_hz), d, d))
    theta, delay_s = _first(lines, explained, weight), None
    left = residual(lines, theta, delay_s)
    for _ in range(ROUNDS):
        weight = noise_weight(lines, left)
        K = theta[:-1].reshape(d, -1)[:, 2 * d : 3 * d]
        equations = partial(equations_at, lines, explained, weight)
        answer = averaged(equations, (K + K.T) / 2, lag_seen=lag_s != 0)
        theta, delay_s = _rows(answer)
        if abs(theta[-1]) > SMALL_LAG_S:
            moved = np.exp(lines.s * theta[-1])
            lag_s += float(theta[-1])
            lines = replace(lines, force=lines.force * moved)
            explained = replace(explained, force=explained.force * moved)
            theta[-1] = 0.0
        left = residual(lines, theta, delay_s)
    return _Solved(lines, weight, left, answer, lag_s)


def _first(lines: Lines, explained: Explained, weight: Complex) -> FloatArray:
    """Estimate rows of [M B K], with equal weights and without a lag.

    Raises NotIdentifiableError: the equations are singular.
    """
    plain = equations_at(lines, explained, weight, None)
    A, b = plain.A[:-1, :-1], plain.b[:-1]
    scale = 1 / np.sqrt(np.maximum(np.diag(plain.meat)[:-1], 1e-300))
    scaled = A * scale[:, None] * scale
    values = np.linalg.svd(scaled, compute_uv=False)
    if not values[-1] > LEAST_RCOND * values[0]:
        raise NotIdentifiableError(
            "the commands do not move the hand in so many ways that M, B and K can be told apart: "
            "all axes need commands of their own",
            ("M", "B", "K"),
        )
    return np.append(scale * np.linalg.solve(scaled, scale * b), 0.0)


def _rows(answer: Averaged) -> tuple[FloatArray, float | None]:
    """Rows of [M B K R], T, and the delay: with a reflex if that is likelier, else without."""
    reflex = answer.reflex_probability > 0.5
    values = answer.with_reflex if reflex else answer.values
    q = (len(values) - 1) // 4
    d = round(np.sqrt(q))
    matrices = values[:-1].reshape(4, d, d)[: 4 if reflex else 3]
    theta = np.append(np.concatenate(list(matrices), axis=1).ravel(), values[-1])
    return theta, answer.best_delay_s if reflex else None


def _fit(
    recording: Recording,
    commands: Commands,
    keys: Mapping[str, Any],
    rows: IntArray,
    band: tuple[float, float],
    explained: Explained,
    solved: _Solved,
) -> RandomFit:
    answer, lines = solved.answer, solved.lines
    d = lines.axes
    matrices = answer.values[:-1].reshape(4, d, d)
    reflex = _reflex(answer, d)
    likely = answer.with_reflex if answer.reflex_probability > 0.5 else answer.values
    shape = likely[:-1].reshape(4, d, d)
    response = response_matrix(lines, explained.motion, shape, reflex.delay_s)
    misfit = misfit_of(lines, explained.motion, solved.left, solved.weight)
    lag_s = solved.lag_s + float(answer.values[-1])
    in_space = d == 3 and recording.kind == "hand"
    elbow = elbow_told(recording, rows) if in_space else "held"
    estimate = _estimate(recording, keys, rows, matrices, solved, response.multiple, band)
    reflex_detected = reflex.probability > 0.5
    if elbow != "held" and not reflex_detected:
        estimate = allow_for_inner(estimate, lines, explained, solved.weight, elbow)
    session = check_pieces(recording, rows, commands, band, lag_s)
    fit = RandomFit(
        estimate,
        reflex,
        lag_s,
        answer.lag_probability,
        band,
        response,
    )
    warnings = (
        *commands.warnings,
        *doubts_of(fit, misfit),
        *warnings_of(session),
        *fit.estimate.not_definite(),
        *(of_elbow(elbow) if reflex_detected else ()),
        *of_wrist(free=in_space and is_wrist_free(recording, rows)),
    )
    return replace(fit, estimate=fit.estimate.with_warning(*warnings))


def _reflex(answer: Averaged, d: int) -> ReflexPart:
    q = d * d
    R, sd = answer.with_reflex[3 * q : 4 * q], np.sqrt(np.diag(answer.reflex_covariance))
    K = answer.with_reflex[2 * q : 3 * q]
    delay, delay_sd = answer.delay
    return ReflexPart(
        answer.reflex_probability,
        R.reshape(d, d),
        sd[3 * q : 4 * q].reshape(d, d),
        delay,
        delay_sd,
        float(R @ K / (K @ K)),
    )


def _estimate(
    recording: Recording,
    keys: Mapping[str, Any],
    rows: IntArray,
    matrices: FloatArray,
    solved: _Solved,
    coherence: FloatArray,
    band: tuple[float, float],
) -> ImpedanceEstimate:
    lines, d = solved.lines, solved.lines.axes
    with_handle, B, K = matrices[:3]
    handle = recording.handle_mass_kg if recording.kind == "hand" else 0.0
    q = 3 * d * d
    power = float((np.abs(lines.force) ** 2).sum())
    vaf = 1 - float((np.abs(solved.left) ** 2).sum()) / power
    used = recording.select(rows)
    condition = _condition(solved.answer.covariance[:q, :q])
    quality = Quality(
        n_trials=len(rows),
        n_rows=2 * d * len(lines.frequency_hz),
        multiple_correlation=float(np.sqrt(max(vaf, 0.0))),
        vaf=vaf,
        cond_raw=condition,
        cond_scaled=condition,
        rank=q,
        residual_sd=float(np.sqrt((np.abs(solved.left) ** 2).mean())),
        coherence=float(coherence.mean()),
    )
    return ImpedanceEstimate(
        level=recording.kind,
        method=METHOD,
        inertia=with_handle - handle * np.eye(d),
        inertia_with_handle=with_handle,
        viscosity=B,
        stiffness=K,
        covariance=solved.answer.covariance[:q, :q],
        dof=float(len(lines.frequency_hz)),
        quality=quality,
        keys=keys,
        position=used.position.mean(axis=0),
        force=used.force.mean(axis=0),
        shoulder_m=recording.shoulder_m,
        provenance=(
            f"{METHOD}, {len(lines.frequency_hz)} lines from {band[0]:.3g} to {band[1]:.3g} Hz, "
            f"{lines.per_hz:.4g} s",
        ),
    )


def _condition(covariance: FloatArray) -> float:
    """Scaled condition of the equations whose inverse is a covariance."""
    sd = np.sqrt(np.diag(covariance))
    return float(np.linalg.cond(covariance / np.outer(sd, sd)))
