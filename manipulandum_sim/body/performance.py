"""A motion, or still postures, as one person performs them."""

from __future__ import annotations

from contextlib import suppress
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from manipulandum_sim.body.draft import Draft
from manipulandum_sim.body.motions import MOTIONS, ON_A_STAND
from manipulandum_sim.body.plan import BodyMotion, realise
from manipulandum_sim.body.restless import (
    ARM_WAVES,
    LEG_WAVES,
    NECK_WAVES,
    PELVIS_WAVES,
    TRUNK_WAVES,
    Waves,
    background,
)
from manipulandum_sim.body.segments import SIDES
from manipulandum_sim.body.subject import BodySubject

#: So often a person begins a motion in which they would fall.
_BEGINNINGS: Final = 4


def body_motion(
    name: str, subject: BodySubject, rng: np.random.Generator, rate_hz: float = 100.0
) -> BodyMotion:
    """One of the motions as this person does it this time.

    Parameters
    ----------
    name : str
        A name of `MOTIONS` or `ON_A_STAND`.
    subject : BodySubject
    rng : Generator
        Generator of amplitudes, tempo and restlessness.
    rate_hz : float

    A performance in which the person would fall (one of 200 of all joints moved at random) is
    given up, and they begin again.

    Raises
    ------
    InputError
        There is no such motion, or it is out of reach however often they begin.
    """
    known = MOTIONS | ON_A_STAND
    if name not in known:
        raise InputError(f"no motion {name!r}", expected=f"one of {', '.join(known)}")
    for _ in range(_BEGINNINGS - 1):
        with suppress(InputError):
            return _performed(name, subject, rng, rate_hz)
    return _performed(name, subject, rng, rate_hz)


def _performed(
    name: str, subject: BodySubject, rng: np.random.Generator, rate_hz: float
) -> BodyMotion:
    """The motion as it comes out this time."""
    compose, seconds = (MOTIONS | ON_A_STAND)[name]
    draft = Draft(subject, seconds, rate_hz, rng)
    compose(draft)
    if name in MOTIONS:
        background(draft)
    return realise(draft.plan(standing=name in MOTIONS), subject)


def still_postures(
    subject: BodySubject, rng: np.random.Generator, rate_hz: float, postures: int, samples: int
) -> list[BodyMotion]:
    """Random postures held still on a stand: the pelvis tilted, all joints bent."""
    time = np.arange(samples) / rate_hz
    middle, size = _posture_ranges(subject)
    motions = []
    for posture in middle + size * rng.uniform(-1.5, 1.5, (postures, len(size))):
        q = np.tile(posture, (samples, 1))
        still = np.zeros_like(q)
        none = np.full(samples, 0.5)
        motions.append(BodyMotion(time, q, still, still, none, np.zeros((samples, 2, 3))))
    return motions


def _posture_ranges(subject: BodySubject) -> tuple[FloatArray, FloatArray]:
    """Middle and amplitude (n,) of every coordinate."""
    parts: dict[str, Waves] = {"trunk": TRUNK_WAVES, "neck": NECK_WAVES, "pelvis": PELVIS_WAVES}
    parts |= dict.fromkeys(SIDES, ARM_WAVES | LEG_WAVES)
    ranges = {f"{part}_{n}": w[:2] for part, waves in parts.items() for n, w in waves.items()}
    ranges["pelvis_z"] = (0.55 * subject.height_m, 0.0)
    values = [ranges.get(name, (0.0, 0.0)) for name in subject.skeleton.coordinates]
    middle, size = np.array(values).T
    return middle, size
