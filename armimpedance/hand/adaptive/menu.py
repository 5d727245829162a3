"""The pushes to choose from: one course within the robot's limits, along several lines.

Both directions of a line give the same information apart from non-linear effects, and a person who
knows the line does not know the direction.
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
    """A course, and the information of a push of it about one condition along each line.

    `knowledge` (L,): of one push along each line.
    """

    profile: Profile
    lines: Annotated[FloatArray, "l d"]
    knowledge: tuple[Knowledge, ...]

    @property
    def information(self) -> FloatArray:
        """Information of one push along each line, (L, q, q)."""
        return np.stack([knowledge.information for knowledge in self.knowledge])


def lines_of(axes: int) -> FloatArray:
    """Unit vectors (L, d): eight lines in the plane; in space the axes and diagonals, thirteen."""
    if axes == 2:
        angle = np.pi * np.arange(_LINES) / _LINES
        return np.column_stack([np.cos(angle), np.sin(angle)])
    signs = np.array(np.meshgrid(*[[-1, 0, 1]] * axes, indexing="ij")).reshape(axes, -1).T
    # of a line's two directions, that whose first non-zero component is positive
    chosen = [row for row in signs if row.any() and row[np.flatnonzero(row)[0]] > 0]
    rows = np.array(sorted(chosen, key=lambda row: (np.abs(row).sum(), *-row)), dtype=float)
    return np.asarray(rows / np.linalg.norm(rows, axis=1, keepdims=True))


def menu_of(state: SoFar, profile: Profile, servo: Servo) -> Menu:
    """Build the menu of this course for a condition, from its estimates so far."""
    setting = Setting(state.arm, state.noise, servo, state.sample_rate_hz)
    motion = PlannedMotion(setting, profile)
    lines = lines_of(state.axes)
    knowledge = knowledge_by_trial(
        motion.trials(lines), motion.weight, state.parameters, state.knowledge.peaks
    )
    return Menu(profile, lines, tuple(knowledge))


def spread_evenly(menu: Menu) -> Menu:
    """The menu of a fixed design: one entry, the mean over all lines."""
    total = sum(menu.information) / len(menu.lines)
    mean = replace(menu.knowledge[0], information=np.asarray(total))
    return replace(menu, lines=menu.lines[:1], knowledge=(mean,))
