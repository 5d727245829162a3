"""Arms in the therapy robot: upper arm, and forearm with hand; two pipes of a mock-up.

An arm hangs along -z from its joint, as the robot's links do, and its elbow is where the robot is
adjusted to. Masses: D. A. Winter, Biomechanics and Motor Control of Human Movement, Table 4.1;
lengths from Fig. 4.1 (after Drillis and Contini).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray, frozen_array
from armimpedance.core.errors import InputError

#: Upper arm, forearm, hand. Fractions of the body's mass and height; centre of mass from the
#: proximal end and radius of gyration about it as fractions of the segment's length.
MASS: Final = (0.028, 0.016, 0.006)
LENGTH: Final = (0.186, 0.146, 0.108)
COM: Final = (0.436, 0.430, 0.506)
GYRATION: Final = (0.322, 0.303, 0.297)

#: J. Guidali et al. (2013), Fig. 4: mass kg, length m, diameter m.
UPPER_PIPE: Final = (1.8, 0.32, 0.100)
LOWER_PIPE: Final = (1.7, 0.30, 0.090)

#: The links that bear the two bodies of an arm.
LINKS: Final = ("upper_arm", "forearm")


@dataclass(frozen=True)
class TherapyArm:
    """Two rigid bodies, one on each of `LINKS`.

    Attributes
    ----------
    upper_arm_m : float
        Shoulder to elbow.
    mass_kg : (2,)
    com_m : (2,)
        From the shoulder, from the elbow, along the limb.
    inertia_kgm2 : (2, 3)
        About the centre of mass: twice transverse, then about the long axis.
    """

    upper_arm_m: float
    mass_kg: FloatArray
    com_m: FloatArray
    inertia_kgm2: FloatArray

    def __post_init__(self) -> None:
        for name, shape in (("mass_kg", (2,)), ("com_m", (2,)), ("inertia_kgm2", (2, 3))):
            object.__setattr__(self, name, frozen_array(getattr(self, name), name, shape))
        if not (0.15 <= self.upper_arm_m <= 0.5 and (self.mass_kg >= 0).all()):
            raise InputError(
                f"an upper arm of {self.upper_arm_m} m", expected="0.15 to 0.5 m, masses >= 0"
            )

    def heavier(self, factor: float) -> TherapyArm:
        """The same arm of another density."""
        return replace(self, mass_kg=factor * self.mass_kg, inertia_kgm2=factor * self.inertia_kgm2)

    @property
    def level_kgm(self) -> float:
        """First moment of the straight arm's mass about the shoulder."""
        far = self.upper_arm_m + self.com_m[1]
        return float(self.mass_kg[0] * self.com_m[0] + self.mass_kg[1] * far)

    @property
    def inertia_level_kgm2(self) -> float:
        """Inertia of the straight arm about an axis across it through the shoulder."""
        far = np.array([0.0, self.upper_arm_m]) + self.com_m
        return float(self.inertia_kgm2[:, 0].sum() + self.mass_kg @ far**2)


def winter_arm(mass_kg: float, height_m: float) -> TherapyArm:
    """An arm from body mass and height; slender: no inertia about the long axis.

    Raises
    ------
    InputError
        No such body.
    """
    if not (20 <= mass_kg <= 300 and 1.0 <= height_m <= 2.5):
        raise InputError(f"a body of {mass_kg} kg and {height_m} m", expected="20-300 kg, 1-2.5 m")
    mass, length = mass_kg * np.array(MASS), height_m * np.array(LENGTH)
    com = np.array(COM) * length
    own = mass * (np.array(GYRATION) * length) ** 2
    com[2] += length[1]
    lower = mass[1:].sum()
    centre = mass[1:] @ com[1:] / lower
    # forearm and hand as one body: I = sum I_i + m_i (c_i - c)^2
    both = (own[1:] + mass[1:] * (com[1:] - centre) ** 2).sum()
    return TherapyArm(
        upper_arm_m=float(length[0]),
        mass_kg=np.array([mass[0], lower]),
        com_m=np.array([com[0], centre]),
        inertia_kgm2=np.array([[own[0], own[0], 0.0], [both, both, 0.0]]),
    )


def pipe_arm() -> TherapyArm:
    """The mock-up's pipes: thin tubes, their centres of mass in their middle."""
    pipes = (UPPER_PIPE, LOWER_PIPE)
    return TherapyArm(
        upper_arm_m=UPPER_PIPE[1],
        mass_kg=np.array([pipe[0] for pipe in pipes]),
        com_m=np.array([pipe[1] / 2 for pipe in pipes]),
        inertia_kgm2=np.array([_tube(*pipe) for pipe in pipes]),
    )


def _tube(mass: float, length: float, diameter: float) -> tuple[float, float, float]:
    radius = diameter / 2
    across = mass * (length**2 / 12 + radius**2 / 2)
    return across, across, mass * radius**2
