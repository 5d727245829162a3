"""The pushes to choose from: one course within the robot's limits, along several lines.

Both ways of a line tell the same but for what is not linear, and a person who knows the line does
not know the way.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.hand.adaptive.so_far import SoFar
from armimpedance.hand.planning import PlannedMotion, Profile, Servo, Setting
from armimpedance.hand.still import Knowledge, knowledge_by_trial

#: Lines in the plane, equally apart.
_LINES: Final = 8


@dataclass(frozen=True, eq=False)
class Menu(FrozenRecord):
    """A course and what a push of it tells of one condition along each line.

    `knowledge` (L,): of one push along each line.
    """

    profile: Profile
    lines: Annotated[FloatArray, "l d"]
    knowledge: tuple[Knowledge, ...]

    @property
    def information(self) -> FloatArray:
        """That of one push along each line, (L, q, q)."""
        return np.stack([one.information for one in self.knowledge])


def lines_of(axes: int) -> FloatArray:
    """Unit vectors (L, d): eight lines in the plane; in space the axes and diagonals, thirteen."""
    if axes == 2:
        angle = np.pi * np.arange(_LINES) / _LINES
        return np.column_stack([np.cos(angle), np.sin(angle)])
    signs = np.array(np.meshgrid(*[[-1, 0, 1]] * axes, indexing="ij")).reshape(axes, -1).T
    # of a line's two ways the one whose first component that is not zero is positive
    chosen = [row for row in signs if row.any() and row[np.flatnonzero(row)[0]] > 0]
    rows = np.array(sorted(chosen, key=lambda row: (np.abs(row).sum(), *-row)), dtype=float)
    return np.asarray(rows / np.linalg.norm(rows, axis=1, keepdims=True))


def menu_of(one: SoFar, profile: Profile, servo: Servo) -> Menu:
    """What pushes of this course would tell of a condition, by what is known of it."""
    setting = Setting(one.arm, one.noise, servo, one.sample_rate_hz)
    motion = PlannedMotion(setting, profile)
    lines = lines_of(one.axes)
    known = knowledge_by_trial(
        motion.trials(lines), motion.weight, one.parameters, one.knowledge.peaks
    )
    return Menu(profile, lines, tuple(known))


def spread_evenly(menu: Menu) -> Menu:
    """The menu of a fixed design: one entry, the mean over all lines."""
    total = sum(menu.information) / len(menu.lines)
    mean = replace(menu.knowledge[0], information=np.asarray(total))
    return replace(menu, lines=menu.lines[:1], knowledge=(mean,))
