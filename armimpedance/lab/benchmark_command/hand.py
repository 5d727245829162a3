"""Persons whose hand is pushed and brought back: a drawn arm, a drawn posture, a drawn activity."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from armimpedance.lab.benchmark import Group
from armimpedance.lab.benchmark_command.task import Made

if TYPE_CHECKING:
    from collections.abc import Callable

    from manipulandum_sim.hand import SimulatedSubject, Truth

ASKS = """
In a record lies `recording`: 24 pushes of the hand by 5 mm and back within .3 s, in eight
directions, sampled at 1 kHz; columns of `samples`: trial, time_s, x_m, y_m (hand from the shoulder,
which is the origin), fx_N, fy_N (force **by the hand on the handle**), q_shoulder_rad, q_elbow_rad.
`trials.csv` has each push's onset and end. Noise is that of sensors and of a person: tremor, slow
voluntary force, drift.

Asked, at the hand: inertia M, viscosity B, stiffness K of the limb itself, `F = -M a - B v - K x`
for small departures; `K_12` is the force along x per way along y. `handle_mass_kg` in
`recording.json` stands between sensor and hand and is not the limb's.
"""
SETS = 3


def drawn_person(rng: np.random.Generator) -> SimulatedSubject:
    """A person of 1.55 to 1.95 m, 50 to 95 kg, whose strength is not told by either."""
    from manipulandum_sim.hand import SimulatedSubject

    height = rng.uniform(1.55, 1.95)
    upper, lower = height * np.array([0.1765, 0.2]) * rng.uniform(0.97, 1.03, 2)
    mass, strength = rng.uniform(50, 95), rng.uniform(0.7, 1.4)
    return SimulatedSubject("person", mass, height, float(upper), float(lower), strength)


def pushed(rig: Callable[[np.random.Generator], dict[str, Any]]) -> Callable[[int], Made]:
    """What draws a record of pushes.

    Parameters
    ----------
    rig : callable
        A generator -> fields of the simulator's rig.
    """

    def draw(seed: int) -> Made:
        from manipulandum_sim.hand import (
            Arm,
            Condition,
            find_truth,
            nominal_hand,
            simulate_condition,
        )

        rng = np.random.default_rng(seed)
        person, fields = drawn_person(rng), rig(rng)
        hand = np.array(nominal_hand(person)) + rng.uniform(-0.06, 0.06, 2)
        condition = Condition("pushed", (hand[0], hand[1]), cocontraction=rng.uniform(0.02, 0.25))
        truth = find_truth(Arm.of(person), [condition], handle_mass_kg=0.0)

        def recordings() -> dict[str, Any]:
            made, _ = simulate_condition(
                condition, seed=seed, subject=person, sets=SETS, emg=False, **fields
            )
            return {"recording": made}

        return Made(matrices(truth, 0), recordings)

    return draw


def matrices(truth: Truth, row: int) -> tuple[Group, ...]:
    """M, B, K at the hand of one condition."""
    return (
        Group.matrix("M", "kg", truth.M_e[row]),
        Group.matrix("B", "N s/m", truth.B_e[row]),
        Group.matrix("K", "N/m", truth.K_e[row]),
    )
