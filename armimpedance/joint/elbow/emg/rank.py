"""Can these amplitudes tell the muscles apart? Refused where they rise and fall together."""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import NotIdentifiableError

#: A smallest singular value below this part of the largest, of amplitudes about their means and
#: of unit length, counts as zero: EMG is never known any better.
RANK_TOLERANCE: Final = 0.01
#: Amplitudes that differ by less do not vary; part of the maximum contraction.
NO_CHANGE: Final = 1e-3
#: What to do about it.
HINT: Final = (
    "add trials in which one is active without the other: hold a load up (flexor) and one that "
    "pulls up (extensor), besides co-contraction"
)


def refuse_alike(
    amplitude: FloatArray, amplitude_sd: FloatArray, muscles: tuple[str, ...]
) -> tuple[float, float]:
    """Raw condition of [1, s] (L, m + 1), and that of s about its means with unit columns.

    Raises
    ------
    NotIdentifiableError
        A muscle whose amplitude does not vary beyond its errors; muscles that vary together.
    """
    spread = amplitude.std(axis=0)
    noise = np.sqrt((amplitude_sd**2).mean(axis=0))
    still = (np.ptp(amplitude, axis=0) <= NO_CHANGE) | (spread <= noise)
    if still.any():
        names = tuple(np.array(muscles)[still].tolist())
        raise NotIdentifiableError(
            f"the amplitude of {', '.join(names)} does not vary beyond its errors (spread "
            f"{spread[still][0]:.3g}, error {noise[still][0]:.3g}): what it does cannot be told "
            f"from a constant; {HINT}",
            names,
        )
    centred = amplitude - amplitude.mean(axis=0)
    _, singular, directions = np.linalg.svd(centred / np.linalg.norm(centred, axis=0))
    if singular[-1] < RANK_TOLERANCE * singular[0]:
        weight = np.abs(directions[-1])
        names = tuple(np.array(muscles)[weight > 0.1 * weight.max()].tolist())
        raise NotIdentifiableError(
            f"{' and '.join(names)} rise and fall together in all {len(amplitude)} points: their "
            f"parts cannot be told apart; {HINT}",
            names,
        )
    raw = np.linalg.cond(np.column_stack([np.ones(len(amplitude)), amplitude]))
    return float(raw), float(singular[0] / singular[-1])
