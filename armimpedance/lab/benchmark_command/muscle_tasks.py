"""Tasks of models over posture and activation."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any, Final

import numpy as np

from armimpedance.lab.benchmark import AskedGroup
from armimpedance.lab.benchmark_command.task import UNITS, Made, Task, drawn_person

# Joint impedance where nobody measured: from some postures to others.

_ASKED_POSTURES: Final = 4


def _draw_posture_model(seed: int) -> Made:
    from manipulandum_sim.hand import Arm, Condition, find_experiment, find_truth

    rng = np.random.default_rng(seed)
    person = drawn_person(rng)
    hands = np.array([c.hand for c in find_experiment("postures").conditions(person)])
    # between measured ones: means of two neighbours
    pairs = [rng.permutation(len(hands))[:3] for _ in range(_ASKED_POSTURES)]
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
    groups = []
    for name, values in (("B", B), ("K", K)):
        parts = {
            f"{element}@{n}": value
            for n, rows in enumerate(values, 1)
            for element, value in AskedGroup.matrix(name, UNITS[name], rows).values.items()
        }
        groups.append(AskedGroup(name, UNITS[name], parts))
    return tuple(groups)


# Joint impedance at activations that nobody measured.

_MEASURED_LEVELS: Final = tuple(f"cocontraction_{level:02d}" for level in (0, 10, 20, 30))


_MEASURED_FORCES: Final = tuple(f"force_1.0_x9.8N_{angle:03d}deg" for angle in (0, 90, 180, 270))


def _draw_emg_model(seed: int) -> Made:
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

        asked = {"cocontraction": _MEASURED_LEVELS, "force": _MEASURED_FORCES}
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


MUSCLE_TASKS: Final = {
    "posture_model": Task(
        line="A relaxed arm measured at eleven places: its joint impedance at four others.",
        asks="""
In a record lies `recording`: at each of eleven hand locations (`condition` of `trials.csv`) eight
pushes as in `hand_ideal`, behind a servo of 20 kN/m; and `postures.csv`, four postures in between.
Asked: viscosity B and stiffness K at the joints there, `tau = -K dq`, shoulder 1, elbow 2, the
angle of the elbow relative (`K_12@3`: asked posture 3), the muscles and passive joints alone.
""",
        draw=_draw_posture_model,
    ),
    "emg_model": Task(
        line="An arm at one posture, measured with EMG: its joint impedance at other activations.",
        asks="""
In a record lie `cocontraction` (four levels) and `force` (9.8 N in four directions), eight pushes a
condition as in `hand_ideal` behind a servo of 20 kN/m, with raw EMG of six muscles and in
`trials.csv` each muscle's envelope at rest and in a maximum voluntary contraction; and
`states.csv`, four states of the six muscles' activation, 0 to 1. Asked: viscosity B and stiffness K
at the joints in those states (`K_12@3`: asked state 3), at the same posture.
""",
        draw=_draw_emg_model,
    ),
}
