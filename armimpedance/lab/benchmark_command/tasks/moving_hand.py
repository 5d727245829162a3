"""A hand that is pushed while it reaches."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from armimpedance.lab.benchmark import AskedGroup
from armimpedance.lab.benchmark_command.task import Made, Task, drawn_person

#: After the nominal onset of a push, s: the middle of what it shows.
_LATER_S: Final = 0.1
_UNITS: Final = {"M": "kg", "B": "N s/m", "K": "N/m"}


def _draw(seed: int) -> Made:
    from manipulandum_sim.movement import MovementRig, find_truth

    rng = np.random.default_rng(seed)
    person, rig = drawn_person(rng), MovementRig()
    truth = find_truth(rig, person)
    onsets = rig.nominal_time(np.array(rig.phases)) - rig.go_s

    def at(name: str, time_s: float) -> np.ndarray:
        course = getattr(truth, f"{name}_e").reshape(len(truth.time_s), 4)
        return np.array([np.interp(time_s, truth.time_s, c) for c in course.T]).reshape(2, 2)

    def group(name: str) -> AskedGroup:
        parts = {
            f"{element}@{phase:g}": value
            for phase, onset in zip(rig.phases, onsets, strict=True)
            for element, value in AskedGroup.matrix(
                name, _UNITS[name], at(name, onset + _LATER_S)
            ).values.items()
        }
        return AskedGroup(name, _UNITS[name], parts)

    def recordings() -> dict[str, Any]:
        from manipulandum_sim.movement import simulate_movement

        made, _ = simulate_movement(seed=seed, subject=person, repeats=4, unperturbed=32)
        return {"recording": made}

    return Made((group("M"), group("B"), group("K")), recordings)


TASK: Final = Task(
    line="The hand reaches; some reaches are pushed at three places on the way.",
    asks="""
In a record lies `recording`: 128 reaches of 25 cm in .7 s at 1 kHz, 32 of them free, the others
pushed by a force doublet in eight directions where the hand has travelled 12, 50 or 94 % of the way
(`trials.csv`: phase, push_deg, push_onset_s, push_end_s). Columns of `samples` as in `hand_ideal`.

Asked, at the hand: M, B, K of the limb itself as it moves, 0.1 s after the undisturbed reach has
travelled these shares of the way (`K_12@0.5`). Coriolis terms are in B and K, which are therefore
not symmetric. `handle_mass_kg` in `recording.json` is not the limb's.
""",
    draw=_draw,
)
