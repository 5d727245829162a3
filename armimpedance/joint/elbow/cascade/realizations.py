"""Least squares over realizations, trials of one course: each cell or segment by itself."""

from __future__ import annotations

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray
from armimpedance.joint.elbow.cascade.found import Found
from armimpedance.joint.elbow.cascade.method import Courses
from armimpedance.joint.elbow.cascade.task import Task


def over_realizations(task: Task, segment_s: float) -> Courses:
    """I, B, K and gain by least squares over all trials, in a segment about every cell.

    Parameters
    ----------
    task : Task
        Aligned trials.
    segment_s : float
        Length of the segments; 0: a cell.
    """
    cells = task.cells()
    n, m = len(cells.rows), cells.courses
    half = round(segment_s / cells.width / 2)
    sums = np.concatenate([np.zeros((1, m + 2, m + 2)), cells.products]).cumsum(axis=0)
    count = np.concatenate([[0], np.cumsum(cells.rows)])
    at = np.arange(n)
    low, high = np.maximum(at - half, 0), np.minimum(at + half + 1, n)
    total, rows = sums[high] - sums[low], count[high] - count[low]
    values, variances = _least_squares(total, rows)
    known = np.asarray(np.isfinite(values).all(axis=1))
    weight = 1 / variances[known, m]
    # neighbouring segments share their rows
    shared = max(float(rows[known].sum() / max(cells.rows.sum(), 1)), 1.0)
    found = Found(
        mean=_filled(values[:, :m], known),
        variance=_filled(variances[:, :m], known),
        inertia=float(weight @ values[known, m] / weight.sum()),
        var_inertia=float(shared / weight.sum()),
        evidence=0.0,
        noise=0.0,
    )
    length = segment_s or cells.width
    trials = len(task.data.trials)
    note = f"least squares over {trials} realizations in segments of {1e3 * length:.3g} ms"
    return Courses(found, task, (note,))


def _least_squares(total: FloatArray, rows: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Values and variances (n, p) of sums of products (n, p + 1, p + 1); NaN where too few rows."""
    p = total.shape[1] - 1
    A, b = total[:, :p, :p], total[:, :p, p]
    d = 1 / np.sqrt(np.maximum(np.einsum("nii->ni", A), 1e-300))
    good = rows > 2 * p
    values, variances = (np.full((len(total), p), np.nan) for _ in range(2))
    inverse = np.linalg.pinv(A[good] * d[good][:, :, None] * d[good][:, None, :], hermitian=True)
    inverse *= d[good][:, :, None] * d[good][:, None, :]
    values[good] = (inverse @ b[good][..., None])[..., 0]
    left = total[good, p, p] - np.einsum("ni,ni->n", values[good], b[good])
    noise = np.maximum(left, 0) / (rows[good] - p)
    variances[good] = np.einsum("nii->ni", inverse) * noise[:, None]
    return values, variances


def _filled(values: FloatArray, known: BoolArray) -> FloatArray:
    """The ends, where there are no rows, as their nearest neighbours."""
    at = np.flatnonzero(known)
    nearest = at[np.abs(np.arange(len(values))[:, None] - at).argmin(axis=1)]
    return np.asarray(values[nearest])
