"""A simulated person: a body of 15 segments whose masses deviate from those of the table."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from armimpedance.core.errors import InputError
from armimpedance.core.records import Subject
from armimpedance.core.skeleton import Segment, Skeleton
from manipulandum_sim.body.segments import table_skeleton

#: Relative standard deviation of the segments' masses of a built-in subject.
SD_OF_BODIES: Final = 0.15


@dataclass(frozen=True)
class BodySubject:
    """A person, and the table's guess of that person.

    Attributes
    ----------
    id : str
    mass_kg, height_m : float
    skeleton : Skeleton
        With the true inertial parameters.
    table_skeleton : Skeleton
        The same bones and markers with the table's masses and inertias: what a laboratory knows
        beforehand.
    """

    id: str
    mass_kg: float
    height_m: float
    skeleton: Skeleton = field(repr=False)
    table_skeleton: Skeleton = field(repr=False)

    @property
    def record(self) -> Subject:
        """The subject as a recording holds it."""
        return Subject(self.id, self.mass_kg, self.height_m)


def body_subject(
    id: str = "body",  # noqa: A002
    mass_kg: float = 73.0,
    height_m: float = 1.741,
    *,
    deviation_sd: float = SD_OF_BODIES,
    seed: int = 0,
) -> BodySubject:
    """A subject whose segments deviate from the table, each on its own.

    Parameters
    ----------
    id : str
    mass_kg, height_m : float
    deviation_sd : float
        Relative standard deviation of the segments' masses (of their moments of inertia: 1.4 times
        as much); centres of mass move by this fraction of the radius of gyration along each axis.
        0 is the table itself. The body's mass stays as given.
    seed : int
        Seed of the deviations.

    Raises
    ------
    InputError
        A mass, height or deviation that no body has.
    """
    for what, value, most in (("mass in kg", mass_kg, 400), ("height in m", height_m, 3)):
        if not 0 < value <= most:
            raise InputError(f"body {what} is {value}", expected=f"above 0, at most {most}")
    if not 0 <= deviation_sd <= 0.5:
        raise InputError(f"deviation from the table is {deviation_sd}", expected="0 to 0.5")
    table = table_skeleton(mass_kg, height_m)
    own = _deviating(table, deviation_sd, np.random.default_rng(seed)) if deviation_sd else table
    return BodySubject(id, float(mass_kg), float(height_m), own, table)


def find_body_subject(subject: str | BodySubject) -> BodySubject:
    """A built-in subject by its name: "A", "B" or "table".

    Raises
    ------
    InputError
        There is no such subject.
    """
    if isinstance(subject, BodySubject):
        return subject
    known = {"A": (73.0, 1.741, SD_OF_BODIES), "B": (61.0, 1.68, SD_OF_BODIES)}
    known["table"] = (73.0, 1.741, 0.0)
    if subject not in known:
        raise InputError(f"no simulated body {subject!r}", expected=" or ".join(known))
    mass, height, deviation = known[subject]
    seed = 1 + sorted(known).index(subject)
    return body_subject(subject, mass, height, deviation_sd=deviation, seed=seed)


def _deviating(skeleton: Skeleton, sd: float, rng: np.random.Generator) -> Skeleton:
    segments = [_distorted(s, sd, rng) for s in skeleton.segments]
    scale = skeleton.mass_kg / sum(s.mass_kg for s in segments)
    return replace(
        skeleton,
        segments=tuple(
            replace(s, mass_kg=scale * s.mass_kg, inertia_kgm2=scale * s.inertia_kgm2)
            for s in segments
        ),
    )


def _distorted(segment: Segment, sd: float, rng: np.random.Generator) -> Segment:
    """Stretch and shear a body's mass: any such body is possible."""
    m = segment.mass_kg * np.exp(sd * rng.standard_normal())
    second = 0.5 * np.trace(segment.inertia_kgm2) * np.eye(3) - segment.inertia_kgm2
    gyration = np.sqrt(np.trace(segment.inertia_kgm2) / 3 / segment.mass_kg)
    stretch = np.eye(3) + 0.5 * sd * rng.standard_normal((3, 3))
    # covariance of the mass (3, 3): C' = T C T^T
    second = stretch @ second @ stretch.T * (m / segment.mass_kg)
    second = 0.5 * (second + second.T)
    com = segment.com_m + sd * gyration * rng.standard_normal(3)
    return replace(
        segment, mass_kg=m, com_m=com, inertia_kgm2=np.trace(second) * np.eye(3) - second
    )
