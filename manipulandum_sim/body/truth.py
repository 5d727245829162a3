"""Truth of a simulated body: its motion, forces and inertial parameters."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Annotated

from armimpedance.core.arrays import FloatArray, FrozenRecord
from manipulandum_sim.truth_file import reading_values, write_values

#: Columns of `BodyTruth.parameters`.


@dataclass(frozen=True)
class BodyTruth(FrozenRecord):
    """Truth of a simulated body; S segments, N samples of all trials, n coordinates.

    Attributes
    ----------
    segments, coordinates : tuple of str
    parameters : (S, 10)
        m, mx, my, mz, Ixx, Ixy, Iyy, Ixz, Iyz, Izz: kg, kg m (mass times centre), kg m^2 about the
        segment's origin.
    q, qd, qdd : (N, n) or None
        Exact; absent in a truth that was read from a file, like the other samples.
    generalised_forces : (N, n) or None
        Right side of ``tau = Y(q, qd, qdd) phi``: outside contacts as if they all held the root.
    joint_torques : (N, n) or None
        What the muscles exert; the root's six are zero, the feet's contacts are where they are. On
        a stand the contact is at the root.
    foot_wrenches : (N, 2, 6) or None
        By the floor on the right and the left foot, about the world's origin. On a stand zero.
    """

    segments: Annotated[tuple[str, ...], "S"]
    coordinates: Annotated[tuple[str, ...], "n"]
    parameters: Annotated[FloatArray, "S 10"]
    q: Annotated[FloatArray, "N n"] | None = None
    qd: Annotated[FloatArray, "N n"] | None = None
    qdd: Annotated[FloatArray, "N n"] | None = None
    generalised_forces: Annotated[FloatArray, "N n"] | None = None
    joint_torques: Annotated[FloatArray, "N n"] | None = None
    foot_wrenches: Annotated[FloatArray, "N 2 6"] | None = None

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write names and parameters as JSON; the samples stay out of it.

        A file of that name is replaced at once or not at all.
        """
        plain = {
            "segments": list(self.segments),
            "coordinates": list(self.coordinates),
            "parameters": self.parameters,
        }
        write_values(plain, path, indent=1)

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> BodyTruth:
        """Read what `write` wrote.

        Raises
        ------
        InputError
            If the file is not a body's truth.
        """
        with reading_values(path, "a body's truth") as plain:
            return cls(**plain)
