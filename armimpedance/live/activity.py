"""Activation of the muscles as the samples bring it: a lost channel is held and doubted."""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.arrays import BoolArray, FloatArray

#: A muscle that nobody sees may be anywhere in its range after this time (s).
FORGOTTEN_S: Final = 0.25
#: Standard error of such an activation, as a part of the range that the model was fitted to.
UNKNOWN: Final = 0.5
#: Activations in this range are taken, and cut to 0..1: a maximum contraction is known to some
#: per cent, and noise that is taken off may be too much.
TAKEN: Final = (-0.05, 1.2)


class HeldActivity:
    """The last good activation of each muscle, with the error that grows while it is lost.

    Parameters
    ----------
    highest : (m,)
        Range of each activation in the model.
    """

    def __init__(self, highest: FloatArray) -> None:
        self._unknown = UNKNOWN * highest
        self._good, self._sd = highest / 2, np.zeros(len(highest))
        # nothing was seen yet: as unknown as can be
        self._lost_s = np.full(len(highest), FORGOTTEN_S)

    def take(
        self, activation: FloatArray, sd: FloatArray, lost: BoolArray, step_s: float
    ) -> tuple[FloatArray, FloatArray]:
        """Activation (m,), each 0..1, and its standard error, for a sample `step_s` after the last.

        Parameters
        ----------
        activation, sd : (m,)
            Of any value where `lost`.
        lost : (m,) bool
        step_s : float
        """
        if not lost.any():
            self._good, self._sd = activation.clip(0.0, 1.0), sd
            self._lost_s[:] = 0.0
            return self._good, sd
        self._good = np.where(lost, self._good, activation.clip(0.0, 1.0))
        self._sd = np.where(lost, self._sd, sd)
        self._lost_s = np.where(lost, np.minimum(self._lost_s + step_s, FORGOTTEN_S), 0.0)
        return self._good, np.hypot(self._sd, self._unknown * self._lost_s / FORGOTTEN_S)


def activations_lost(activation: FloatArray) -> BoolArray:
    """Which activations (m,) are none: missing, or far outside of 0..1."""
    # written so that NaN is lost
    return np.asarray(~((activation >= TAKEN[0]) & (activation <= TAKEN[1])))
