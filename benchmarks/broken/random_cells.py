"""`random` and `movement`: a hand that is moved at random, and one that reaches."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from broken import damage
from broken.cell import Answer, Cell, Made, Rig, damaged, on_record, said, seed_of, seeds_of
from broken.hand_cells import numbers_of
from random_hand import drawn

from armimpedance.hand.random import identify_random
from armimpedance.hand.reaching import identify_movement
from manipulandum_sim.movement import MovementRig, simulate_movement

PHASE = 0.5


def linear_hands(indices: Sequence[int]) -> list[Made]:
    """A minute of a linear hand without reflex, under displacements or forces."""
    made = []
    for i in indices:
        imposed = "position" if i % 2 else "force"
        record = drawn.session(imposed, 0 * drawn.K, 0.04, seeds_of("random", i))
        truth = {
            f"{symbol}_{r + 1}{c + 1}": float(matrix[r, c])
            for symbol, matrix in (("M", drawn.M), ("B", drawn.B), ("K", drawn.K))
            for r in range(2) for c in range(2)
        }  # fmt: skip
        made.append(Made(record, truth))
    return made


def reaches(indices: Sequence[int]) -> list[Made]:
    """Reaches with pushes in their middle; the simulator of the package."""
    made = []
    for i in indices:
        rig = MovementRig(phases=(PHASE,))
        record, truth = simulate_movement(seed=seed_of("reaches", i), phases=(PHASE,), repeats=6)
        (found,) = identify_movement(record)
        travelled = float((np.asarray(found.position) - rig.line.start_m) @ rig.line.along)
        values = {
            f"{symbol}_{r + 1}{c + 1}": float(truth.at(f"{symbol}_e", travelled)[r, c])
            for symbol in "MBK" for r in range(2) for c in range(2)
        }  # fmt: skip
        made.append(Made(record, values))
    return made


def ask_random(made: Made) -> Answer:
    """M, B and K of the one group."""
    (one,) = identify_random(made.record)
    return Answer(numbers_of(one.estimate), **said((), one.estimate.warnings))


def ask_movement(made: Made) -> Answer:
    """M, B and K of the one phase."""
    (one,) = identify_movement(made.record)
    return Answer(numbers_of(one), **said((), one.warnings))


RANDOM = Rig("random", "linear hand", linear_hands, ask_random)
REACHES = Rig("movement", "reaches", reaches, ask_movement)


def cells() -> list[Cell]:
    """Sessions that change."""
    half = damage.gain_from_the_middle("force", (0.5, 1.0))
    changed: list[tuple[str, str, Any]] = [
        ("a gain changes in the middle", "10 %", damage.gain_from_the_middle("force", 1.1)),
        ("a gain drifts", "10 %", damage.growing_gain("force", 0.1)),
        ("one channel from the middle on", "half its gain", half),
    ]
    return [
        Cell(rig, violation, size, ("session",), damaged(rig, on_record(how)))
        for rig in (RANDOM, REACHES)
        for violation, size, how in changed
    ]


CLEAN = (RANDOM, REACHES)
