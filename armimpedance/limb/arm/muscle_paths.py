"""What muscles tell of a posture: moment arms and the curvature of their lengths.

L is positive in lengthening, so that ``dL = G dtheta`` (Tsuji 1997, eq. (5)) and tensions give the
torque ``tau = -G^T f`` (6): flexors have negative rows in G, extensors positive ones.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final, Protocol

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.errors import InputError

#: Stiffness over tension (1/m) where nothing better is known: Selen, Franklin and Wolpert 2009 (J
#: Neurosci 29:12606-12616), Table 1.
STIFFNESS_PER_TENSION: Final = 75.0


class MusclePaths(Protocol):
    """m muscles over n joints. All methods take leading batch axes: `q` is (..., n) in rad."""

    @property
    def muscles(self) -> tuple[str, ...]:
        """Names of the m muscles."""

    @property
    def joints(self) -> int:
        """Number of joints n."""

    def moment_arms(self, q: ArrayLike) -> FloatArray:
        """``G = dL/dq``, m, (..., m, n)."""

    def curvature(self, q: ArrayLike) -> FloatArray:
        """``d2L/dq2``, m, (..., m, n, n), symmetric in its last two axes."""


def check_angles(q: ArrayLike, n: int) -> FloatArray:
    """Joint angles (..., n) as finite numbers.

    Raises
    ------
    InputError
    """
    angles = np.asarray(q, dtype=float)
    if angles.ndim == 0 or angles.shape[-1] != n:
        raise InputError(f"joint angles of shape {angles.shape}", expected=f"{n} on the last axis")
    if not np.isfinite(angles).all():
        raise InputError("a joint angle is not finite", expected="finite numbers, rad")
    return angles


@dataclass(frozen=True)
class MuscularArm(FrozenRecord):
    """The muscles of an arm: where they pull, how hard, how stiff they are when they do.

    Attributes
    ----------
    name : str
    paths : MusclePaths
    max_tension : (m,)
        Tension of each muscle at full activation, N.
    stiffness_per_tension : float
        1/m: a muscle's stiffness over its tension.
    angle_range : (n, 2)
        Joint angles (rad) that `paths` hold for.
    source : str
        Origin of the numbers, in words.
    sagittal : bool
        The arm moves in a plane in which gravity acts.
    """

    name: str
    paths: MusclePaths
    max_tension: Annotated[FloatArray, "m"]
    stiffness_per_tension: float
    angle_range: Annotated[FloatArray, "n 2"]
    source: str
    sagittal: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        have = (len(self.max_tension), len(self.angle_range))
        if have != (len(self.paths.muscles), self.paths.joints):
            raise InputError(
                f"arm {self.name}: {have[0]} tensions, {have[1]} ranges of angles",
                expected=f"{len(self.paths.muscles)} and {self.paths.joints}, as its paths",
            )
        if not (self.max_tension > 0).all():
            raise InputError(f"arm {self.name}: a muscle without tension", expected="max > 0 N")
        if not (np.isfinite(self.stiffness_per_tension) and self.stiffness_per_tension > 0):
            raise InputError(
                f"arm {self.name}: stiffness per tension {self.stiffness_per_tension}",
                expected="a positive number, 1/m",
            )
