"""Two simulated groups, controls and patients with stiffer shoulders, shaken in test P5."""

from __future__ import annotations

from dataclasses import dataclass
from statistics import NormalDist
from typing import Final

import numpy as np

from armimpedance.core.errors import InputError
from armimpedance.hand.comparison import Discrimination, PeopleGroup, discriminate_groups
from armimpedance.joint.relaxed import from_motion, identify_passive
from armimpedance.limb.mocap import joint_motion
from armimpedance.numerics.regression import NamedParameter
from manipulandum_sim.passive import (
    ELBOW,
    PASSIVE_SUBJECTS,
    SHOULDER,
    PassiveSubject,
    passive_subject,
    simulate_passive_many,
)
from manipulandum_sim.studio import Studio

FLEXION: Final = SHOULDER[0]
#: Everybody's arm is this subject's, but for the body's size and the shoulder's stiffness. Its
#: forearm and hand are one body, which halves the simulation's time.
MODEL: Final = PASSIVE_SUBJECTS["1"]
#: Friction of the shoulder, N m; the model's has none.
FRICTION: Final = 0.04
METHOD: Final = "parallel"
MASS_KG: Final = (68.0, 9.0)
HEIGHT_M: Final = (1.70, 0.07)
#: Skin over bone, sd of each marker's slide (m), beside 0.5 mm of noise.
SOFT_TISSUE_M: Final = 3e-3
#: Of each person's test.
SECONDS = 4.0


@dataclass(frozen=True)
class Population:
    """How a group is drawn.

    Attributes
    ----------
    name : str
    people : int
    mean, sd : float
        Of the shoulder's stiffness in flexion, N m/rad; normal, people at equal steps of
        probability, so that the groups are as far apart as is said and not as luck has it.
    """

    name: str
    people: int
    mean: float
    sd: float

    def stiffness(self, i: int) -> float:
        """N m/rad, of person i from 0."""
        quantile = NormalDist().inv_cdf((i + 0.5) / self.people)
        return self.mean + self.sd * quantile


CONTROLS = Population("controls", 12, 4.0, 0.7)
PATIENTS = Population("patients", 10, 5.5, 1.1)


@dataclass(frozen=True)
class Shoulder:
    """One person: drawn, recorded, identified.

    Attributes
    ----------
    group, person : str
    mass_kg, height_m : float
    true_k : float
        N m/rad.
    k : NamedParameter
        Identified.
    n : int
        Rows.
    """

    group: str
    person: str
    mass_kg: float
    height_m: float
    true_k: float
    k: NamedParameter
    n: int

    @property
    def inside(self) -> bool:
        """Whether the truth lies within the 95 % interval."""
        low, high = self.k.ci95
        return low <= self.true_k <= high


@dataclass(frozen=True)
class StudiedShoulders:
    """All people, and how well their stiffness tells the groups apart."""

    people: tuple[Shoulder, ...]
    result: Discrimination


def study(experiment: str, *, subject: str, seed: int, sets: int) -> StudiedShoulders:
    """Draw, record and identify both groups.

    `subject` and `sets` play no part: the people are drawn, and one test each is recorded.

    Raises
    ------
    InputError
        An unknown experiment.
    """
    del subject, sets
    if experiment != "shoulders":
        raise InputError(f"no experiment {experiment!r}", expected="shoulders")
    groups = [_group(population, seed, g) for g, population in enumerate((CONTROLS, PATIENTS))]
    return StudiedShoulders(
        tuple(person for group in groups for person in group),
        discriminate_groups(*(_values(group) for group in groups), parameter="k"),
    )


def _values(people: list[Shoulder]) -> PeopleGroup:
    return PeopleGroup(
        people[0].group,
        tuple(p.person for p in people),
        np.array([p.k.value for p in people]),
        np.array([p.k.sd_robust for p in people]),
        people[0].k.unit,
    )


def _group(population: Population, seed: int, group: int) -> list[Shoulder]:
    """Every person has a body of their own, so that the simulator cannot take them together."""
    people = []
    for i in range(population.people):
        rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(group, i)))
        name = f"{population.name[0].upper()}{i + 1}"
        someone = _person(name, population.stiffness(i), rng)
        people.append(_examine(population.name, someone, int(rng.integers(2**31))))
    return people


def _person(name: str, stiffness: float, rng: np.random.Generator) -> PassiveSubject:
    """A body of any size, and a shoulder that is stiffer about all three axes alike."""
    mass, height = (mean + sd * rng.standard_normal() for mean, sd in (MASS_KG, HEIGHT_M))
    someone = passive_subject(name, mass, height, MODEL.joints[ELBOW])
    scale = stiffness / MODEL.joints[FLEXION].k
    for hinge in SHOULDER:
        k = scale * MODEL.joints[hinge].k
        someone = someone.with_joint(hinge, k=k, f=FRICTION)
    return someone


def _examine(group: str, someone: PassiveSubject, seed: int) -> Shoulder:
    """Film the test and identify the shoulder's flexion."""
    studio = Studio(soft_tissue_m=SOFT_TISSUE_M)
    ((markers, _),) = simulate_passive_many(
        "p5", [seed], subject=someone, duration_s=SECONDS, studio=studio
    )
    samples = from_motion(joint_motion(markers).motion, [FLEXION])
    joint = someone.joints[FLEXION]
    (fit,) = identify_passive(samples, rest_angle=joint.q_r, method=METHOD, cross_validate=False)
    return Shoulder(
        group,
        someone.name,
        someone.mass_kg,
        someone.height_m,
        joint.k,
        fit.parameters["k"],
        fit.torque_fit.n_rows,
    )
