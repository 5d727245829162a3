"""A relaxed arm under motion capture, after Venture."""

from __future__ import annotations

import argparse
from typing import Any, Final

from armimpedance.core.progress import Progress
from armimpedance.lab.parts.simulation import MARKER_NOISE_M, Simulated, SimulatedRig


def _simulate(name: Any, arguments: argparse.Namespace, progress: Progress) -> Simulated:
    from manipulandum_sim.passive import simulate_passive

    recording, truth = simulate_passive(
        name,
        subject=arguments.subject or "1",
        seed=arguments.seed,
        marker_noise_m=MARKER_NOISE_M[arguments.noise],
        progress=progress,
    )
    return Simulated(recording, truth)


def _rig(name: str, line: str) -> SimulatedRig:
    options = "--subject 2 --out relaxed"
    return SimulatedRig(name, line, options, _simulate, subjects="1 (default) or 2")


RIGS: Final = (
    _rig("p5", "a relaxed arm, filmed at 30 frames/s, swings while the trunk is shaken"),
    _rig("release", "a relaxed forearm, filmed at 30 frames/s, is lifted and let go"),
)
