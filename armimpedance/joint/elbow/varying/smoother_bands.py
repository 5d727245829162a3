"""The smoother's bands: between the posterior variance and the estimator's own error."""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded

from armimpedance.core.arrays import FloatArray
from armimpedance.joint.elbow.varying.course import Course
from armimpedance.joint.elbow.varying.data import VaryingData
from armimpedance.joint.elbow.varying.smoother_model import DIFFERENCE, Levels, SmootherModel

#: Draws that carry the prior's share of the variance.
DRAWS: Final = 64
#: Seconds over which the noise let through and the square of the shrinkage are averaged.
VARIANCE_S: Final = 0.3
SHRINKAGE_S: Final = 0.7
#: Share of the posterior variance in the bands' (see `_between`).
POSTERIOR_WEIGHT: Final = 0.25


def own_error(
    course: Course, model: SmootherModel, levels: Levels
) -> tuple[FloatArray, FloatArray]:
    """The prior's share of the variances, and the shrinkage of the course itself, (N, 2) each.

    With information H = F + Q of samples and prior the estimator errs by the noise that it lets
    through, ``H^-1 F H^-1 = H^-1 - H^-1 Q H^-1``, and by ``-H^-1 Q x``. The diagonal of
    ``H^-1 Q H^-1`` is the mean square of H^-1 times draws of covariance Q.
    """
    q = model.unit * np.array([levels.B, levels.K]) ** 2
    n, N = model.torque.shape[1], len(course.B)
    right = np.zeros((n, 1 + DRAWS))
    state = np.zeros(n)
    state[1 :: model.state], state[2 :: model.state] = course.B, course.K
    for rough, level in ((model.rough_B, q[0]), (model.rough_K, q[1])):
        right[:, 0] += _times(rough, state) / level
    rng = np.random.default_rng(0)
    differences = model.differences
    for which, level in enumerate(q, start=1):
        draws = rng.standard_normal((len(differences), DRAWS)) / np.sqrt(level)
        for j, w in enumerate(DIFFERENCE):
            right[model.state * (differences + j) + which, 1:] += w * draws
    factor = cholesky_banded(model.information(levels), lower=True)
    coupling = model.coupling * levels.torque**-2
    solved = np.asarray(cho_solve_banded((factor, True), np.column_stack([right, coupling])))
    V = solved[:, 1 + DRAWS :]
    schur = model.shared * levels.torque**-2 + np.diag(model.shared_prior) - coupling.T @ V
    solved = solved[:, : 1 + DRAWS] + V @ np.linalg.solve(schur, V.T @ right)
    share = (solved[:, 1:] ** 2).mean(axis=1)
    shrunk = solved[:, 0].reshape(N, model.state)
    return share.reshape(N, model.state)[:, 1:3], shrunk[:, 1:3]


def band_variance(
    posterior: FloatArray, share: FloatArray, shrinkage: FloatArray, data: VaryingData
) -> FloatArray:
    """Variances for the bands, (N, 2): a geometric mean of two that err on either side.

    The posterior variance is too wide where the course is smoother than the prior's draws: it
    holds room for changes that are not there. The estimator's own error, noise let through and
    shrinkage as the smoothed course shows it, is a little too narrow where few samples speak and
    the smoothed course cannot show what it missed. Weights: `POSTERIOR_WEIGHT` and the rest; the
    coverage is measured in benchmarks/elbow/varying.py.
    """
    passed = np.maximum(posterior - share, 0.01 * posterior)
    own = np.empty_like(posterior)
    for a, b in zip(data.offsets[:-1], data.offsets[1:], strict=True):
        for k, seconds in ((0, VARIANCE_S), (1, SHRINKAGE_S)):
            width = min(2 * round(seconds * data.rate_hz / 2) + 1, (b - a) // 2 * 2 - 1)
            part = (passed if k == 0 else shrinkage**2)[a:b]
            mean = _moving_mean(part, width)
            own[a:b] = mean if k == 0 else own[a:b] + mean
    return np.asarray(posterior**POSTERIOR_WEIGHT * own ** (1 - POSTERIOR_WEIGHT))


def _moving_mean(values: FloatArray, width: int) -> FloatArray:
    """Hann-weighted mean over `width` (odd) rows of (S, q), reflected at the ends."""
    kernel = np.hanning(width + 2)[1:-1]
    padded = np.pad(values, ((width // 2, width // 2), (0, 0)), mode="reflect")
    columns = [np.convolve(c, kernel / kernel.sum(), "valid") for c in padded.T]
    return np.stack(columns, axis=1)


def _times(banded: FloatArray, x: FloatArray) -> FloatArray:
    """Symmetric lower banded (w, n) times x (n,)."""
    out = banded[0] * x
    for k in range(1, len(banded)):
        out[k:] += banded[k, :-k] * x[:-k]
        out[:-k] += banded[k, :-k] * x[k:]
    return np.asarray(out)
