"""The three experiments of Tsuji (1997), section 3.2, as lists of conditions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.core.conventions import FORCE_UNIT_N, NOMINAL_POSTURE_RAD
from armimpedance.core.errors import InputError
from manipulandum_sim.hand.arm_plant import Arm
from manipulandum_sim.hand.subjects import SimulatedSubject

DIRECTIONS: Final = 8

#: Hand locations from the shoulder for a reach of .64 m, in rows from near to far (m); scaled to
#: the subject's reach.
_X_M: Final = (-0.28, -0.18, -0.08, 0.02, 0.12)
_Y_M: Final = (0.28, 0.36, 0.44, 0.52)
_REACH_M: Final = 0.64
#: Who visits all 20 locations, and which of them (row by row) the others do.
_TWENTY: Final = ("A", "A_alike")
_ELEVEN: Final = (0, 2, 4, 6, 8, 10, 12, 14, 16, 17, 18)


@dataclass(frozen=True)
class Condition:
    """A condition: the subject's task.

    Attributes
    ----------
    name : str
    hand : (float, float)
        Hand location from the shoulder (m).
    force : (float, float)
        Force by the hand on the handle (N).
    cocontraction : float or None
        Mean activation of muscles 5 and 6, 0..1; None: not asked for.
    """

    name: str
    hand: tuple[float, float]
    force: tuple[float, float] = (0.0, 0.0)
    cocontraction: float | None = None


@dataclass(frozen=True)
class Experiment:
    """A named list of conditions; `key` starts the keys of its random numbers."""

    name: str
    key: int
    conditions: Callable[[SimulatedSubject], tuple[Condition, ...]]


def nominal_hand(subject: SimulatedSubject) -> tuple[float, float]:
    """Hand location of a subject in the nominal posture.

    Parameters
    ----------
    subject : SimulatedSubject

    Returns
    -------
    tuple of float
        x and y, m.
    """
    q1, q2 = np.array(NOMINAL_POSTURE_RAD)
    x, y = Arm.of(subject).link.end_position(q1, q2)
    return float(x), float(y)


def _postures(subject: SimulatedSubject) -> tuple[Condition, ...]:
    scale = (subject.upper_arm_m + subject.forearm_hand_m) / _REACH_M
    grid = [(scale * x, scale * y) for y in _Y_M for x in _X_M]
    hands = grid if subject.id in _TWENTY else [grid[i] for i in _ELEVEN]
    return tuple(Condition(f"posture_{n:02d}", hand) for n, hand in enumerate(hands, 1))


def _cocontraction(subject: SimulatedSubject) -> tuple[Condition, ...]:
    hand = nominal_hand(subject)
    return tuple(
        Condition(f"cocontraction_{percent:02d}", hand, cocontraction=percent / 100)
        for percent in range(0, 31, 5)
    )


def _force(subject: SimulatedSubject) -> tuple[Condition, ...]:
    hand = nominal_hand(subject)
    asked = [(size, 45 * k) for size in (0.5, 1.0, 2.0) for k in range(DIRECTIONS)]
    asked += [(3.0, 90), (3.0, 270)]
    return tuple(
        Condition(f"force_{size:.1f}_x9.8N_{angle:03d}deg", hand, hand_force(size, angle))
        for size, angle in asked
    )


def hand_force(size: float, angle_deg: float) -> tuple[float, float]:
    """Force (N) of `size` x 9.8 N along a direction counter-clockwise from +x."""
    angle = np.deg2rad(angle_deg)
    f = size * FORCE_UNIT_N * np.array([np.cos(angle), np.sin(angle)])
    return float(f[0]), float(f[1])


EXPERIMENTS: Final = {
    e.name: e
    for e in (
        Experiment("postures", 1, _postures),
        Experiment("cocontraction", 2, _cocontraction),
        Experiment("force", 3, _force),
    )
}


def find_experiment(name: str) -> Experiment:
    """An experiment by its name.

    Parameters
    ----------
    name : {"postures", "cocontraction", "force"}

    Returns
    -------
    Experiment

    Raises
    ------
    InputError
        If there is no such experiment.
    """
    if name not in EXPERIMENTS:
        raise InputError(f"no experiment {name!r}", expected=" or ".join(EXPERIMENTS))
    return EXPERIMENTS[name]
