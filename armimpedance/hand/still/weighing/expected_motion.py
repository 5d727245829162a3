"""What a trial's motion should be, judged from the other trials: instruments free of its noise.

The noise of a trial's own position makes its regressors larger than the motion and the estimate
smaller than the truth; noise of other trials does not.
"""

from __future__ import annotations

import numpy as np

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.hand.still.weighing.modal import ModalEquation

#: The shared course is used if it explains at least this much of every trial's displacement.
LEAST_SHARED = 0.8


def expected_motion(equation: ModalEquation) -> FloatArray | None:
    """Regressors (T, r d, n) of every trial as expected from the others; None if they are unlike.

    The course over time that all other trials share, along the trial's own direction. Disturbances
    of one group have one course even where every direction was tried only once.
    """
    motion = equation.motion
    displacement = motion[:, 2]
    T, d, n = displacement.shape
    if T < 3:
        return None
    # the course that explains most displacement over trials and axes
    course = np.linalg.svd(displacement.reshape(T * d, n), full_matrices=False)[2][0]
    along = displacement @ course
    explained = (along**2).sum(axis=1) / np.maximum((displacement**2).sum(axis=(1, 2)), 1e-300)
    if not explained.min() >= LEAST_SHARED:
        return None
    # (T, r, n): motion along the trial's own direction, weighted by its size
    parts = (motion * along[:, None, :, None]).sum(axis=2)
    power = (along**2).sum(axis=1)
    others = (parts.sum(axis=0) - parts) / (power.sum() - power)[:, None, None]
    return np.asarray((others[:, :, None, :] * along[:, None, :, None]).reshape(T, -1, n))


def mean_of_others(columns: FloatArray, labels: IntArray) -> FloatArray:
    """Mean (T, ...) over the other trials with the same label; zero where there are none."""
    total = np.zeros((int(labels.max()) + 1, *columns.shape[1:]))
    np.add.at(total, labels, columns)
    others = np.bincount(labels)[labels] - 1
    mean = (total[labels] - columns) / np.maximum(others, 1)[:, None, None]
    return np.where((others > 0)[:, None, None], mean, 0.0)
