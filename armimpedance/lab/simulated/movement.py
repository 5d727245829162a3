"""Reaches that a robot pushes."""

from __future__ import annotations

import argparse
from typing import Final

from armimpedance.core.progress import Progress
from armimpedance.lab.parts.simulation import Simulated, SimulatedRig


def _add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--repeats", type=int, default=5, help="of each phase and direction (5)")
    parser.add_argument("--unperturbed", type=int, default=40, help="free reaches (40)")
    parser.add_argument(
        "--device", default="free", metavar="NAME", help="free, channel, curl or divergent"
    )
    parser.add_argument(
        "--push",
        default="doublet",
        metavar="NAME",
        help="doublet, pulse, servo, soft-servo, random or random-servo (throughout)",
    )
    parser.add_argument(
        "--reflex",
        type=float,
        metavar="SHARE",
        help="a stretch reflex, delayed by 55 ms, of this share of the stiffness",
    )


def _simulate(name: str, arguments: argparse.Namespace, progress: Progress) -> Simulated:
    del name  # one rig only
    from manipulandum_sim.hand import Reflex
    from manipulandum_sim.movement import simulate_movement

    recording, truth = simulate_movement(
        subject=arguments.subject or "A",
        seed=arguments.seed,
        repeats=arguments.repeats,
        unperturbed=arguments.unperturbed,
        progress=progress,
        device=arguments.device,
        push=arguments.push,
        noise=arguments.noise,
        reflex=None if arguments.reflex is None else Reflex(arguments.reflex),
    )
    return Simulated(recording, truth)


RIGS: Final = (
    SimulatedRig(
        "reaches",
        "a hand that reaches, some of its reaches pushed at three phases",
        "--push servo --device curl --seed 7 --out session",
        _simulate,
        _add_options,
        subjects="A (default) to D",
    ),
)
