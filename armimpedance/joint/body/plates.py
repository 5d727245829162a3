"""Do plates and motion belong together: weight, the time between them, where the plates lie."""

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

#: A scale tells a person's mass to this part, clothes and shoes included.
_SCALE: Final = 0.02
#: Standard errors beyond which something counts as seen, and the least that matters: of a delay,
#: s, and of a plate's place, m, and turn, rad.
_SEEN: Final = 3.5
_SHORTEST_S: Final = 1e-3
_NEAREST_M: Final = 0.01
_TURN: Final = 0.0175
#: A place's error, m, over the part of an acceleration that is noise: angles of 2 mrad, a fifth of
#: an acceleration, read as 7 to 11 mm. Where that part is not known it is taken as so much.
_BY_NOISE_M: Final = 0.1
_UNKNOWN_SHARE: Final = 0.2
_ROUNDING: Final = 1e-9
_UP: Final = np.array([0.0, 0.0, 1.0])


def weight_finding(recording: MotionRecording) -> tuple[Finding, ...]:
    """Whether the plates show the body's weight; nothing where one of the two is not known."""
    mass = known_mass_kg(recording)
    if not recording.skeleton.floating or recording.wrenches is None or mass is None:
        return ()
    sd = (recording.subject.mass_sd_kg or 0.0) / mass
    tolerance = max(_SCALE, _SEEN * sd)
    mean = float(recording.wrenches[..., 2].sum(axis=1).mean())
    off = mean / (mass * GRAVITY_M_S2) - 1
    smallest = f"{100 * tolerance:.0f} %"
    said = f"the plates show {100 * off:+.1f} % of the body's weight of {mass:.4g} kg"
    if abs(off) <= tolerance:
        return (Finding("weight", "ok", said, smallest=smallest),)
    said += ": a plate's gain or the mass is wrong, and all parameters with it"
    return (Finding("weight", "warning", said, smallest=smallest),)


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
    """Whether plates (or torques) and motion are in step, and each plate where the file says.

    Late by T, what is measured is ``w - T dw/dt``; a plate that is off by d adds ``d x F`` to the
    moment, one that is turned by psi about the vertical ``psi z x F``. All are coefficients beside
    the regressor, fitted together; their covariance is clustered by blocks of time.

    `trials`: those that were fitted.
    `block_s`: blocks of time, longer than the residuals' memory.
    `noise_share`: part of an acceleration that is noise of the angles, where it is known.
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
    # h (b, c) = (W^T W)^-1 W^T A: what of the columns the regressor holds
    h = np.linalg.solve(R, np.linalg.solve(R.T, np.sum(WA, axis=0)))
    # sums of a block: of what is left of the columns, with the residual and with the columns
    of_block = np.array(Ae) - np.array(We) @ h
    own = np.array(AA) - h.T @ np.array(WA)
    gram = own.sum(axis=0)
    size_of = np.sqrt(np.maximum(np.diag(gram), 1e-300))
    # a plate that bears nothing has no column
    inverse = np.linalg.pinv(gram / np.outer(size_of, size_of), rcond=_ROUNDING, hermitian=True)
    inverse = inverse / np.outer(size_of, size_of)
    found = inverse @ of_block.sum(axis=0)
    scores = (of_block - own @ found) @ inverse
    share = _UNKNOWN_SHARE if noise_share is None else noise_share
    near = max(_NEAREST_M, _BY_NOISE_M * share)
    least = [_SHORTEST_S, *(near, near, _TURN) * _plates(recording, choice)]
    return _told(found, np.sqrt((scores**2).sum(axis=0)), np.array(least))


def _columns(
    recording: MotionRecording, choice: RowChoice, row: int, trial: TrialRows
) -> FloatArray:
    """What lateness, then each plate's place (x, y) and turn would add to the rows, (S, R, c)."""
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
            kept = choice.kept(len(q), rate)
            columns.append(wrench_on_root(np.hstack(change)[:, None], q)[kept])
    return np.stack(columns, axis=-1)


def _plates(recording: MotionRecording, choice: RowChoice) -> int:
    """How many plates' places can be told: of rows that are the root's wrench alone."""
    alone = recording.skeleton.floating and choice.rows == "base" and not choice.passive_joints
    wrenches = recording.wrenches
    if wrenches is None or recording.plate_origins_m is None or not alone:
        return 0
    return int(wrenches.shape[1])


def _told(found: FloatArray, sd: FloatArray, matters: FloatArray) -> tuple[Finding, ...]:
    least = np.maximum(_SEEN * sd, matters)
    shown, smallest = f"{1e3 * found[0]:+.1f} ms", f"{1e3 * least[0]:.1f} ms"
    if abs(found[0]) <= least[0]:
        skew = Finding("skew", "ok", f"plates or torques {shown} late", smallest=smallest)
    else:
        said = f"plates or torques come {shown} late ({1e3 * sd[0]:.1f} ms standard error)"
        said += ", and errors may exceed the intervals: shift their time"
        skew = Finding("skew", "warning", said, smallest=smallest)
    return (skew, *_placed(found[1:].reshape(-1, 3), least[1:].reshape(-1, 3)))


def _placed(found: FloatArray, least: FloatArray) -> tuple[Finding, ...]:
    """What is said of each plate's place and turn (K, 3)."""
    if not len(found):
        return ()
    near, turn = 1e3 * least[:, :2].max(), np.degrees(least[:, 2].max())
    smallest = f"{near:.0f} mm, {turn:.1f} degrees"
    for plate, (at, most) in enumerate(zip(found, least, strict=True)):
        if (np.abs(at) > most).any():
            told = f"{1e3 * at[0]:+.0f}, {1e3 * at[1]:+.0f} mm, {np.degrees(at[2]):+.1f} degrees"
            said = f"number {plate + 1} lies {told} from where the file has it"
            said += ", and errors may exceed the intervals: measure its corners"
            return (Finding("plate", "warning", said, smallest=smallest),)
    return (Finding("plate", "ok", "all lie where the file has them", smallest=smallest),)
