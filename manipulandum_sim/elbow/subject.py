"""Four subjects with an elbow: forearm and hand, gravity, a flexor and an extensor.

The upper arm hangs down, the elbow turns in the vertical plane, 0 is straight and flexion is
positive. Stiffness and viscosity of the four at the posture test's activation lie in the range of
A. F. Ruiz et al. (2011), section 6.2: 5.3 to 13.1 N m/rad, 2.5 to 4.7 N m s/rad. Mean height is
theirs, 1.73 m; how K and B divide among passive tissue and muscles is our choice.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Final, Literal, get_args

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.records import Subject
from armimpedance.core.skeleton import GRAVITY_M_S2
from manipulandum_sim.hand import (
    FOREARM_HAND_COM,
    FOREARM_HAND_GYRATION,
    FOREARM_HAND_MASS,
    FOREARM_LENGTH,
)

Law = Literal["linear", "saturating"]

#: Angle about which the posture is held, rad of flexion (69 degrees).
OPERATING_ANGLE_RAD: Final = 1.2
#: Activation at which the saturating law bends, and at which it agrees with the linear one.
BEND: Final = 0.05
AGREES_AT: Final = 0.08
#: Step of the numerical derivatives: rad, rad/s.
STEP: Final = 1e-4


@dataclass(frozen=True)
class ElbowSubject:
    """An elbow: ``K = k0 + kF aF + kE aE`` of the muscles, B alike, aF and aE in 0..1.

    Attributes
    ----------
    id : str
    mass_kg, height_m : float
    torque_F, torque_E : float
        Isometric torque at full activation, N m.
    k0, kF, kE : float
        N m/rad.
    b0, bF, bE : float
        N m s/rad.
    posture_E : float
        The extensor's activation in the posture test; the flexor's balances it and gravity.
    mvc_F_V, mvc_E_V : float
        Mean rectified EMG in the maximum voluntary contraction.
    """

    id: str
    mass_kg: float
    height_m: float
    torque_F: float
    torque_E: float
    k0: float
    kF: float
    kE: float
    b0: float
    bF: float
    bE: float
    posture_E: float
    mvc_F_V: float
    mvc_E_V: float

    def __post_init__(self) -> None:
        numbers = [getattr(self, f.name) for f in fields(self) if f.name != "id"]
        if not (np.isfinite(numbers).all() and min(numbers) > 0):
            raise InputError(f"elbow subject {self.id!r}", expected="positive numbers throughout")

    @property
    def mass_of_forearm_hand(self) -> float:
        """kg, Winter Table 4.1."""
        return FOREARM_HAND_MASS * self.mass_kg

    @property
    def inertia(self) -> float:
        """I of forearm and hand about the elbow, kg m^2; Winter Table 4.1, parallel axes."""
        length = FOREARM_LENGTH * self.height_m
        radii = (FOREARM_HAND_COM * length) ** 2 + (FOREARM_HAND_GYRATION * length) ** 2
        return self.mass_of_forearm_hand * radii

    @property
    def gravity(self) -> float:
        """m g l: the torque that holds the forearm level, N m."""
        arm = FOREARM_HAND_COM * FOREARM_LENGTH * self.height_m
        return self.mass_of_forearm_hand * GRAVITY_M_S2 * arm

    @property
    def record(self) -> Subject:
        """The subject as a recording holds it."""
        return Subject(self.id, self.mass_kg, self.height_m)

    def muscle_stiffness(self, activation: FloatArray, law: Law = "linear") -> FloatArray:
        """K of muscles and passive tissue, (...,), at activations (..., 2)."""
        effect = effective(activation, law)
        return np.asarray(self.k0 + self.kF * effect[..., 0] + self.kE * effect[..., 1])

    def muscle_viscosity(self, activation: FloatArray, law: Law = "linear") -> FloatArray:
        """B of muscles and passive tissue, (...,), at activations (..., 2)."""
        effect = effective(activation, law)
        return np.asarray(self.b0 + self.bF * effect[..., 0] + self.bE * effect[..., 1])

    def isometric_torque(self, activation: FloatArray) -> FloatArray:
        """The muscles' torque at rest at their equilibrium, N m, (...,), flexion positive."""
        return np.asarray(self.torque_F * activation[..., 0] - self.torque_E * activation[..., 1])

    def torque(
        self,
        angle: FloatArray,
        rate: FloatArray,
        activation: FloatArray,
        rest: FloatArray,
        rest_rate: FloatArray,
        law: Law = "linear",
    ) -> FloatArray:
        """Torque of muscles and gravity on the limb, N m.

        The muscles' impedance acts about a rest angle that may move (an equilibrium trajectory).

        Parameters
        ----------
        angle, rate, rest, rest_rate : (...,)
            rad, rad/s.
        activation : (..., 2)
        """
        spring = self.muscle_stiffness(activation, law) * (angle - rest)
        damper = self.muscle_viscosity(activation, law) * (rate - rest_rate)
        weight = self.gravity * np.sin(angle)
        return np.asarray(self.isometric_torque(activation) - spring - damper - weight)

    def impedance(
        self, activation: FloatArray, rest: FloatArray, law: Law = "linear"
    ) -> tuple[FloatArray, FloatArray]:
        """Effective K and B about the angle `rest`, by central differences of `torque`.

        K is the whole derivative of the torque on the limb: gravity's gradient is in it.
        """
        still = np.zeros_like(rest)
        K, B = [
            np.asarray(
                self.torque(rest - a, still - r, activation, rest, still, law)
                - self.torque(rest + a, still + r, activation, rest, still, law)
            )
            / (2 * STEP)
            for a, r in ((STEP, 0.0), (0.0, STEP))
        ]
        return K, B

    def flexor_that_balances(self, extensor: float, load: float = 0.0) -> float:
        """Flexor activation that holds the operating angle against gravity, extensor and load."""
        need = self.gravity * np.sin(OPERATING_ANGLE_RAD) - load + self.torque_E * extensor
        return float(need / self.torque_F)

    def load_that_balances(self, activation: FloatArray) -> FloatArray:
        """Torque on the limb, N m, that holds the operating angle at these activations (..., 2)."""
        weight = self.gravity * np.sin(OPERATING_ANGLE_RAD)
        return np.asarray(weight - self.isometric_torque(activation))

    def posture(self, factor: float = 1.0) -> FloatArray:
        """Activations (2,) of the posture test, the extensor's times `factor`."""
        extensor = factor * self.posture_E
        return np.array([self.flexor_that_balances(extensor), extensor])


def effective(activation: FloatArray, law: Law) -> FloatArray:
    """The activation that enters K and B: itself, or saturating ``c (1 - exp(-a / BEND))``."""
    if law == "linear":
        return np.asarray(activation)
    if law == "saturating":
        whole = AGREES_AT / (1 - np.exp(-AGREES_AT / BEND))
        return np.asarray(whole * (1 - np.exp(-np.asarray(activation) / BEND)))
    raise InputError(f"no law {law!r}", expected=" or ".join(get_args(Law)))


ELBOW_SUBJECTS: Final = {
    subject.id: subject
    for subject in (
        ElbowSubject("1", 64, 1.69, 52, 38, 1.0, 42, 40, 1.3, 14, 12, 0.040, 0.55e-3, 0.35e-3),
        ElbowSubject("2", 70, 1.72, 60, 45, 1.2, 48, 46, 1.5, 14, 13, 0.050, 0.70e-3, 0.45e-3),
        ElbowSubject("3", 73, 1.74, 66, 48, 1.4, 55, 54, 1.7, 15, 14, 0.055, 0.60e-3, 0.50e-3),
        ElbowSubject("4", 79, 1.77, 74, 56, 1.6, 60, 58, 1.9, 16, 15, 0.065, 0.80e-3, 0.40e-3),
    )
}


def find_elbow_subject(subject: str | ElbowSubject) -> ElbowSubject:
    """One of the built-in subjects by name, or the given one.

    Raises
    ------
    InputError
        If there is none of that name.
    """
    if isinstance(subject, ElbowSubject):
        return subject
    if subject not in ELBOW_SUBJECTS:
        raise InputError(f"no elbow subject {subject!r}", expected=" or ".join(ELBOW_SUBJECTS))
    return ELBOW_SUBJECTS[subject]
