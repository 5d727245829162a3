"""A hand pushed by a soft robot."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from armimpedance.lab.benchmark_command.task import ASKS, Task, pushed


def _rig(rng: np.random.Generator) -> dict[str, Any]:
    from manipulandum_sim.hand import Servo

    return {"servo": Servo(rng.uniform(1500.0, 6000.0))}


TASK: Final = Task(
    line="The robot that pushes the hand is soft: it does something else than it was told.",
    asks=ASKS,
    draw=pushed(_rig),
)
