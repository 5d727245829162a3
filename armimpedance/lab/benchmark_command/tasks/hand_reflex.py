"""A hand whose stretch reflex answers the push."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from armimpedance.lab.benchmark_command.task import ASKS, Task, pushed


def _rig(rng: np.random.Generator) -> dict[str, Any]:
    from manipulandum_sim.hand import IDEAL, Reflex

    return {"servo": IDEAL, "reflex": Reflex(rng.uniform(0.15, 0.5), rng.uniform(0.04, 0.07))}


TASK: Final = Task(
    line="A stretch reflex answers the push; what is asked is the limb without it.",
    asks=ASKS,
    draw=pushed(_rig),
)
