"""A hand pushed by a soft robot that does not bring it quite back, with a reflex."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from armimpedance.lab.benchmark_command.task import ASKS, Task, pushed


def _rig(rng: np.random.Generator) -> dict[str, Any]:
    from manipulandum_sim.hand import Reflex, Servo

    return {
        "servo": Servo(rng.uniform(1500.0, 20_000.0)),
        "reflex": Reflex(rng.uniform(0.0, 0.4), rng.uniform(0.04, 0.07)),
        "residual_m": rng.uniform(0.0, 4e-4),
        "disturbance": str(rng.choice(["minimum_jerk", "biphasic"])),
    }


TASK: Final = Task(
    line="A soft robot, a reflex, a push that does not come quite back: any of them, in any size.",
    asks=ASKS,
    draw=pushed(_rig),
)
