"""Twelve able-bodied and seven neurological subjects of the therapy robot.

Passive stiffness and rest angles are Table 4 of M. Guidali et al. (2013). It has no horizontal
entries for S4 and P1, whose three passive movements were too different: here their trunk moves,
so that stiffness and rest angle are others in every repetition. Body mass and height were drawn
once about values that are usual for adults (the source gives none; 5 of the 12 able-bodied and 6
of the 7 patients are male), and so are the patients' damping and their shares in the active
condition, whose mean and sd are the source's 51.7 +- 44.2 %; P6's effort resists, as it says.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray, frozen_array
from armimpedance.core.errors import InputError
from armimpedance.core.records import Subject
from manipulandum_sim.therapy.arm import TherapyArm, winter_arm

#: Axes with passive stiffness, from 0: elevation, horizontal.
SPRUNG: Final = (0, 1)

#: Repetition to repetition: relative sd of k_s, sd of q_0 in rad, both axes.
STIFFNESS_SPREAD: Final = 0.02
REST_SPREAD_rad: Final = 0.015
#: How a moving trunk changes them from one repetition to the next: factors of k_s, shifts of q_0.
TRUNK_STIFFNESS: Final = (0.4, 1.8, 1.0)
TRUNK_REST_rad: Final = (-0.9, 0.3, 1.0)
#: Sd of the slow torque of a person who tries to be passive, N m: elevation, horizontal. A torque
#: of the horizontal axis counts several times as much, its passive arm needs so little.
FLUCTUATION_Nm: Final = (0.12, 0.02)
#: Its time constant, s.
FLUCTUATION_S: Final = 0.8
#: Of patients' joints, N m s/rad, axes 1 to 5.
PATIENT_DAMPING: Final = (0.5, 0.15, 0.05, 0.1, 0.02)


def _zeros() -> FloatArray:
    return np.zeros(5)


@dataclass(frozen=True)
class TherapySubject:
    """A person in the therapy robot.

    Attributes
    ----------
    id : str
    mass_kg, height_m : float
        As stated; the arm's true masses may differ by a factor.
    stiffness : (2,)
        k_s of elevation and horizontal rotation, N m/rad.
    rest_rad : (2,)
        q_0 of the two.
    patient : bool
        Assisted in the active condition; no half active one.
    active_share : float
        Of what the passive arm needs, carried in the active condition; negative: it resists.
    trunk_moves : bool
        Horizontal stiffness and rest angle are others in every repetition.
    tone_Nm : (5,)
        Constant torque that the passive arm needs beside its stiffness, tau_h's side; a flexor of
        the elbow pulls upwards and is negative there.
    damping : (5,)
        Velocity-dependent resistance, N m s/rad.
    """

    id: str
    mass_kg: float
    height_m: float
    stiffness: FloatArray
    rest_rad: FloatArray
    patient: bool = False
    active_share: float = 1.0
    trunk_moves: bool = False
    tone_Nm: FloatArray = field(default_factory=_zeros)
    damping: FloatArray = field(default_factory=_zeros)

    def __post_init__(self) -> None:
        shapes = {"stiffness": 2, "rest_rad": 2, "tone_Nm": 5, "damping": 5}
        for name, count in shapes.items():
            object.__setattr__(self, name, frozen_array(getattr(self, name), name, (count,)))
        if not ((self.stiffness >= 0).all() and (self.damping >= 0).all()):
            raise InputError(f"subject {self.id}: a negative stiffness or damping")
        if not (np.isfinite(self.active_share) and -1 <= self.active_share <= 1.5):
            raise InputError(
                f"subject {self.id}: an active share of {self.active_share}", expected="-1 to 1.5"
            )

    @property
    def stated_arm(self) -> TherapyArm:
        """The arm by Winter's table, from body mass and height."""
        return winter_arm(self.mass_kg, self.height_m)

    @property
    def record(self) -> Subject:
        """The person as a recording holds it; the upper arm is the length set at the robot."""
        arm = self.height_m * np.array([0.186, 0.146 + 0.108 / 2])
        return Subject(self.id, self.mass_kg, self.height_m, float(arm[0]), float(arm[1]))


#: id: body mass kg, height m (drawn), k_s1, q_01, k_s2, q_02 (Table 4; S4 and P1 horizontal: ours).
_ABLE: Final = {
    "S1": (78.0, 1.80, 6.60, 1.33, 1.68, 0.44),
    "S2": (61.0, 1.66, 5.00, 1.00, 1.17, 0.11),
    "S3": (66.0, 1.70, 5.53, 0.72, 0.93, -0.82),
    "S4": (74.0, 1.77, 3.99, 1.00, 1.00, 0.00),
    "S5": (54.0, 1.62, 1.47, 1.05, 0.44, -2.50),
    "S6": (63.0, 1.68, 3.06, 1.42, 0.76, 0.026),
    "S7": (81.0, 1.83, 4.46, 1.41, 1.10, 0.15),
    "S8": (58.0, 1.65, 4.02, 0.87, 2.08, 0.09),
    "S9": (85.0, 1.79, 6.80, 0.96, 1.03, 0.24),
    "S10": (60.0, 1.71, 3.75, 1.31, 0.80, -0.21),
    "S11": (69.0, 1.67, 4.40, 1.14, 1.04, 0.29),
    "S12": (76.0, 1.75, 8.43, 1.19, 0.45, -0.78),
}
#: The same, then the share in the active condition.
_PATIENTS: Final = {
    "P1": (82.0, 1.78, 12.50, 0.81, 2.50, -0.10, 0.95),
    "P2": (77.0, 1.74, 12.85, 0.50, 9.97, -0.15, 0.60),
    "P3": (64.0, 1.62, 10.37, 0.65, 1.75, -1.77, 0.35),
    "P4": (79.0, 1.73, 9.43, 1.06, 2.05, -0.10, 0.80),
    "P5": (86.0, 1.81, 11.84, 0.68, 0.88, -1.43, 0.90),
    "P6": (73.0, 1.76, 9.70, 1.42, 7.70, 0.10, -0.35),
    "P7": (84.0, 1.75, 5.85, 0.79, 0.003, 0.64, 0.37),
}
_TRUNK_MOVES: Final = ("S4", "P1")


def _able(id_: str) -> TherapySubject:
    mass, height, k1, q1, k2, q2 = _ABLE[id_]
    k, q = np.array([k1, k2]), np.array([q1, q2])
    return TherapySubject(id_, mass, height, k, q, trunk_moves=id_ in _TRUNK_MOVES)


def _patient(id_: str) -> TherapySubject:
    mass, height, k1, q1, k2, q2, share = _PATIENTS[id_]
    return TherapySubject(
        id_,
        mass,
        height,
        np.array([k1, k2]),
        np.array([q1, q2]),
        patient=True,
        active_share=share,
        trunk_moves=id_ in _TRUNK_MOVES,
        damping=np.array(PATIENT_DAMPING),
    )


THERAPY_SUBJECTS: Final = {
    **{id_: _able(id_) for id_ in _ABLE},
    **{id_: _patient(id_) for id_ in _PATIENTS},
}


def find_therapy_subject(subject: str | TherapySubject) -> TherapySubject:
    """One of the built-in subjects by name, or the given one.

    Raises
    ------
    InputError
        There is none of that name.
    """
    if isinstance(subject, TherapySubject):
        return subject
    if subject not in THERAPY_SUBJECTS:
        known = ", ".join(THERAPY_SUBJECTS)
        raise InputError(f"no therapy subject {subject!r}", expected=f"one of {known}")
    return THERAPY_SUBJECTS[subject]


def passive_of_repetition(
    subject: TherapySubject, repetition: int, rng: np.random.Generator | None
) -> tuple[FloatArray, FloatArray]:
    """k_s and q_0, each (2,), of one repetition, counted from 1; None: without the small spread."""
    spread = np.zeros((2, 2)) if rng is None else rng.standard_normal((2, 2))
    k = subject.stiffness * (1 + STIFFNESS_SPREAD * spread[0])
    rest = subject.rest_rad + REST_SPREAD_rad * spread[1]
    if subject.trunk_moves:
        turn = (repetition - 1) % len(TRUNK_REST_rad)
        k = k * np.array([1.0, TRUNK_STIFFNESS[turn]])
        rest = rest + np.array([0.0, TRUNK_REST_rad[turn]])
    return k, rest
