"""What a random perturbation says of a hand."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.estimates import ImpedanceEstimate
from armimpedance.hand.random.response import ResponseMatrix


@dataclass(frozen=True, eq=False)
class ReflexPart(FrozenRecord):
    """What the record says of a delayed answer.

    Attributes
    ----------
    probability : float
        Of a reflex at all.
    matrix, sd : (d, d)
        R with its standard error, as it is if there is one, N/m or N m/rad.
    delay_s, delay_sd_s : float
        The same of its delay.
    share : float
        Its size along K, parts of K.
    """

    probability: float
    matrix: Annotated[FloatArray, "d d"]
    sd: Annotated[FloatArray, "d d"]
    delay_s: float
    delay_sd_s: float
    share: float

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and nested lists."""
        return {
            "probability": self.probability,
            "R": np.asarray(self.matrix).tolist(),
            "sd_R": np.asarray(self.sd).tolist(),
            "delay_s": self.delay_s,
            "sd_delay_s": self.delay_sd_s,
            "share_of_K": self.share,
        }


@dataclass(frozen=True, eq=False)
class RandomFit(FrozenRecord):
    """One group of trials.

    Attributes
    ----------
    estimate : ImpedanceEstimate
        M, B and K without the reflex.
    reflex : ReflexPart
    lag_s, lag_probability : float
        By how much the force is recorded later than the motion, and whether it is at all.
    band_hz : (float, float)
        What was fitted.
    response : ResponseMatrix
        The same without a model.
    """

    estimate: ImpedanceEstimate
    reflex: ReflexPart
    lag_s: float
    lag_probability: float
    band_hz: tuple[float, float]
    response: ResponseMatrix
