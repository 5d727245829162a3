"""Does the motion determine M, B and K? If not, said in the words of the experiment."""

from __future__ import annotations

import numpy as np

from armimpedance.core.errors import NotIdentifiableError
from armimpedance.numerics.regression import TrialFactors, pool


def require_identifiable(factors: TrialFactors) -> None:
    """Refuse what no method can solve.

    Raises
    ------
    NotIdentifiableError
        No movement, movement along one direction only, or columns that depend on each other.
    """
    try:
        pool(factors)
    except NotIdentifiableError as error:
        raise _directions_missing(error, factors) from error


def _directions_missing(error: NotIdentifiableError, factors: TrialFactors) -> NotIdentifiableError:
    """Say it in the words of the experiment where the motion keeps to one direction."""
    d = len(factors.outputs)
    displacement = factors.r[:, :, 2 * d : 3 * d]
    stacked = displacement.reshape(-1, d)
    values, vectors = np.linalg.svd(stacked, full_matrices=False)[1:]
    if values[0] == 0.0:
        return NotIdentifiableError("no movement: nothing can be identified", error.parameters)
    if d > 1 and values[-1] < 1e-6 * values[0]:
        axis = ", ".join(f"{v:.2f}" for v in vectors[0])
        return NotIdentifiableError(
            f"the hand moved along one direction only ({axis}): what the other directions do "
            f"cannot be identified; {error}",
            error.parameters,
        )
    return error
