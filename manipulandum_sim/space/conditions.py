"""Conditions: a posture, a force and a level of co-contraction to hold."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from manipulandum_sim.hand import SimulatedSubject
from manipulandum_sim.space.arm import FOUR
from manipulandum_sim.space.plant import Plant, plant_at
from manipulandum_sim.space.rig import SpaceRig

#: Turn, elevation, axial and elbow, rad: the hand in front of the chest, and four places about it.
POSTURES_RAD: Final = {
    "nominal": (-0.9, 0.9, 1.0, 1.5),
    "far": (-0.5, 0.9, 0.7, 0.9),
    "near": (-1.0, 0.8, 1.0, 1.9),
    "high": (-0.8, 1.3, 0.7, 1.4),
    "low": (-0.7, 0.6, 0.9, 1.3),
}
#: A free wrist around a handle: pronation, deviation to the thumb's side, flexion, rad.
GRIP_RAD: Final = (0.2, 0.0, -0.25)
NOMINAL_FORCE_N: Final = (0.0, -5.0, 3.0)
NOMINAL_COCONTRACTION: Final = 0.12


@dataclass(frozen=True)
class SpaceCondition:
    """A condition: the subject's task.

    Attributes
    ----------
    posture : str or (4,) or (7,) tuple of float
        Name in `POSTURES_RAD`, or the angles, rad; those of a free wrist are `GRIP_RAD` where they
        are not given.
    cocontraction : float
        Least activation of every muscle.
    force : (3,)
        By the hand on the robot, N.
    """

    posture: str | tuple[float, ...] = "nominal"
    cocontraction: float = NOMINAL_COCONTRACTION
    force: tuple[float, float, float] = NOMINAL_FORCE_N

    @property
    def name(self) -> str:
        """The condition in the trial table."""
        where = self.posture
        if not isinstance(where, str):
            where = "q_" + "_".join(f"{np.degrees(angle):.1f}" for angle in where)
        return f"{where}_{100 * self.cocontraction:g}"

    @property
    def angles(self) -> FloatArray:
        """Stated joint angles, (4,) or (7,), rad.

        Raises
        ------
        InputError
            There is no such posture, or not four or seven finite angles.
        """
        if isinstance(self.posture, str) and self.posture not in POSTURES_RAD:
            raise InputError(f"posture {self.posture!r}", expected=" or ".join(POSTURES_RAD))
        given = POSTURES_RAD[self.posture] if isinstance(self.posture, str) else self.posture
        found = np.array(given, dtype=float)
        if found.shape not in ((FOUR,), (FOUR + len(GRIP_RAD),)) or not np.isfinite(found).all():
            expected = "four finite ones, or seven with a free wrist, rad"
            raise InputError(f"{len(found)} angles of a posture", expected=expected)
        return found

    def plant(self, subject: SimulatedSubject, rig: SpaceRig) -> Plant:
        """The arm in balance.

        Raises
        ------
        InputError
            There is no such posture, or the muscles cannot bear the force.
        """
        held, q = rig.elbow == "held", self.angles
        if rig.wrist == "free" and len(q) == FOUR:
            q = np.array([*q, *GRIP_RAD])
        locked = rig.wrist == "locked"
        return plant_at(subject, q, np.array(self.force), self.cocontraction, held, locked)
