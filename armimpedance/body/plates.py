"""Do plates and motion belong together: the weight that they show, and the time between them."""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.body.base_parameters import BaseParameters
from armimpedance.body.checks import known_mass_kg
from armimpedance.body.estimate import BaseFit
from armimpedance.body.rows import RowChoice, each_trial
from armimpedance.findings import Finding
from armimpedance.motion import MotionRecording
from armimpedance.regression import split_blocks
from armimpedance.skeleton import GRAVITY_M_S2

#: A scale tells a person's mass to this part, clothes and shoes included.
_SCALE: Final = 0.02
#: Standard errors beyond which something counts as seen, and the shortest delay that matters, s.
_SEEN: Final = 3.0
_SHORTEST_S: Final = 1e-3


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


def skew_finding(
    recording: MotionRecording,
    choice: RowChoice,
    base: BaseParameters,
    solved: BaseFit,
    trials: tuple[int, ...],
    *,
    block_s: float,
) -> Finding:
    """Whether plates (or torques) and motion are in step.

    Late by T, what is measured is ``w - T dw/dt``: T is the coefficient of ``-dw/dt`` beside the
    regressor, and its standard error is clustered by blocks of time.

    Parameters
    ----------
    recording : MotionRecording
    choice : RowChoice
    base : BaseParameters
    solved : BaseFit
    trials : tuple of int
        Those that were fitted.
    block_s : float
        Blocks of time, longer than the residuals' memory.

    Returns
    -------
    Finding
    """
    size = max(round(block_s * recording.sample_rate_hz), 1)
    products, scores, squares, moved = [], [], [], []
    for t, trial in enumerate(each_trial(recording, choice)):
        if t not in trials:
            continue
        W = trial.W[..., base.leading] * solved.weights[:, None]
        e = trial.w * solved.weights - W @ solved.values
        slope = -np.gradient(trial.w * solved.weights, axis=0) * recording.sample_rate_hz
        for g in split_blocks(len(W), size) if len(W) >= 2 * size else (slice(None),):
            products.append((slope[g] * e[g]).sum())
            squares.append((slope[g] ** 2).sum())
            scores.append(np.einsum("src,sr->c", W[g], e[g]))
            moved.append(np.einsum("src,sr->c", W[g], slope[g]))
    R = solved.fit.triangle
    # h (b,) = (W^T W)^-1 W^T (-dw/dt): what of the slope the regressor holds
    h = np.linalg.solve(R, np.linalg.solve(R.T, np.sum(moved, axis=0)))
    # sums of a block: of what is left of the slope, times the residual, and times the slope
    of_block = np.array(products) - np.array(scores) @ h
    own = np.array(squares) - np.array(moved) @ h
    late = float(of_block.sum() / own.sum())
    return _told(late, float(np.linalg.norm(of_block - late * own) / own.sum()))


def _told(late_s: float, sd_s: float) -> Finding:
    least = max(_SEEN * sd_s, _SHORTEST_S)
    shown, smallest = f"{1e3 * late_s:+.2g} ms", f"{1e3 * least:.2g} ms"
    if abs(late_s) <= least:
        return Finding("skew", "ok", f"plates or torques {shown} late", smallest=smallest)
    return Finding(
        "skew",
        "warning",
        f"plates or torques come {shown} late ({1e3 * sd_s:.2g} ms standard error), and errors may "
        "exceed the intervals: shift their time, and record a synchronising pulse",
        smallest=smallest,
    )
