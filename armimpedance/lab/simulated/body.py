"""A moving body on two force plates, after Venture."""

from __future__ import annotations

import argparse
from typing import Final

from armimpedance.core.progress import Progress
from armimpedance.lab.parts.simulation import MARKER_NOISE_M, Simulated, SimulatedRig

#: Level of noise -> noise of angles (rad), forces (N) and moments (N m).
_NOISE: Final = {"nominal": (0.001, 1.0, 0.5), "sensor": (0.001, 1.0, 0.5), "none": (0.0, 0.0, 0.0)}


def _add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--markers", action="store_true", help="35 markers, not joint angles")


def _simulate(_name: str, arguments: argparse.Namespace, _progress: Progress) -> Simulated:
    from manipulandum_sim.body import simulate_body
    from manipulandum_sim.studio import Studio

    angle, force, moment = _NOISE[arguments.noise]
    recording, truth = simulate_body(
        subject=arguments.subject or "A",
        seed=arguments.seed,
        angle_noise_rad=angle,
        force_noise_N=force,
        moment_noise_Nm=moment,
        markers=Studio(MARKER_NOISE_M[arguments.noise]) if arguments.markers else False,
    )
    return Simulated(recording, truth)


RIGS: Final = (
    SimulatedRig(
        "body",
        "twelve motions of a body on two force plates, joint angles and contact forces",
        "--markers --out filmed",
        _simulate,
        _add_options,
        subjects="A (default) or B",
    ),
)
