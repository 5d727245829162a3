"""The simulated subjects: body, arm segments and strength."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from armimpedance.core.errors import InputError
from armimpedance.core.records import Subject
from manipulandum_sim.hand.muscles import COURSES

# D. A. Winter, Biomechanics and Motor Control of Human Movement, Table 4.1: mass as a fraction of
# the body's, centre of mass from the proximal joint and radius of gyration about it as fractions
# of the segment's length. "Forearm and hand" counts in forearm lengths, elbow to wrist, and the
# forearm is .146 of the height (Fig. 4.1).
UPPER_ARM_MASS: Final = 0.028
UPPER_ARM_COM: Final = 0.436
UPPER_ARM_GYRATION: Final = 0.322
FOREARM_HAND_MASS: Final = 0.022
FOREARM_HAND_COM: Final = 0.682
FOREARM_HAND_GYRATION: Final = 0.468
FOREARM_LENGTH: Final = 0.146


@dataclass(frozen=True)
class Segment:
    """A rigid link: mass (kg), centre of mass from its joint (m), inertia about it (kg m^2)."""

    mass: float
    com: float
    inertia: float


@dataclass(frozen=True)
class SimulatedSubject:
    """Body measures and strength of a simulated subject.

    Attributes
    ----------
    id : str
    mass_kg, height_m, upper_arm_m, forearm_hand_m : float
        `forearm_hand_m` from the elbow to the centre of the grip.
    strength : float
        Multiplies every muscle's tension, stiffness and viscosity.
    moment_arms : {"measured", "alike"}
        How they change with posture: as those of measured arms, or hardly.
    """

    id: str
    mass_kg: float
    height_m: float
    upper_arm_m: float
    forearm_hand_m: float
    strength: float
    moment_arms: str = "measured"

    def __post_init__(self) -> None:
        if self.moment_arms not in COURSES:
            raise InputError(f"moment arms {self.moment_arms!r}", expected=" or ".join(COURSES))

    @property
    def upper_arm(self) -> Segment:
        """Upper arm after Winter, with the subject's own length."""
        mass, length = UPPER_ARM_MASS * self.mass_kg, self.upper_arm_m
        return Segment(mass, UPPER_ARM_COM * length, mass * (UPPER_ARM_GYRATION * length) ** 2)

    @property
    def forearm_hand(self) -> Segment:
        """Forearm and hand after Winter, with the forearm's length from the height."""
        mass, length = FOREARM_HAND_MASS * self.mass_kg, FOREARM_LENGTH * self.height_m
        gyration = FOREARM_HAND_GYRATION * length
        return Segment(mass, FOREARM_HAND_COM * length, mass * gyration**2)

    @property
    def record(self) -> Subject:
        """The subject as a recording holds it."""
        return Subject(self.id, self.mass_kg, self.height_m, self.upper_arm_m, self.forearm_hand_m)


SUBJECTS: Final = {
    subject.id: subject
    for subject in (
        SimulatedSubject("A", 65.0, 1.70, 0.30, 0.34, 1.00),
        SimulatedSubject("B", 72.0, 1.76, 0.31, 0.35, 1.15),
        SimulatedSubject("C", 58.0, 1.66, 0.29, 0.33, 0.85),
        SimulatedSubject("D", 80.0, 1.82, 0.32, 0.36, 1.30),
        # the control: A, whose stiffness hardly changes with posture
        SimulatedSubject("A_alike", 65.0, 1.70, 0.30, 0.34, 1.00, "alike"),
    )
}


def find_subject(subject: str | SimulatedSubject) -> SimulatedSubject:
    """A subject by its letter.

    Parameters
    ----------
    subject : {"A", "B", "C", "D", "A_alike"} or SimulatedSubject

    Returns
    -------
    SimulatedSubject

    Raises
    ------
    InputError
        If there is no such subject.
    """
    if isinstance(subject, SimulatedSubject):
        return subject
    if subject not in SUBJECTS:
        raise InputError(f"no simulated subject {subject!r}", expected=" or ".join(SUBJECTS))
    return SUBJECTS[subject]
