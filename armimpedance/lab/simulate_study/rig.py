"""A rig of a simulated study: its settings, its quantities, its simulator and estimator.

A new rig is a new file in the folder `rigs`, with the record RIG.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final, Literal, NamedTuple

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import ArmImpedanceError
from armimpedance.core.method_table import MethodTable
from armimpedance.lab.simulate_study.fields import Field, Settings
from armimpedance.numerics.regression import t_factor, t_interval

#: Sessions of one task and one file of the store. It is part of how sessions are seeded.
BLOCK: Final = 25
#: What is kept of an estimate, in the order of the last axis of `Numbers.values`.
COLUMNS: Final = ("estimate", "low", "high", "sd", "dof", "truth", "bound_sd")
ESTIMATE, LOW, HIGH, SD, DOF, TRUTH, BOUND = range(len(COLUMNS))

Kind = Literal["difference", "ratio", "share", "axis"]


class StudyQuantity(NamedTuple):
    """A quantity that is estimated.

    `kind`: how two conditions are compared: a share is a ratio with limits of its own, an axis an
    angle that half a turn leaves as it is.
    """

    name: str
    unit: str
    kind: Kind = "difference"


@dataclass(frozen=True)
class Seeds:
    """Random numbers of a simulated experiment: they hang on the study's seed and on what is asked.

    `part`: told by the settings that are simulated; not by those that only estimate.
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
    """Numbers of the estimates of C conditions and S sessions.

    `values` (C, S, quantities, 7): `COLUMNS`, SI; nan where there was no estimate.
    `extras` (C, S, E): what the shortcut draws.
    `problems`: why there was no estimate -> how often.
    """

    values: FloatArray
    extras: FloatArray
    problems: Mapping[str, int] = field(default_factory=dict)


@dataclass(frozen=True)
class Shortcut:
    """A shortcut that draws estimates of a rig instead of simulating them.

    `values`: extras (n, E), truth (Q,), bound's sd (Q,) -> numbers (n, Q, 7) as the rig has them.
    """

    values: Callable[[FloatArray, FloatArray, FloatArray], FloatArray]


@dataclass(frozen=True)
class Rig:
    """A simulated experiment and its analysis.

    `line`: what it is.
    `fields`: what can be set in a grid.
    `extras`: numbers of a session and condition that its shortcut draws.
    `conditions`: settings -> names of the conditions; refuses settings that do not go together.
    `simulate`: settings, seeds, sessions -> whatever `estimate` takes.
    `estimate`: settings, what was simulated -> Numbers.
    `shortcut`: -> how estimates are drawn without a simulation.
    """

    line: str
    fields: tuple[Field, ...]
    quantities: tuple[StudyQuantity, ...]
    extras: int
    conditions: Callable[[Settings], tuple[str, ...]]
    simulate: Callable[[Settings, Seeds, range], Any]
    estimate: Callable[[Settings, Any], Numbers]
    shortcut: Callable[[], Shortcut] | None = None


RIGS: Final[MethodTable[Rig]] = MethodTable(
    "armimpedance.lab.simulate_study.rigs", "RIG", "rig", default="hand"
)

# Fitted numbers with standard errors, and nothing made of them, as rows; how they are drawn.


class FittedNumbers(NamedTuple):
    """Values and standard errors (Q,), degrees of freedom, and the truth (Q,)."""

    values: FloatArray
    sd: FloatArray
    dof: float
    truth: FloatArray


def extras_of(quantities: int) -> int:
    """Number of values drawn for a session: estimates, logarithms of their errors, and of dof."""
    return 2 * quantities + 1


def numbers_of(
    fits: Iterable[Callable[[], FittedNumbers]], sessions: int, quantities: int
) -> Numbers:
    """Every session of one condition; what fails is nan, and its reason counted.

    `fits`: one for each session.
    """
    values = np.full((1, sessions, quantities, len(COLUMNS)), np.nan)
    extras = np.full((1, sessions, extras_of(quantities)), np.nan)
    problems: Counter[str] = Counter()
    for s, fit in enumerate(fits):
        try:
            found = fit()
        except ArmImpedanceError as error:
            problems[str(error)] += 1
            continue
        low, high = t_interval(found.values, found.sd, found.dof).T
        dof, unknown = np.full(quantities, found.dof), np.full(quantities, np.nan)
        columns = [found.values, low, high, found.sd, dof, found.truth, unknown]
        values[0, s] = np.column_stack(columns)
        # normal intervals stay normal: 1e300 stands for no end of degrees of freedom
        known = np.log(np.minimum(found.dof, 1e300))
        extras[0, s] = np.concatenate([found.values, np.log(found.sd), [known]])
    return Numbers(values, extras, dict(problems))


def _drawn(extras: FloatArray, truth: FloatArray, bound: FloatArray) -> FloatArray:
    """Numbers (n, Q, 7) from extras (n, 2 Q + 1)."""
    quantities = len(truth)
    value, sd = extras[:, :quantities], np.exp(extras[:, quantities:-1])
    dof = np.exp(extras[:, -1:])
    steady = bool(np.ptp(dof) <= 1e-9 * dof[0, 0])
    reach = sd * (t_factor(float(dof[0, 0])) if steady else _factors(dof))
    shape = value.shape
    wide = [np.broadcast_to(part, shape) for part in (dof, truth, bound)]
    return np.stack([value, value - reach, value + reach, sd, *wide], axis=-1)


def _factors(dof: FloatArray) -> FloatArray:
    from scipy.special import stdtrit

    return np.asarray(stdtrit(dof, 0.975))


SHORTCUT = Shortcut(_drawn)
