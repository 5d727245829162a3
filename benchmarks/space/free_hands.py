"""Muscles fitted to hands with free elbows: how far other hands are off, and what bands hold.

    python benchmarks/space/free_hands.py A7 B11 A12

For each person and seed: a session of 24 postures, at the corners of a box of 40, 34, 34 and 46
degrees and inside (those at which the muscles bear the arm), 26 pushes each; K of the hand by
`estimate`; `fit muscles` to the hands as they are, with the moment arms of another person; K of 50
other hands inside the box, activations known. Printed: error of whole matrices that were measured,
of those that are predicted (median, largest of 95 %), what bands of all elements hold, their half
width; then the same with torque.
"""

from __future__ import annotations

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import sys
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import armimpedance as ai
from armimpedance.analyses import arm_of_whose, free_hand_rows
from armimpedance.errors import InputError
from armimpedance.muscles import MuscleModel, at_hand, matrix
from manipulandum_sim.hand import find_subject
from manipulandum_sim.space import (
    SpaceCondition,
    SpaceRig,
    find_space_truth,
    simulate_space,
    write_moment_arms,
)

MIDDLE = np.array([0.75, 0.85, 0.15, 1.35])
HALF = np.radians([20, 17, 17, 23])
STILL = (0.0, 0.0, 0.0)


def postures(rng: np.random.Generator) -> tuple[list[SpaceCondition], list[SpaceCondition]]:
    """Where it is measured, and where it is asked."""
    corners = np.array(list(product((-1, 1), repeat=4))) * rng.uniform(0.85, 1, (16, 4))
    inside, asked = rng.uniform(-0.8, 0.8, (8, 4)), rng.uniform(-0.8, 0.8, (50, 4))
    return tuple(  # type: ignore[return-value]
        [
            SpaceCondition(tuple(MIDDLE + u * HALF), float(rng.uniform(low, high)), STILL)
            for u in places
        ]
        for places, low, high in ((np.vstack([corners, inside]), 0.03, 0.3), (asked, 0.05, 0.28))
    )


def is_borne(person: str, one: SpaceCondition) -> bool:
    """Whether the person's muscles bear the arm's weight there."""
    try:
        one.plant(find_subject(person), SpaceRig(elbow="free"))
    except InputError:
        return False
    return True


def relative(found: np.ndarray, true: np.ndarray) -> np.ndarray:
    """Errors of whole matrices, parts of their size."""
    return np.asarray(np.linalg.norm(found - true, axis=(1, 2)) / np.linalg.norm(true, axis=(1, 2)))


def session(person: str, seed: int) -> None:
    """Print two lines."""
    measured, asked = (
        [one for one in some if is_borne(person, one)]
        for some in postures(np.random.default_rng(seed))
    )
    recording, own = simulate_space(
        measured, seed=seed, subject=person, sets=1, emg=True, elbow="free"
    )
    hands = ai.estimate(recording)
    K_own = np.array([own.K_e[list(own.conditions).index(e.keys["condition"])] for e in hands])
    direct = np.median(relative(np.array([e.stiffness for e in hands]), K_own))
    plants = [one.plant(find_subject(person), SpaceRig(elbow="free")) for one in asked]
    names = [str(i) for i in range(len(asked))]
    truth = find_space_truth(plants, np.zeros((len(asked), 3)), names, 0.164, "free")
    alpha = np.array([plant.tension / plant.muscles.greatest for plant in plants])
    K = (truth.K_e + truth.K_e.swapaxes(1, 2)) / 2
    upper = (slice(None), *np.triu_indices(3))
    rows, arm = free_hand_rows(hands, recording), arm_of_whose(recording, 4)
    with TemporaryDirectory() as folder:
        write_moment_arms(Path(folder) / "arms.csv", seed=seed)
        for torque in (False, True):
            model: MuscleModel = ai.fit_muscles(
                rows, arm=str(Path(folder) / "arms.csv"), order=1, torque=torque
            )
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
    for asked_for in sys.argv[1:]:
        session(asked_for[0], int(asked_for[1:]))
