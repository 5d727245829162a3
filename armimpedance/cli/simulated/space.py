"""A hand on a robot of three axes."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Final

from armimpedance.cli.parts.simulation import Rig, Simulated, given


def _add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--sets", type=int, default=2, help="times each direction is taken (2)")
    parser.add_argument(
        "--directions", type=int, help="on a sphere: 6, 8, 12, 14, 18 or 26 (default)"
    )
    parser.add_argument(
        "--elbow", choices=("held", "free"), default="held", help="the upper arm's turning"
    )
    parser.add_argument(
        "--posture", nargs="+", default=["nominal"], metavar="NAME", help="nominal, far, near, …"
    )
    parser.add_argument(
        "--cocontraction", type=float, nargs="+", default=[12.0], metavar="PERCENT", help="(12)"
    )
    parser.add_argument("--force", type=float, nargs=3, metavar="N", help="by the hand (0 -5 3)")
    parser.add_argument("--disturbance", metavar="SHAPE", help="minimum_jerk, designed, plateau, …")
    parser.add_argument("--duration-s", type=float, help="of a disturbance (0.3)")
    parser.add_argument("--amplitude-mm", type=float, help="of a disturbance (10)")
    parser.add_argument("--control", choices=("position", "force"), help="by the robot")


def _simulate(
    name: str, arguments: argparse.Namespace, progress: Callable[[int, int], None]
) -> Simulated:
    del name  # one rig only
    from manipulandum_sim.space import SpaceCondition, simulate_space

    asked = arguments.amplitude_mm
    force = given(force=None if arguments.force is None else tuple(arguments.force))
    recording, truth = simulate_space(
        [
            SpaceCondition(posture, percent / 100, **force)
            for posture in arguments.posture
            for percent in arguments.cocontraction
        ],
        seed=arguments.seed,
        subject=arguments.subject or "A",
        sets=arguments.sets,
        progress=progress,
        elbow=arguments.elbow,
        noise=arguments.noise,
        **given(
            directions=arguments.directions,
            disturbance=arguments.disturbance,
            duration_s=arguments.duration_s,
            amplitude_m=None if asked is None else asked / 1e3,
            control=arguments.control,
        ),
    )
    return Simulated(recording, truth)


RIGS: Final = (
    Rig(
        "space",
        "a hand in space, pushed along directions on a sphere",
        "--elbow free --cocontraction 5 20 --seed 7 --out session",
        _simulate,
        _add_options,
        subjects="A (default) to D",
    ),
)
