"""Joint impedance where nobody measured: from some postures to others."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any, Final

import numpy as np

from armimpedance.lab.benchmark import AskedGroup
from armimpedance.lab.benchmark_command.task import UNITS, Made, Task, drawn_person

_ASKED: Final = 4


def _draw(seed: int) -> Made:
    from manipulandum_sim.hand import Arm, Condition, find_experiment, find_truth

    rng = np.random.default_rng(seed)
    person = drawn_person(rng)
    hands = np.array([c.hand for c in find_experiment("postures").conditions(person)])
    # between measured ones: means of two neighbours
    pairs = [rng.permutation(len(hands))[:3] for _ in range(_ASKED)]
    wanted = [tuple(hands[rows].mean(axis=0)) for rows in pairs]
    conditions = [Condition(f"asked_{n}", hand) for n, hand in enumerate(wanted, 1)]
    truth = find_truth(Arm.of(person), conditions, handle_mass_kg=0.0)

    def recordings() -> dict[str, Any]:
        from manipulandum_sim.hand import simulate

        made, _ = simulate("postures", seed=seed, subject=person, sets=1, emg=False)
        return {"recording": made}

    def tell(folder: Path) -> None:
        with (folder / "postures.csv").open("w", newline="", encoding="utf-8") as stream:
            rows = csv.writer(stream, lineterminator="\n")
            rows.writerow(["posture", "q_shoulder_rad", "q_elbow_rad"])
            rows.writerows([n, *map(repr, q.tolist())] for n, q in enumerate(truth.posture, 1))

    return Made(joint_groups(truth.B_j, truth.K_j), recordings, tell)


def joint_groups(B: np.ndarray, K: np.ndarray) -> tuple[AskedGroup, ...]:
    """B and K at the joints (C, 2, 2) of conditions that are counted from 1."""
    made = []
    for name, values in (("B", B), ("K", K)):
        parts = {
            f"{element}@{n}": value
            for n, rows in enumerate(values, 1)
            for element, value in AskedGroup.matrix(name, UNITS[name], rows).values.items()
        }
        made.append(AskedGroup(name, UNITS[name], parts))
    return tuple(made)


TASK: Final = Task(
    line="A relaxed arm measured at eleven places: its joint impedance at four others.",
    asks="""
In a record lies `recording`: at each of eleven hand locations (`condition` of `trials.csv`) eight
pushes as in `hand_ideal`, behind a servo of 20 kN/m; and `postures.csv`, four postures in between.
Asked: viscosity B and stiffness K at the joints there, `tau = -K dq`, shoulder 1, elbow 2, the
angle of the elbow relative (`K_12@3`: asked posture 3), the muscles and passive joints alone.
""",
    draw=_draw,
)
