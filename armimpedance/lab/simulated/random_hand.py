"""A hand, a wrist or an ankle under random forces or displacements."""

from __future__ import annotations

import argparse
from typing import Any, Final

from armimpedance.core.progress import Progress
from armimpedance.lab.parts.simulation import Simulated, SimulatedRig, given


def _add_session(parser: argparse.ArgumentParser, pushed: str) -> None:
    parser.add_argument(
        "--imposed", choices=("position", pushed), default="position", help="by the robot"
    )
    parser.add_argument("--trials", type=int, default=4, help="(4)")
    parser.add_argument("--duration-s", type=float, default=15.0, help="of each trial (15)")
    parser.add_argument(
        "--reflex",
        type=float,
        metavar="SHARE",
        help="a stretch reflex, delayed by 40 ms, of this share of the muscles' stiffness",
    )


def _add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--axes", type=int, choices=(2, 3), default=2, help="default: 2")
    _add_session(parser, "force")
    parser.add_argument("--amplitude-mm", type=float, help="rms of a displacement (2.5)")
    parser.add_argument("--force-n", type=float, help="rms of a force (4)")
    parser.add_argument(
        "--elbow", choices=("held", "free"), default="held", help="in three axes (held)"
    )
    parser.add_argument(
        "--wrist", choices=("locked", "free"), default="locked", help="in three axes (locked)"
    )


def _add_joint_options(parser: argparse.ArgumentParser) -> None:
    _add_session(parser, "torque")
    parser.add_argument("--amplitude-rad", type=float, help="rms of a rotation (.03, ankle .02)")
    parser.add_argument("--torque-nm", type=float, help="rms of a torque (.3, ankle 1.5)")


def _session(arguments: argparse.Namespace) -> dict[str, Any]:
    from manipulandum_sim.hand import Reflex

    return {
        "seed": arguments.seed,
        "imposed": arguments.imposed,
        "trials": arguments.trials,
        "duration_s": arguments.duration_s,
        "noise": arguments.noise,
        "reflex": None if arguments.reflex is None else Reflex(arguments.reflex, 0.040),
    }


def _simulate(name: str, arguments: argparse.Namespace, progress: Progress) -> Simulated:
    del name, progress  # one rig only, all trials at once
    from manipulandum_sim.random_hand import simulate_random

    asked = arguments.amplitude_mm
    recording, truth = simulate_random(
        subject=arguments.subject or "A",
        axes=arguments.axes,
        elbow=arguments.elbow,
        wrist=arguments.wrist,
        **_session(arguments),
        **given(amplitude_m=None if asked is None else asked / 1e3, force_n=arguments.force_n),
    )
    return Simulated(recording, truth)


def _simulate_joint(name: str, arguments: argparse.Namespace, progress: Progress) -> Simulated:
    del progress
    from manipulandum_sim.random_hand import simulate_random_joint

    recording, truth = simulate_random_joint(
        joint=name,
        amplitude_rad=arguments.amplitude_rad,
        torque_nm=arguments.torque_nm,
        **_session(arguments),
    )
    return Simulated(recording, truth)


RIGS: Final = (
    SimulatedRig(
        "random",
        "a hand under random forces or displacements in two or three axes",
        "--axes 3 --imposed force --seed 7 --out session",
        _simulate,
        _add_options,
        subjects="A (default) to D",
    ),
    SimulatedRig(
        "wrist",
        "a wrist that a robot turns at random in flexion and radial deviation",
        "--imposed torque --seed 7 --out session",
        _simulate_joint,
        _add_joint_options,
    ),
    SimulatedRig(
        "ankle",
        "an ankle that a robot turns at random in dorsiflexion and inversion",
        "--reflex 0.25 --out session",
        _simulate_joint,
        _add_joint_options,
    ),
)
