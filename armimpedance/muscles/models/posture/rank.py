"""Whether postures can tell the terms of a polynomial apart."""

from __future__ import annotations

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.numerics.regression import Conditioning, conditioning, refuse_rank_loss


def checked_rank(X: FloatArray, names: tuple[str, ...], order: int) -> Conditioning:
    """Condition of a regressor X (P, p), refused where postures cannot tell its columns apart.

    Raises
    ------
    NotIdentifiableError
        Names the terms.
    InputError
        Fewer postures than terms.
    """
    p, count = len(X), len(names)
    if p < count:
        raise InputError(
            f"{p} postures for the {count} coefficients of order {order}: rank {p} at most for the "
            f"terms {', '.join(names)}",
            expected=f"{count} different postures or more, or a lower order",
        )
    state = conditioning(np.asarray(np.linalg.qr(X, mode="r")), p)
    refuse_rank_loss(state, names)
    return state
