"""A course of B and K over time with what goes with it, and damped steps towards one."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray

#: No step is shorter than this part of the one that the equation asks for.
SHORTEST_STEP: Final = 0.125


@dataclass(frozen=True)
class Course:
    """Where an iteration stands.

    Attributes
    ----------
    inertia : float
    B, K : (N,)
    torque_offset, angle_offset : (T,)
        Difference of a trial's operating point from its means: N m, rad.
    """

    inertia: float
    B: FloatArray
    K: FloatArray
    torque_offset: FloatArray
    angle_offset: FloatArray


def with_offsets(course: Course, offsets: FloatArray) -> Course:
    """The same course with the offsets (2 T,) of the nuisance columns."""
    T = len(course.torque_offset)
    return replace(course, torque_offset=offsets[:T], angle_offset=offsets[T:])


@dataclass(frozen=True)
class Step:
    """Length of the next step, and the size of the last one.

    A round that moves hardly less than the one before swings to and fro: from then on courses go
    half as far.
    """

    length: float = 1.0
    moved: float = float("inf")

    def taken(self, old: Course, new: Course) -> tuple[Course, Step]:
        """Go from `old` towards `new`."""
        size = float(np.sqrt(((new.K - old.K) ** 2).mean()))
        swings = size > 0.7 * self.moved
        length = max(self.length / 2, SHORTEST_STEP) if swings else self.length
        if length == 1:
            return new, Step(length, size)
        mixed = {
            f.name: (1 - length) * getattr(old, f.name) + length * getattr(new, f.name)
            for f in fields(Course)
        }
        return Course(**mixed), Step(length, size)
