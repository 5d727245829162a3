"""A hand pushed by a robot that does exactly what it is told."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from armimpedance.lab.benchmark_command.task import ASKS, Task, pushed


def _rig(_rng: np.random.Generator) -> dict[str, Any]:
    from manipulandum_sim.hand import IDEAL

    return {"servo": IDEAL}


TASK: Final = Task(
    line="The hand is pushed and brought back by a robot that does exactly what it is told.",
    asks=ASKS,
    draw=pushed(_rig),
)
