"""Joint impedance at activations that nobody measured."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any, Final

import numpy as np

from armimpedance.lab.benchmark_command.task import Made, Task, drawn_person
from armimpedance.lab.benchmark_command.tasks.posture_model import joint_groups

_MEASURED: Final = tuple(f"cocontraction_{level:02d}" for level in (0, 10, 20, 30))
_FORCES: Final = tuple(f"force_1.0_x9.8N_{angle:03d}deg" for angle in (0, 90, 180, 270))


def _draw(seed: int) -> Made:
    from manipulandum_sim.hand import Arm, Condition, find_truth, hand_force, nominal_hand

    rng = np.random.default_rng(seed)
    person = drawn_person(rng)
    hand = nominal_hand(person)
    levels = [Condition("level", hand, cocontraction=c) for c in rng.uniform(0.03, 0.27, 2)]
    forces = [
        Condition("force", hand, hand_force(rng.uniform(0.5, 1.2), rng.uniform(0, 360)))
        for _ in range(2)
    ]
    truth = find_truth(Arm.of(person), levels + forces, handle_mass_kg=0.0)

    def recordings() -> dict[str, Any]:
        from manipulandum_sim.hand import simulate

        asked = {"cocontraction": _MEASURED, "force": _FORCES}
        return {
            name: simulate(name, conditions=those, seed=seed, subject=person, sets=1)[0]
            for name, those in asked.items()
        }

    def tell(folder: Path) -> None:
        with (folder / "states.csv").open("w", newline="", encoding="utf-8") as stream:
            rows = csv.writer(stream, lineterminator="\n")
            rows.writerow(["state", *(f"alpha_{m}" for m in range(1, 7))])
            rows.writerows(
                [n, *(f"{a:.9g}" for a in alpha)] for n, alpha in enumerate(truth.activation, 1)
            )

    return Made(joint_groups(truth.B_j, truth.K_j), recordings, tell)


TASK: Final = Task(
    line="An arm at one posture, measured with EMG: its joint impedance at other activations.",
    asks="""
In a record lie `cocontraction` (four levels) and `force` (9.8 N in four directions), eight pushes a
condition as in `hand_ideal` behind a servo of 20 kN/m, with raw EMG of six muscles and in
`trials.csv` each muscle's envelope at rest and in a maximum voluntary contraction; and
`states.csv`, four states of the six muscles' activation, 0 to 1. Asked: viscosity B and stiffness K
at the joints in those states (`K_12@3`: asked state 3), at the same posture.
""",
    draw=_draw,
)
