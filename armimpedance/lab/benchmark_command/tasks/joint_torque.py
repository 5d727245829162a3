"""One joint under a random torque."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from armimpedance.lab.benchmark_command.task import COLUMNS, DrawnJoint, Made, Task


def _draw(seed: int) -> Made:
    rng = np.random.default_rng(seed)
    joint = DrawnJoint.of(rng)

    def recordings() -> dict[str, Any]:
        from manipulandum_sim.elbow import simulate_bench

        made, _ = simulate_bench(joint.I, joint.B, joint.K, snr_db=20.0, seed=seed)
        return {"recording": made}

    return Made(joint.groups, recordings)


TASK: Final = Task(
    line="One joint under a random torque below 10 Hz.",
    asks="""
In a record lies `recording`: 10 s at 1 kHz of a random torque on a joint, `I theta'' + B theta' +
K theta = tau`; white noise of 20 dB on torque and angle. Asked: I, B, K.
"""
    + COLUMNS,
    draw=_draw,
)
