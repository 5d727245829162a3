"""What a smoother or a search for jumps makes of cells."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord


@dataclass(frozen=True, eq=False)
class Found(FrozenRecord):
    """Courses at n cells.

    Attributes
    ----------
    mean, variance : (n, m)
        B, K, reflex gain if there is one, offset.
    inertia, var_inertia : float
    evidence : float
        Logarithm of the marginal likelihood.
    noise : float
        Variance of the white noise.
    begins : (n,) or (0,)
        Probability that courses jump at the beginning of each cell; none where they are smooth.
    """

    mean: Annotated[FloatArray, "n m"]
    variance: Annotated[FloatArray, "n m"]
    inertia: float
    var_inertia: float
    evidence: float
    noise: float
    begins: Annotated[FloatArray, "k"] = field(default_factory=lambda: np.zeros(0))


def joined(parts: list[tuple[Found, int, int]]) -> Found:
    """Pieces of a record one after another: of each the cells from the one number to the other."""
    weight = np.array([1 / p.var_inertia for p, _, _ in parts])
    values = np.array([p.inertia for p, _, _ in parts])
    return Found(
        mean=np.concatenate([p.mean[a:b] for p, a, b in parts]),
        variance=np.concatenate([p.variance[a:b] for p, a, b in parts]),
        inertia=float(weight @ values / weight.sum()),
        var_inertia=float(1 / weight.sum()),
        evidence=float(sum(p.evidence for p, _, _ in parts)),
        noise=float(np.mean([p.noise for p, _, _ in parts])),
        begins=np.concatenate([p.begins[a:b] for p, a, b in parts]),
    )
