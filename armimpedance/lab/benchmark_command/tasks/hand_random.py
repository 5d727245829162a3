"""A hand that a stiff robot moves at random along both axes; half of the people have a reflex."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from armimpedance.lab.benchmark_command.task import Made, Task, drawn_person, matrices

_TRIALS: Final = 4
_DURATION_S: Final = 15.0


def _draw(seed: int) -> Made:
    from manipulandum_sim.hand import Arm, Condition, Reflex, find_truth, nominal_hand

    rng = np.random.default_rng(seed)
    person, cocontraction = drawn_person(rng), rng.uniform(0.05, 0.25)
    reflex = Reflex(rng.uniform(0.15, 0.5), rng.uniform(0.03, 0.06))
    answers = bool(rng.integers(2))
    held = Condition("random", nominal_hand(person), cocontraction=cocontraction)
    truth = find_truth(Arm.of(person), [held], handle_mass_kg=0.0)

    def recordings() -> dict[str, Any]:
        from manipulandum_sim.random_hand import simulate_random

        made, _ = simulate_random(
            seed=seed,
            subject=person,
            cocontraction=cocontraction,
            reflex=reflex if answers else None,
            trials=_TRIALS,
            duration_s=_DURATION_S,
        )
        return {"recording": made}

    return Made(matrices(truth, 0), recordings)


TASK: Final = Task(
    line="A stiff robot moves the hand at random along both axes, some hands have a reflex.",
    asks=f"""
In a record lies `recording`: {_TRIALS} trials of {_DURATION_S:g} s at 500 Hz, displacements of
2.5 mm rms from 2 to 20 Hz that a stiff servo imposes along both axes at once; columns of `samples`:
trial, time_s, x_m, y_m (hand from the shoulder, which is the origin), fx_N, fy_N (force **by the
hand on the handle**), command_x, command_y (what the robot was told, m). Of about half of the
people a stretch reflex answers with 15 to 50 % of the stiffness, 30 to 60 ms late; nothing tells
who they are. Noise is that of sensors and of a person: tremor, slow voluntary force.

Asked, at the hand: inertia M, viscosity B, stiffness K of the limb itself, `F = -M a - B v - K x`
for small departures, without the reflex; `K_12` is the force along x per way along y.
`handle_mass_kg` in `recording.json` stands between sensor and hand and is not the limb's.
""",
    draw=_draw,
)
