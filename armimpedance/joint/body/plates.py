"""Check plates against motion: weight, time shift, and place of the plates."""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.findings import Finding
from armimpedance.core.motion import MotionRecording
from armimpedance.core.skeleton import GRAVITY_M_S2
from armimpedance.joint.body.base_parameters import BaseParameters
from armimpedance.joint.body.checks import known_mass_kg
from armimpedance.joint.body.estimate import BaseFit
from armimpedance.joint.body.rows import RowChoice, TrialRows, each_trial, wrench_on_root
from armimpedance.numerics.regression import split_blocks
from armimpedance.numerics.signals import lowpass

#: Relative error of a person's mass by a scale, with clothes and shoes.
_SCALE: Final = 0.02
#: Standard errors from which an effect counts as detected, and the least values that matter: of a
#: delay, s, and of a plate's place, m, and rotation, rad.
_SEEN: Final = 3.5
_SHORTEST_S: Final = 1e-3
_NEAREST_M: Final = 0.01
_TURN: Final = 0.0175
#: Apparent error of a place, m, over the share of an acceleration that is noise: noise of 2 mrad, a
#: fifth of an acceleration, looks like 7 to 11 mm. And the share that is assumed if not known.
_BY_NOISE_M: Final = 0.1
_UNKNOWN_SHARE: Final = 0.2
_ROUNDING: Final = 1e-9
_UP: Final = np.array([0.0, 0.0, 1.0])


def weight_finding(recording: MotionRecording) -> tuple[Finding, ...]:
    """Finding on whether the plates show the body's weight; empty if either is not known."""
    mass = known_mass_kg(recording)
    if not recording.skeleton.floating or recording.wrenches is None or mass is None:
        return ()
    sd = (recording.subject.mass_sd_kg or 0.0) / mass
    tolerance = max(_SCALE, _SEEN * sd)
    mean = float(recording.wrenches[..., 2].sum(axis=1).mean())
    off = mean / (mass * GRAVITY_M_S2) - 1
    smallest = f"{100 * tolerance:.0f} %"
    message = f"the plates show {100 * off:+.1f} % of the body's weight of {mass:.4g} kg"
    if abs(off) <= tolerance:
        return (Finding("weight", "ok", message, smallest=smallest),)
    message += ": a plate's gain or the mass is wrong, and all parameters with it"
    return (Finding("weight", "warning", message, smallest=smallest),)


def plates_findings(
    recording: MotionRecording,
    choice: RowChoice,
    base: BaseParameters,
    solved: BaseFit,
    trials: tuple[int, ...],
    *,
    block_s: float,
    noise_share: float | None,
) -> tuple[Finding, ...]:
    """Findings on the time between plates (or torques) and motion, and on each plate's place.

    With a delay T the measurement is ``w - T dw/dt``. A plate that is displaced by d adds ``d x F``
    to the moment; a plate that is rotated by psi about the vertical adds ``psi z x F``. These
    coefficients are fitted together with the regressor; their covariance is clustered by blocks of
    time.

    `trials`: the fitted trials.
    `block_s`: length of blocks, longer than the residuals are correlated.
    `noise_share`: share of an acceleration that is noise of the angles, if known.
    """
    size = max(round(block_s * recording.sample_rate_hz), 1)
    AA, Ae, WA, We = [], [], [], []
    for t, trial in enumerate(each_trial(recording, choice)):
        if t not in trials:
            continue
        W = trial.W[..., base.leading] * solved.weights[:, None]
        e = trial.w * solved.weights - W @ solved.values
        A = _columns(recording, choice, t, trial) * solved.weights[:, None]
        for g in split_blocks(len(W), size) if len(W) >= 2 * size else (slice(None),):
            AA.append(np.einsum("src,srd->cd", A[g], A[g]))
            Ae.append(np.einsum("src,sr->c", A[g], e[g]))
            WA.append(np.einsum("src,srd->cd", W[g], A[g]))
            We.append(np.einsum("src,sr->c", W[g], e[g]))
    R = solved.fit.triangle
    # h (b, c) = (W^T W)^-1 W^T A: projection of the columns on the regressor
    h = np.linalg.solve(R, np.linalg.solve(R.T, np.sum(WA, axis=0)))
    # sums over a block: products of the projected columns with the residual, and with the columns
    of_block = np.array(Ae) - np.array(We) @ h
    own = np.array(AA) - h.T @ np.array(WA)
    gram = own.sum(axis=0)
    size_of = np.sqrt(np.maximum(np.diag(gram), 1e-300))
    # a plate without load has a column of zeros
    inverse = np.linalg.pinv(gram / np.outer(size_of, size_of), rcond=_ROUNDING, hermitian=True)
    inverse = inverse / np.outer(size_of, size_of)
    estimates = inverse @ of_block.sum(axis=0)
    scores = (of_block - own @ estimates) @ inverse
    share = _UNKNOWN_SHARE if noise_share is None else noise_share
    near = max(_NEAREST_M, _BY_NOISE_M * share)
    least = [_SHORTEST_S, *(near, near, _TURN) * _plates(recording, choice)]
    return _told(estimates, np.sqrt((scores**2).sum(axis=0)), np.array(least))


def _columns(
    recording: MotionRecording, choice: RowChoice, row: int, trial: TrialRows
) -> FloatArray:
    """Columns (S, R, c) of a delay, then of each plate's place (x, y) and rotation."""
    rate, at = recording.sample_rate_hz, recording.samples_of(row)
    columns = [-np.gradient(trial.w, axis=0) * rate]
    q = lowpass(recording.coordinates[at], choice.cutoff_hz, rate, axis=0)
    wrenches, origins = recording.wrenches, recording.plate_origins_m
    for plate in range(_plates(recording, choice)):
        if wrenches is None or origins is None:
            break
        own = lowpass(wrenches[at, plate], choice.cutoff_hz, rate, axis=0)
        force, moment = own[:, :3], own[:, 3:]
        up, still = np.cross(_UP, force), np.zeros_like(force)
        turned = np.cross(origins[plate], up) + np.cross(_UP, moment)
        for change in (
            (still, np.cross(np.eye(3)[0], force)),
            (still, np.cross(np.eye(3)[1], force)),
            (up, turned),
        ):
            inner = choice.kept(len(q), rate)
            columns.append(wrench_on_root(np.hstack(change)[:, None], q)[inner])
    return np.stack(columns, axis=-1)


def _plates(recording: MotionRecording, choice: RowChoice) -> int:
    """Number of plates whose places can be tested: only for rows of the root's wrench alone."""
    root_only = recording.skeleton.floating and choice.rows == "base" and not choice.passive_joints
    wrenches = recording.wrenches
    if wrenches is None or recording.plate_origins_m is None or not root_only:
        return 0
    return int(wrenches.shape[1])


def _told(estimates: FloatArray, sd: FloatArray, matters: FloatArray) -> tuple[Finding, ...]:
    least = np.maximum(_SEEN * sd, matters)
    shown, smallest = f"{1e3 * estimates[0]:+.1f} ms", f"{1e3 * least[0]:.1f} ms"
    if abs(estimates[0]) <= least[0]:
        skew = Finding("skew", "ok", f"plates or torques {shown} late", smallest=smallest)
    else:
        message = f"plates or torques come {shown} late ({1e3 * sd[0]:.1f} ms standard error)"
        message += ", and errors may exceed the intervals: shift their time"
        skew = Finding("skew", "warning", message, smallest=smallest)
    return (skew, *_placed(estimates[1:].reshape(-1, 3), least[1:].reshape(-1, 3)))


def _placed(estimates: FloatArray, least: FloatArray) -> tuple[Finding, ...]:
    """Finding on each plate's place and rotation (K, 3)."""
    if not len(estimates):
        return ()
    near, turn = 1e3 * least[:, :2].max(), np.degrees(least[:, 2].max())
    smallest = f"{near:.0f} mm, {turn:.1f} degrees"
    for plate, (at, most) in enumerate(zip(estimates, least, strict=True)):
        if (np.abs(at) > most).any():
            place = f"{1e3 * at[0]:+.0f}, {1e3 * at[1]:+.0f} mm, {np.degrees(at[2]):+.1f} degrees"
            message = f"number {plate + 1} lies {place} from where the file has it"
            message += ", and errors may exceed the intervals: measure its corners"
            return (Finding("plate", "warning", message, smallest=smallest),)
    return (Finding("plate", "ok", "all lie where the file has them", smallest=smallest),)
