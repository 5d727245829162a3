"""One joint whose stiffness switches, moved by a stiff servo, with a reflex."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from armimpedance.lab.benchmark import AskedGroup
from armimpedance.lab.benchmark_command.task import COLUMNS, UNITS, DrawnJoint, Made, Task, scalar

_DURATION_S: Final = 30.0
_TIMES_S: Final = np.arange(1.5, 29.0, 1.5)


def _draw(seed: int) -> Made:
    rng = np.random.default_rng(seed)
    joint = DrawnJoint.of(rng)
    period_s, phase, ratio = rng.uniform(4, 8), rng.uniform(0, 1), rng.uniform(1.5, 3)
    gain, delay_s = joint.B * rng.uniform(0.3, 1.0), rng.uniform(0.035, 0.05)

    def stiffness(time_s: np.ndarray) -> np.ndarray:
        up = (time_s / period_s + phase) % 1 < 0.5
        return np.where(up, ratio * joint.K, joint.K)

    def recordings() -> dict[str, Any]:
        from manipulandum_sim.elbow import Reflex, simulate_cascade

        made, _ = simulate_cascade(
            joint.I,
            joint.B,
            stiffness,
            Reflex(gain, delay_s),
            own_Nm=0.2,
            duration_s=_DURATION_S,
            seed=seed,
        )
        return {"recording": made}

    K = AskedGroup.course("K", UNITS["K"], _TIMES_S, stiffness(_TIMES_S))
    return Made((scalar("I", joint.I), scalar("B", joint.B), K), recordings)


TASK: Final = Task(
    line="One joint whose stiffness switches between two levels while a servo moves it.",
    asks="""
In a record lies `recording`: 30 s at 1 kHz of random angles that a stiff servo imposes. I and B are
constant; K switches every 2 to 4 s between two levels; a reflex answers the velocity of 35 to 50 ms
ago, in one direction only, behind a low-pass; the person pushes slowly. White noise of 30 dB.
Asked: I, B, and K at times of the trial's own clock (`K@1.50` at 1.5 s), without the reflex.
"""
    + COLUMNS,
    draw=_draw,
)
