"""One joint under a random torque, with a reflex."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from armimpedance.lab.benchmark_command.task import COLUMNS, DrawnJoint, Made, Task


def _draw(seed: int) -> Made:
    rng = np.random.default_rng(seed)
    joint = DrawnJoint.of(rng)
    share, delay_s = rng.uniform(0.1, 0.35), rng.uniform(0.04, 0.07)

    def recordings() -> dict[str, Any]:
        from manipulandum_sim.elbow import Departures, simulate_bench

        late = Departures(answer=share * joint.K, delay_s=delay_s)
        made, _ = simulate_bench(joint.I, joint.B, joint.K, snr_db=20.0, seed=seed, departures=late)
        return {"recording": made}

    return Made(joint.groups, recordings)


TASK: Final = Task(
    line="One joint under a random torque, with a late answer to its deflection.",
    asks="""
As `joint_torque`, but the joint answers its deflection some 50 ms late with a further torque of a
tenth to a third of K. Asked: I, B and K without that answer.
"""
    + COLUMNS,
    draw=_draw,
)
