"""One joint whose stiffness and viscosity go up and down under a random torque."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from armimpedance.lab.benchmark import AskedGroup
from armimpedance.lab.benchmark_command.task import COLUMNS, UNITS, DrawnJoint, Made, Task, scalar

_DURATION_S: Final = 20.0
_TIMES_S: Final = np.arange(1.0, 19.5, 1.0)


def _draw(seed: int) -> Made:
    rng = np.random.default_rng(seed)
    joint = DrawnJoint.of(rng)
    hz, phase, depth = rng.uniform(0.1, 0.6), rng.uniform(0, 2 * np.pi), rng.uniform(0.2, 0.5)

    def swing(time_s: np.ndarray, share: float) -> np.ndarray:
        return np.asarray(1 + share * np.sin(2 * np.pi * hz * time_s + phase))

    def stiffness(time_s: np.ndarray) -> np.ndarray:
        return joint.K * swing(time_s, depth)

    def viscosity(time_s: np.ndarray) -> np.ndarray:
        return joint.B * swing(time_s, depth / 2)

    def recordings() -> dict[str, Any]:
        from manipulandum_sim.elbow import simulate_bench

        made, _ = simulate_bench(
            joint.I, viscosity, stiffness, snr_db=25.0, duration_s=_DURATION_S, seed=seed
        )
        return {"recording": made}

    B = AskedGroup.course("B", UNITS["B"], _TIMES_S, viscosity(_TIMES_S))
    K = AskedGroup.course("K", UNITS["K"], _TIMES_S, stiffness(_TIMES_S))
    return Made((scalar("I", joint.I), B, K), recordings)


TASK: Final = Task(
    line="One joint under a random torque whose stiffness and viscosity go up and down.",
    asks="""
In a record lies `recording`: 20 s at 1 kHz of a random torque below 10 Hz on a joint; K and B go up
and down at .1 to .6 Hz, I is constant; white noise of 25 dB. Asked: I, and B and K at times of the
trial's own clock (`K@2.00` at 2 s).
"""
    + COLUMNS,
    draw=_draw,
)
