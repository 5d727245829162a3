"""What a rig of a simulated study is: its settings, its quantities, what simulates and estimates.

A new rig is a new file in the folder `rigs`, with the record RIG.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final, Literal, NamedTuple

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.method_table import MethodTable
from armimpedance.lab.simulate_study.fields import Field, Settings

#: Sessions of one task and one file of the store. It is part of how sessions are seeded.
BLOCK: Final = 25
#: What is kept of an estimate, in the order of the last axis of `Numbers.values`.
COLUMNS: Final = ("estimate", "low", "high", "sd", "dof", "truth", "bound_sd")
ESTIMATE, LOW, HIGH, SD, DOF, TRUTH, BOUND = range(len(COLUMNS))

Kind = Literal["difference", "ratio", "share", "axis"]


class Quantity(NamedTuple):
    """What is estimated.

    Attributes
    ----------
    name, unit : str
    kind : {"difference", "ratio", "share", "axis"}
        How two conditions are compared: a share is a ratio with limits of its own, an axis an
        angle that half a turn leaves as it is.
    """

    name: str
    unit: str
    kind: Kind = "difference"


@dataclass(frozen=True)
class Seeds:
    """Random numbers of a simulated experiment: they hang on the study's seed and on what is asked.

    Attributes
    ----------
    seed : int
    part : int
        Told by the settings that are simulated; not by those that only estimate.
    """

    seed: int
    part: int

    def sequence(self, *key: int) -> np.random.SeedSequence:
        """A sequence of its own for each key."""
        return np.random.SeedSequence(self.seed, spawn_key=(self.part, *key))

    def of(self, *key: int) -> int:
        """A seed of its own for each key, below 2^63."""
        return int(self.sequence(*key).generate_state(1, np.uint64)[0] >> 1)


@dataclass(frozen=True)
class Numbers:
    """What the estimates of C conditions and S sessions came to.

    Attributes
    ----------
    values : (C, S, quantities, 7)
        `COLUMNS`, SI; nan where there was no estimate.
    extras : (C, S, E)
        What the shortcut draws.
    problems : mapping
        Why there was no estimate -> how often.
    """

    values: FloatArray
    extras: FloatArray
    problems: Mapping[str, int] = field(default_factory=dict)


@dataclass(frozen=True)
class Shortcut:
    """How estimates of a rig are drawn.

    Attributes
    ----------
    values : callable
        Extras (n, E), truth (Q,), bound's sd (Q,) -> numbers (n, Q, 7) as the rig has them.
    """

    values: Callable[[FloatArray, FloatArray, FloatArray], FloatArray]


@dataclass(frozen=True)
class Rig:
    """A simulated experiment and its analysis.

    Attributes
    ----------
    line : str
        What it is.
    fields : tuple of Field
        What can be set in a grid.
    quantities : tuple of Quantity
    extras : int
        Numbers of a session and condition that its shortcut draws.
    conditions : callable
        Settings -> names of the conditions; refuses settings that do not go together.
    simulate : callable
        Settings, seeds, sessions -> whatever `estimate` takes.
    estimate : callable
        Settings, what was simulated -> Numbers.
    shortcut : callable or None
        -> how estimates are drawn without a simulation.
    """

    line: str
    fields: tuple[Field, ...]
    quantities: tuple[Quantity, ...]
    extras: int
    conditions: Callable[[Settings], tuple[str, ...]]
    simulate: Callable[[Settings, Seeds, range], Any]
    estimate: Callable[[Settings, Any], Numbers]
    shortcut: Callable[[], Shortcut] | None = None


RIGS: Final[MethodTable[Rig]] = MethodTable(
    "armimpedance.lab.simulate_study.rigs", "RIG", "rig", default="hand"
)
