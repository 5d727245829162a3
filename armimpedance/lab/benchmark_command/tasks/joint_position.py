"""One joint in a stiff position servo, whose owner pushes against it."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from armimpedance.lab.benchmark_command.task import COLUMNS, DrawnJoint, Made, Task


def _draw(seed: int) -> Made:
    rng = np.random.default_rng(seed)
    joint = DrawnJoint.of(rng)

    def recordings() -> dict[str, Any]:
        from manipulandum_sim.elbow import simulate_servo

        made, _ = simulate_servo(joint.I, joint.B, joint.K, duration_s=20.0, seed=seed)
        return {"recording": made}

    return Made(joint.groups, recordings)


TASK: Final = Task(
    line="One joint that a stiff servo moves at random while its owner pushes slowly.",
    asks="""
In a record lies `recording`: 20 s at 1 kHz of random angles that a servo imposes on a joint,
`I theta'' + B theta' + K theta = tau + v`; v, the person's own slow torque, is not known. White
noise of 40 dB on torque and angle. The commanded angle is recorded too. Asked: I, B, K.
"""
    + COLUMNS,
    draw=_draw,
)
