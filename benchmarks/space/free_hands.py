"""Muscles fitted to hands with free elbows: how far other hands are off, and what bands hold.

    python benchmarks/space/free_hands.py A7 B11 A12
    python benchmarks/space/free_hands.py wrist A7 B11

For each person and seed: a session of 24 postures, at the corners of a box of 40, 34, 34 and 46
degrees and inside (those at which the muscles bear the arm), 26 pushes each; K of the hand by
`estimate`; `fit muscles` to the hands as they are, with the moment arms of another person; K of 50
other hands inside the box, activations known. Printed: error of whole matrices that were measured,
of those that are predicted (median, largest of 95 %), what bands of all elements hold, their half
width; then the same with torque. With ``wrist`` the wrist is free, too: seven joints, 36 postures
at corners of a box of 40, 34, 34, 46, 50, 14 and 40 degrees drawn at random, the arm "myoarm7".
"""

from __future__ import annotations

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import sys
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Literal

import numpy as np

import armimpedance as ai
from armimpedance.core.errors import InputError
from armimpedance.hand.levels import arm_of_whose
from armimpedance.muscles.models import MuscleModel, at_hand, matrix
from armimpedance.muscles.show import free_hand_rows
from manipulandum_sim.hand import find_subject
from manipulandum_sim.space import (
    SpaceCondition,
    SpaceRig,
    find_space_truth,
    simulate_space,
    write_moment_arms,
)


@dataclass(frozen=True)
class Workspace:
    """Where hands are measured: the middle and half ranges of the angles, rad."""

    middle: np.ndarray
    half: np.ndarray
    wrist: Literal["locked", "free"]

    @property
    def rig(self) -> SpaceRig:
        """An arm whose joints are all free."""
        return SpaceRig(elbow="free", wrist=self.wrist)

    def conditions(self, u: np.ndarray, levels: np.ndarray) -> list[SpaceCondition]:
        """At scaled places (P, n) and levels (P,) of co-contraction."""
        q = self.middle + u * self.half
        return [SpaceCondition(tuple(a), float(b), STILL) for a, b in zip(q, levels, strict=True)]


STILL = (0.0, 0.0, 0.0)
LOCKED = Workspace(np.array([0.75, 0.85, 0.15, 1.35]), np.radians([20, 17, 17, 23]), "locked")
FREE = Workspace(
    np.array([-0.7, 0.9, 0.8, 1.4, 0.1, -0.05, -0.1]),
    np.radians([20, 17, 17, 23, 25, 7, 20]),
    "free",
)


def postures(
    place: Workspace, rng: np.random.Generator
) -> tuple[list[SpaceCondition], list[SpaceCondition]]:
    """Where it is measured, and where it is asked."""
    n = len(place.middle)
    if place is LOCKED:
        corners = np.array(list(product((-1, 1), repeat=n))) * rng.uniform(0.85, 1, (16, n))
    else:
        corners = rng.choice([-1.0, 1.0], (28, n)) * rng.uniform(0.6, 1, (28, n))
    inside, asked = rng.uniform(-0.8, 0.8, (8, n)), rng.uniform(-0.8, 0.8, (50, n))
    measured = np.vstack([corners, inside])
    return (
        place.conditions(measured, rng.uniform(0.03, 0.3, len(measured))),
        place.conditions(asked, rng.uniform(0.05, 0.28, len(asked))),
    )


def is_borne(place: Workspace, person: str, one: SpaceCondition) -> bool:
    """Whether the person's muscles bear the arm's weight there."""
    try:
        one.plant(find_subject(person), place.rig)
    except InputError:
        return False
    return True


def relative(found: np.ndarray, true: np.ndarray) -> np.ndarray:
    """Errors of whole matrices, parts of their size."""
    return np.asarray(np.linalg.norm(found - true, axis=(1, 2)) / np.linalg.norm(true, axis=(1, 2)))


def session(place: Workspace, person: str, seed: int) -> None:
    """Print two lines."""
    measured, asked = (
        [one for one in some if is_borne(place, person, one)]
        for some in postures(place, np.random.default_rng(seed))
    )
    recording, own = simulate_space(
        measured, seed=seed, subject=person, sets=1, emg=True, elbow="free", wrist=place.wrist
    )
    hands = ai.estimate(recording)
    K_own = np.array([own.K_e[list(own.conditions).index(e.keys["condition"])] for e in hands])
    direct = np.median(relative(np.array([e.stiffness for e in hands]), K_own))
    plants = [one.plant(find_subject(person), place.rig) for one in asked]
    names = [str(i) for i in range(len(asked))]
    truth = find_space_truth(plants, np.zeros((len(asked), 3)), names, 0.164, "free")
    alpha = np.array([plant.tension / plant.muscles.greatest for plant in plants])
    K = (truth.K_e + truth.K_e.swapaxes(1, 2)) / 2
    upper = (slice(None), *np.triu_indices(3))
    rows, arm = free_hand_rows(hands, recording), arm_of_whose(recording, len(place.middle))
    with TemporaryDirectory() as folder:
        table = Path(folder) / "arms.csv"
        write_moment_arms(table, seed=seed)
        known = str(table) if place is LOCKED else "myoarm7"
        for torque in (False, True):
            model: MuscleModel = ai.fit_muscles(rows, arm=known, order=1, torque=torque)
            said = at_hand(model.predict(truth.posture, alpha), arm, np.zeros((len(asked), 3)))
            error, half = relative(said.stiffness_matrices, K), said.half_width("stiffness")
            held = np.abs(said.stiffness_matrices - K)[upper] <= half
            width = relative(matrix(half) + K, K)
            print(
                f"{person}{seed}{' torque' if torque else ''}: measured {100 * direct:.1f} % off, "
                f"predicted {100 * np.median(error):.1f} ({100 * np.quantile(error, 0.95):.1f}), "
                f"bands of {100 * np.median(width):.0f} % hold {100 * held.mean():.0f} %",
                flush=True,
            )


if __name__ == "__main__":
    words = sys.argv[1:]
    for asked_for in words[words[:1] == ["wrist"] :]:
        where = FREE if words[0] == "wrist" else LOCKED
        session(where, asked_for[0], int(asked_for[1:]))
