"""Truth of a hand, or a joint, under a random perturbation."""

from __future__ import annotations

import os
from dataclasses import dataclass, fields
from typing import Annotated

from armimpedance.core.arrays import FloatArray, FrozenRecord
from manipulandum_sim.truth_file import write_values


@dataclass(frozen=True)
class RandomTruth(FrozenRecord):
    """Truth of the one condition, d axes.

    Attributes
    ----------
    condition : str
    hand, force : (d,)
        Hand location (m) and force by the hand (N) at rest; of a joint its angles (rad) and
        torques (N m), and so forth.
    M_e, B_e, K_e : (d, d)
        The limb's own, without the reflex.
    M_e_with_handle : (d, d)
    K_e_reflex : (d, d)
        What the reflex adds to K_e once it has answered.
    reflex_delay_s : float
        0 without reflex.
    """

    condition: str
    hand: Annotated[FloatArray, "d"]
    force: Annotated[FloatArray, "d"]
    M_e: Annotated[FloatArray, "d d"]
    B_e: Annotated[FloatArray, "d d"]
    K_e: Annotated[FloatArray, "d d"]
    M_e_with_handle: Annotated[FloatArray, "d d"]
    K_e_reflex: Annotated[FloatArray, "d d"]
    reflex_delay_s: float = 0.0

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write as JSON."""
        write_values({f.name: getattr(self, f.name) for f in fields(self)}, path, indent=1)
