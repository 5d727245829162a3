"""Which combinations of EMG amplitudes can be told apart beyond their errors.

A course K(t), B(t) does not need the muscles' coefficients one by one: where flexor and extensor
move together, or errors make most of what tells them apart, the combination that does move carries
the law.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import NotIdentifiableError
from armimpedance.numerics.regression import ErrorMoments, refuse_unreliable

#: Part of a combination's power that errors do not explain, below which it is left out.
LEAST_RELIABLE: Final = 0.3
#: Power of a combination, over that of its parts, below which it does not move.
LEAST_POWER: Final = 1e-9


@dataclass(frozen=True, eq=False)
class Directions:
    """Combinations (c) of m amplitudes.

    Attributes
    ----------
    weights : (m, c)
        The identity where all amplitudes are told apart.
    complete : bool
        Whether they are.
    told : str
    warnings : tuple of str
    """

    weights: FloatArray
    complete: bool = True
    told: str = "the amplitudes"
    warnings: tuple[str, ...] = ()


def directions_of(
    amplitude: FloatArray, sd: FloatArray | None, words: tuple[str, ...]
) -> Directions:
    """The amplitudes (N, m) themselves, or those combinations that errors do not explain.

    Parameters
    ----------
    amplitude : (N, m)
    sd : (m,) or None
        Their standard errors.
    words : m str
        What the muscles are called.

    Raises
    ------
    NotIdentifiableError
        Errors explain most of every combination.
    """
    about = amplitude - amplitude.mean(axis=0)
    m = len(words)
    errors = np.zeros(m) if sd is None else len(amplitude) * sd**2
    moments = ErrorMoments(
        (about.T @ about)[None],
        np.zeros((1, m)),
        np.diag(errors)[None],
        tuple(f"the {word}'s amplitude" for word in words),
        ("",) * m,
    )
    refused: NotIdentifiableError | None = None
    try:
        if refuse_unreliable(moments)[0] >= LEAST_RELIABLE:
            return Directions(np.eye(m))
    except NotIdentifiableError as error:
        refused = error
    length = np.sqrt(np.diag(moments.gram[0]))
    # combinations v of amplitudes of unit length: G (m, m) v = power v
    power, v = np.linalg.eigh(moments.gram[0] / np.outer(length, length))
    share = ((errors / length**2) @ v**2) / np.maximum(power, LEAST_POWER)
    kept = (power > LEAST_POWER * power[-1]) & (share <= 1 - LEAST_RELIABLE)
    if not kept.any():
        raise refused or NotIdentifiableError(
            "errors explain most of every combination of the EMG amplitudes", moments.names
        )
    weights = v[:, kept][:, ::-1] / length[:, None]
    weights = weights / weights[np.abs(weights).argmax(axis=0), np.arange(weights.shape[1])]
    told = "; ".join(_said(column, words) for column in weights.T)
    return Directions(
        weights,
        False,
        told,
        (
            f"{' and '.join(words)} cannot be told apart by their amplitudes: K and B follow "
            f"{told}; there are no coefficients of each",
        ),
    )


def _said(weights: FloatArray, words: tuple[str, ...]) -> str:
    parts = [f"{w:+.2g} {word}" for w, word in zip(weights, words, strict=True) if abs(w) > 0.005]
    return " ".join(parts)
