"""The experiments of Tsuji (1997): a robot pushes the hand."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Final

from armimpedance.core.errors import InputError
from armimpedance.core.progress import Progress
from armimpedance.lab.parts.simulation import Simulated, SimulatedRig

if TYPE_CHECKING:
    from manipulandum_sim.hand import Servo


def _add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--sets", type=int, default=5, help="sets of 8 disturbances (5)")
    parser.add_argument("--disturbance", default="minimum_jerk", metavar="SHAPE")
    parser.add_argument("--duration-s", type=float, default=0.3, help="of a disturbance (0.3)")
    parser.add_argument("--amplitude-mm", type=float, default=5.0, help="of a disturbance (5)")
    parser.add_argument(
        "--servo",
        metavar="STIFFNESS",
        help="of the robot's servo in N/m, or 'ideal' (default: a servo of 20000 N/m)",
    )
    parser.add_argument(
        "--reflex",
        type=float,
        metavar="SHARE",
        help="a stretch reflex, delayed by 55 ms, of this share of the stiffness",
    )


def _simulate(name: str, arguments: argparse.Namespace, progress: Progress) -> Simulated:
    from manipulandum_sim.hand import Reflex, simulate

    recording, truth = simulate(
        name,
        subject=arguments.subject or "A",
        seed=arguments.seed,
        sets=arguments.sets,
        progress=progress,
        disturbance=arguments.disturbance,
        duration_s=arguments.duration_s,
        amplitude_m=arguments.amplitude_mm / 1e3,
        noise=arguments.noise,
        servo=_servo(arguments.servo),
        reflex=None if arguments.reflex is None else Reflex(arguments.reflex),
    )
    return Simulated(recording, truth)


def _servo(asked: str | None) -> Servo:
    from manipulandum_sim.hand import IDEAL, Servo

    if asked is None:
        return Servo()
    if asked == "ideal":
        return IDEAL
    try:
        return Servo(float(asked))
    except ValueError as error:
        raise InputError(f"--servo {asked}", expected="N/m, or ideal") from error


def _rig(name: str, line: str) -> SimulatedRig:
    options = "--subject B --noise sensor --seed 7 --out session"
    return SimulatedRig(name, line, options, _simulate, _add_options, subjects="A (default) to D")


RIGS: Final = (
    _rig("postures", "Tsuji (1997): a relaxed arm at 20 hand locations (subject A) or 11"),
    _rig("cocontraction", "Tsuji (1997): co-contraction of 0 to 30 percent MVC"),
    _rig("force", "Tsuji (1997): the hand bears 0.5 to 3 x 9.8 N"),
)
