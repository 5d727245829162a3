"""The monomials of the two joint angles that moment arms and joint impedance are made of."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.errors import InputError

#: Above this order a polynomial has more coefficients (91) than an experiment has postures.
MAX_ORDER = 6

_SHORT = ("s", "e")


def checked_order(order: object) -> int:
    """The order L of moment arms.

    Raises
    ------
    InputError
        Not a whole number from 0 to `MAX_ORDER`.
    """
    whole = isinstance(order, int | np.integer) and not isinstance(order, bool)
    if not whole or not 0 <= int(order) <= MAX_ORDER:  # type: ignore[call-overload]
        raise InputError(f"moment arms of order {order}", expected=f"0 to {MAX_ORDER}")
    return int(order)  # type: ignore[call-overload]


def exponents(degree: int) -> IntArray:
    """Exponents (terms, 2) of all monomials up to a total degree, the lowest degree first.

    (degree + 1)(degree + 2)/2 terms: 1, 6, 15 for 2L = 0, 2, 4.
    """
    both = [(d - i, i) for d in range(degree + 1) for i in range(d + 1)]
    return np.array(both, dtype=np.int64)


def monomials(scaled: ArrayLike, powers: IntArray) -> FloatArray:
    """Values (..., terms) of ``u_s^i u_e^j`` at scaled angles (..., 2)."""
    u = np.asarray(scaled, dtype=float)
    highest = int(powers.max(initial=0))
    # (..., 2, highest + 1): by repeated products, exact where a power is 0 or 1
    ladder = np.ones((*u.shape, highest + 1))
    for k in range(1, highest + 1):
        ladder[..., k] = ladder[..., k - 1] * u
    return np.asarray(ladder[..., 0, powers[:, 0]] * ladder[..., 1, powers[:, 1]])


def term_names(powers: IntArray) -> tuple[str, ...]:
    """Names of the monomials: ``1, s, e, s^2, s e, e^2``; s and e are the scaled angles."""
    return tuple(_term_name(row) for row in powers)


def _term_name(row: IntArray) -> str:
    parts = [
        name if power == 1 else f"{name}^{power}"
        for name, power in zip(_SHORT, row, strict=True)
        if power
    ]
    return " ".join(parts) or "1"
