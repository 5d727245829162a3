"""Tasks of the hand: pushed by robots of several kinds, moved at random, reaching."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from armimpedance.lab.benchmark import AskedGroup
from armimpedance.lab.benchmark_command.task import ASKS, Made, Task, drawn_person, matrices, pushed

# A hand pushed by a robot that does exactly what it is told.


def _rig_hand_ideal(_rng: np.random.Generator) -> dict[str, Any]:
    from manipulandum_sim.hand import IDEAL

    return {"servo": IDEAL}


# A hand pushed by a soft robot.


def _rig_hand_soft(rng: np.random.Generator) -> dict[str, Any]:
    from manipulandum_sim.hand import Servo

    return {"servo": Servo(rng.uniform(1500.0, 6000.0))}


# A hand whose stretch reflex answers the push.


def _rig_hand_reflex(rng: np.random.Generator) -> dict[str, Any]:
    from manipulandum_sim.hand import IDEAL, Reflex

    return {"servo": IDEAL, "reflex": Reflex(rng.uniform(0.15, 0.5), rng.uniform(0.04, 0.07))}


# A hand pushed by a soft robot that does not bring it quite back, with a reflex.


def _rig_hand_mixed(rng: np.random.Generator) -> dict[str, Any]:
    from manipulandum_sim.hand import Reflex, Servo

    return {
        "servo": Servo(rng.uniform(1500.0, 20_000.0)),
        "reflex": Reflex(rng.uniform(0.0, 0.4), rng.uniform(0.04, 0.07)),
        "residual_m": rng.uniform(0.0, 4e-4),
        "disturbance": str(rng.choice(["minimum_jerk", "biphasic"])),
    }


# A hand that a stiff robot moves at random along both axes; half of the people have a reflex.

_TRIALS: Final = 4


_DURATION_S: Final = 15.0


def _draw_hand_random(seed: int) -> Made:
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


# A hand that is pushed while it reaches.

#: After the nominal onset of a push, s: the middle of what it shows.
_LATER_S: Final = 0.1


_UNITS: Final = {"M": "kg", "B": "N s/m", "K": "N/m"}


def _draw_moving_hand(seed: int) -> Made:
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


HAND_TASKS: Final = {
    "hand_ideal": Task(
        line="The hand is pushed and brought back by a robot that does exactly what it is told.",
        asks=ASKS,
        draw=pushed(_rig_hand_ideal),
    ),
    "hand_soft": Task(
        line="The robot that pushes the hand is soft: it does something else than it was told.",
        asks=ASKS,
        draw=pushed(_rig_hand_soft),
    ),
    "hand_reflex": Task(
        line="A stretch reflex answers the push; what is asked is the limb without it.",
        asks=ASKS,
        draw=pushed(_rig_hand_reflex),
    ),
    "hand_mixed": Task(
        line="A soft robot, a reflex, a push that does not come quite back: any of them, in any "
        "size.",
        asks=ASKS,
        draw=pushed(_rig_hand_mixed),
    ),
    "hand_random": Task(
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
        draw=_draw_hand_random,
    ),
    "moving_hand": Task(
        line="The hand reaches; some reaches are pushed at three places on the way.",
        asks="""
In a record lies `recording`: 128 reaches of 25 cm in .7 s at 1 kHz, 32 of them free, the others
pushed by a force doublet in eight directions where the hand has travelled 12, 50 or 94 % of the way
(`trials.csv`: phase, push_deg, push_onset_s, push_end_s). Columns of `samples` as in `hand_ideal`.

Asked, at the hand: M, B, K of the limb itself as it moves, 0.1 s after the undisturbed reach has
travelled these shares of the way (`K_12@0.5`). Coriolis terms are in B and K, which are therefore
not symmetric. `handle_mass_kg` in `recording.json` is not the limb's.
""",
        draw=_draw_moving_hand,
    ),
}
