"""Are I, B and K the same in every part of the band? A limb of another kind betrays itself there.

Soft tissue, a strap, a second joint: where no kind of limb that is fitted describes the record,
each part of the band asks for other I, B and K, and an error that counts lines does not know of it.
The best model is solved again without each of some parts (a jackknife over frequency).
"""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray

#: Parts of the band, of equal numbers of lines.
PARTS: Final = 10
#: Squares of what I, B, K move without a part, over what the lines allow: from here no chance.
NO_CHANCE: Final = 16.0


def excess_over_bands(
    X: FloatArray, y: FloatArray, eta: FloatArray, frequency: FloatArray, bound: FloatArray
) -> FloatArray:
    """By how much I, B and K vary over the band more than their lines allow, (3,); 1: they do not.

    Parameters
    ----------
    X : (n, 2, p)
        Real and imaginary part of each line's columns; the first three are those of I, B and K.
    y : (n, 2)
    eta : (n,)
        Logarithm of the noise power over what the rows are weighed by.
    frequency : (n,)
        Order of the lines.
    bound : (p,)
        One over the variance of each parameter before the record; 0 = free.

    Returns
    -------
    (3,)
        Ratio of what leaving out a part moves to what the lines allow.
    """
    size = np.sqrt((X**2).sum(axis=(0, 1))) + np.finfo(float).tiny
    weight = np.exp(-eta)
    part = np.empty(len(y), dtype=int)
    part[np.argsort(frequency)] = np.arange(len(y)) * PARTS // len(y)
    rows = X / size
    # A_b (p, p) = X^T W X and b_b (p,) = X^T W y of each part
    A = np.stack([_gram(rows[part == b], rows[part == b], weight[part == b]) for b in range(PARTS)])
    b = np.stack(
        [_gram(rows[part == b], y[part == b, :, None], weight[part == b]) for b in range(PARTS)]
    )
    prior = np.diag(bound / size**2)
    whole, target = A.sum(axis=0) + prior, b.sum(axis=0)
    # p_b (p,) = (A - A_b)^-1 (b - b_b), whose variance beyond p's is (A - A_b)^-1 - A^-1
    moved = np.linalg.solve(whole - A, target - b)[:, :3, 0] - np.linalg.solve(whole, target)[:3, 0]
    allowed = np.linalg.inv(whole - A) - np.linalg.inv(whole)
    ratio = (moved**2).sum(axis=0) / np.diagonal(allowed, axis1=1, axis2=2).sum(axis=0)[:3]
    return np.sqrt(np.where(ratio > NO_CHANCE, ratio, 1.0))


def _gram(left: FloatArray, right: FloatArray, weight: FloatArray) -> FloatArray:
    """``sum w left^T right`` over lines and their two parts."""
    return np.asarray(np.einsum("nip,niq,n->pq", left, right, weight))
