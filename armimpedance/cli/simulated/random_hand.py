"""A hand under random forces or displacements."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Final

from armimpedance.cli.parts.simulation import Rig, Simulated, given


def _add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--axes", type=int, choices=(2, 3), default=2, help="default: 2")
    parser.add_argument(
        "--imposed", choices=("position", "force"), default="position", help="by the robot"
    )
    parser.add_argument("--trials", type=int, default=4, help="(4)")
    parser.add_argument("--duration-s", type=float, default=15.0, help="of each trial (15)")
    parser.add_argument("--amplitude-mm", type=float, help="rms of a displacement (2.5)")
    parser.add_argument("--force-n", type=float, help="rms of a force (4)")
    parser.add_argument(
        "--elbow", choices=("held", "free"), default="held", help="in three axes (held)"
    )
    parser.add_argument(
        "--reflex",
        type=float,
        metavar="SHARE",
        help="a stretch reflex, delayed by 40 ms, of this share of the stiffness",
    )


def _simulate(
    name: str, arguments: argparse.Namespace, progress: Callable[[int, int], None]
) -> Simulated:
    del name, progress  # one rig only, all trials at once
    from manipulandum_sim.hand import Reflex
    from manipulandum_sim.random_hand import simulate_random

    asked = arguments.amplitude_mm
    recording, truth = simulate_random(
        seed=arguments.seed,
        subject=arguments.subject or "A",
        axes=arguments.axes,
        imposed=arguments.imposed,
        trials=arguments.trials,
        duration_s=arguments.duration_s,
        elbow=arguments.elbow,
        noise=arguments.noise,
        reflex=None if arguments.reflex is None else Reflex(arguments.reflex, 0.040),
        **given(amplitude_m=None if asked is None else asked / 1e3, force_n=arguments.force_n),
    )
    return Simulated(recording, truth)


RIGS: Final = (
    Rig(
        "random",
        "a hand under random forces or displacements in two or three axes",
        "--axes 3 --imposed force --seed 7 --out session",
        _simulate,
        _add_options,
        subjects="A (default) to D",
    ),
)
