"""What an experiment shall tell."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armimpedance.core.errors import InputError
from armimpedance.hand.planning.precision import Precision


@dataclass(frozen=True)
class Wish:
    """What an experiment shall tell; None: no wish.

    Attributes
    ----------
    k_part : float
        The 95 % interval of each diagonal element of K is to be at most +- this part of it.
    orientation_rad : float
        Half the 95 % interval of the stiffness ellipse's orientation is to be at most this.
    most_trials : int
        A plan that needs more is not met.
    """

    k_part: float | None = None
    orientation_rad: float | None = None
    most_trials: int = 1000

    def __post_init__(self) -> None:
        asked = (
            ("K", self.k_part, 100.0, "%"),
            ("the orientation", self.orientation_rad, 180 / np.pi, "degrees"),
        )
        for name, value, factor, unit in asked:
            if value is not None and not (np.isfinite(value) and value > 0):
                raise InputError(f"{name} within {factor * value:g} {unit}", expected="more than 0")
        if self.most_trials < 8:
            raise InputError(f"{self.most_trials} trials", expected="8 or more: one set")

    @property
    def text(self) -> str:
        """The wish in words."""
        parts = []
        if self.k_part is not None:
            parts.append(f"K within {100 * self.k_part:g} %")
        if self.orientation_rad is not None:
            degrees = np.rad2deg(self.orientation_rad)
            parts.append(f"K's orientation within {degrees:.3g} degrees")
        return " and ".join(parts) or "one set"

    def trials(self, precision: Precision) -> int | None:
        """Trials, in whole sets, that fulfil it; None: millions."""
        needed = [precision.directions]
        if self.k_part is not None:
            needed.append(precision.trials_for_k(self.k_part) or 0)
        if self.orientation_rad is not None:
            needed.append(precision.trials_for_orientation(self.orientation_rad) or 0)
        return None if 0 in needed else max(needed)
