"""Which Gram matrices stand for the muscles of an arm, and what roughness of moment arms costs.

With ``K_j = G^T K_m G`` and moment arms that are polynomials of the scaled angles, every muscle
adds ``f g g^T``, g = (d_s, d_e). All muscles together are one Gram matrix over the monomials of
d_s and d_e, positive semidefinite because stiffness is not negative. A single-joint muscle is a
two-joint one whose other moment arm is zero: blocks of their own would add nothing to the set.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.muscles.models.posture.certificate import GramShape
from armimpedance.muscles.models.posture.terms import exponents

#: What it costs that a moment arm at one joint varies with the other joint's angle, against with
#: its own: chosen by simulation, where anything from 3 to 30 does about as well
#: (docs/muscles/posture_why.md).
OTHER_JOINT = 10.0


def full(order: int) -> tuple[GramShape, ...]:
    """Two-joint moment arms depend on both angles, eq. (37)."""
    both = exponents(order)
    return (GramShape("1", both, both),)


def separable(order: int) -> tuple[GramShape, ...]:
    """All moment arms depend on the angle of their own joint only."""
    k = np.arange(order + 1)
    return (GramShape("1", np.stack([k, 0 * k], axis=1), np.stack([0 * k, k], axis=1)),)


def box(order: int) -> tuple[GramShape, ...]:
    """Definite on the box only: ``K = B^T Q_0 B + sum_j (1 - u_j^2) B_j^T Q_j B_j``."""
    if order == 0:
        return full(0)
    lower = exponents(order - 1)
    return (
        *full(order),
        GramShape("1 - s^2", lower, lower),
        GramShape("1 - e^2", lower, lower),
    )


STRUCTURES: dict[str, Callable[[int], tuple[GramShape, ...]]] = {
    "full": full,
    "separable": separable,
    "box": box,
}


def roughness(shape: GramShape) -> FloatArray:
    """What each monomial of a moment arm costs, (size,): the square of its degree.

    Nothing for a constant, so that an arm with constant moment arms is not shrunk; more by
    `OTHER_JOINT` where the angle of the other joint takes part. A multiplier is of degree 2 and
    counts as one degree of the moment arm.
    """
    extra = 0 if shape.multiplier == "1" else 1
    costs = []
    for powers, other in ((shape.shoulder, 1), (shape.elbow, 0)):
        degree = powers.sum(axis=1) + extra
        costs.append(degree**2 * np.where(powers[:, other] > 0, OTHER_JOINT, 1.0))
    return np.concatenate(costs)
