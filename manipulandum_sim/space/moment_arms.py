"""Anatomy of the muscles: a table of another person's moment arms over posture."""

from __future__ import annotations

import csv
import os
from itertools import product
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from manipulandum_sim.space.muscles import (
    IN_SERIES,
    MIDDLE_RAD,
    SHORT_RANGE,
    SPACE_MUSCLES,
    SpaceMuscles,
)

#: Angles of the table's grid about the middle posture, rad.
_REACH_RAD: Final = (1.3, 0.6, 1.2, 0.7)
#: Standard deviation of a moment arm from person to person, as a part of it.
APART: Final = 0.1


def write_moment_arms(path: str | os.PathLike[str], seed: int) -> None:
    """Write moment arms of a person of the same kind as a table over the four angles.

    Parameters
    ----------
    path : path
        A CSV: muscle, ``q_1_rad`` to ``q_4_rad``, ``G_1_m`` to ``G_4_m`` (``dL/dq``), and one
        maximum tension a muscle and one stiffness per tension.
    seed : int
        Each muscle's length changes are another's by a factor of its own for each joint.
    """
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(302,)))
    other = SpaceMuscles.of(1.0)
    scale = np.maximum(1 + APART * rng.normal(size=other.arms.shape), 0.5)
    # L(S u) is a length whatever S is: arms of the joint j are S_j dL/du_j
    q = np.array(list(product(*([-1.0, 0.0, 1.0],) * 4))) * _REACH_RAD + MIDDLE_RAD
    with open(path, "w", encoding="utf-8", newline="") as stream:
        table = csv.writer(stream)
        angles, arms = (
            [f"{s}_{j}_{u}" for j in range(1, 5)] for s, u in (("q", "rad"), ("G", "m"))
        )
        strength = ("max_tension_N", "stiffness_per_tension_per_m")
        table.writerow(["muscle", *angles, *arms, *strength])
        kappa = float(np.median(SHORT_RANGE * IN_SERIES / other.fibre))
        for i, muscle in enumerate(SPACE_MUSCLES):
            for posture, G in zip(q, _arms(other, i, q, scale[i]), strict=True):
                numbers = [*posture, *G, other.greatest[i], kappa]
                table.writerow([muscle, *(f"{value:.9g}" for value in numbers)])


def _arms(muscles: SpaceMuscles, i: int, q: FloatArray, scale: FloatArray) -> FloatArray:
    """``dL/dq`` (P, 4) of one muscle whose angles count `scale` (4,) times."""
    turned = np.array(MIDDLE_RAD) + scale * (q - np.array(MIDDLE_RAD))
    return np.asarray(muscles.jacobian(turned)[:, i] * scale)
