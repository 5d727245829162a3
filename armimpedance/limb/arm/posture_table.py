"""Moment arms of an arm of n joints, known at any postures: lengths that are polynomials."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError, NotIdentifiableError
from armimpedance.limb.arm.polynomial_paths import (
    FittedPaths,
    PolynomialPaths,
    fit_paths,
    monomial_exponents,
)

#: Orders of the moment arms over posture that are tried: the highest that the postures tell.
HIGHEST_ORDER: Final = 3
#: Moment arms that no smooth length has may be off by this part of the muscle's own (rms), as those
#: of a table over shoulder and elbow.
LARGEST_MISFIT: Final = 0.1
#: A joint with smaller moment arms (m) everywhere is not spanned.
_NO_ARM_M: Final = 1e-6


def paths_of_table(
    muscles: tuple[str, ...], q: Sequence[FloatArray], G: Sequence[FloatArray]
) -> PolynomialPaths:
    """Lengths whose gradients are nearest to tabled moment arms.

    Parameters
    ----------
    muscles : (m,) tuple of str
    q : (m,) sequence of (P, n)
        Postures of each muscle's rows, rad; the same for all.
    G : (m,) sequence of (P, n)
        Moment arms dL/dq there, m.

    Returns
    -------
    PolynomialPaths
        Its box is the range of the postures.

    Raises
    ------
    InputError
        A muscle has other postures than the first one, or moment arms that no such length has.
    NotIdentifiableError
        The postures tell not even a constant arm.
    """
    for name, own in zip(muscles, q, strict=True):
        if own.shape != q[0].shape or (own != q[0]).any():
            raise InputError(
                f"muscle {name} at other postures than {muscles[0]}",
                expected="all muscles at the same postures, in the same order",
            )
    arms = np.stack(G, axis=1)
    fitted = _highest(muscles, q[0], arms)
    size = np.sqrt((arms**2).sum(axis=2).mean(axis=0))
    apart = np.sqrt((fitted.rms**2).sum(axis=1))
    for name, missed, own in zip(muscles, apart, size, strict=True):
        if missed > LARGEST_MISFIT * own:
            raise InputError(
                f"muscle {name}: no smooth length has these moment arms (they miss by "
                f"{1e3 * missed:.2g} mm rms of {1e3 * own:.2g} mm)",
                expected=f"at most {100 * LARGEST_MISFIT:g} %: dG_i/dq_j and dG_j/dq_i are one",
            )
    return fitted.paths


def _highest(muscles: tuple[str, ...], q: FloatArray, G: FloatArray) -> FittedPaths:
    """The paths of the highest order that the postures tell with as many numbers to spare."""
    P, n = q.shape
    spans = (np.abs(G) > _NO_ARM_M).any(axis=0)
    for order in range(HIGHEST_ORDER, 0, -1):
        if n * P < 2 * len(monomial_exponents(n, order + 1)):
            continue
        try:
            return fit_paths(muscles, q, G, order, spans)
        except NotIdentifiableError:
            continue
    return fit_paths(muscles, q, G, 0, spans)
