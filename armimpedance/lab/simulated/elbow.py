"""The elbow in a powered exoskeleton, after Ruiz (2011), with raw EMG."""

from __future__ import annotations

import argparse
from typing import Any, Final

from armimpedance.core.progress import Progress
from armimpedance.lab.parts.simulation import Simulated, SimulatedRig, given


def _add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--sets", type=int, default=5, help="repetitions (5)")
    parser.add_argument("--duration-s", type=float, help="of a trial (10)")
    parser.add_argument(
        "--commanded", action="store_true", help="hold the motor's torque, of arm and device"
    )
    parser.add_argument("--perturbation", choices=("white", "prbs"), help="white, below 10 Hz")
    parser.add_argument("--law", choices=("linear", "saturating"), help="of stiffness over EMG")


def _add_varying(parser: argparse.ArgumentParser) -> None:
    _add_options(parser)
    parser.add_argument("--frequency-hz", type=float, metavar="HZ", help="of the stiffness (0.7)")


def _simulate(name: str, arguments: argparse.Namespace, progress: Progress) -> Simulated:
    from manipulandum_sim.elbow import simulate_elbow

    test: Any = name.removeprefix("elbow-") if name != "elbow" else "posture"
    recording, truth = simulate_elbow(
        test,
        subject=arguments.subject or "1",
        seed=arguments.seed,
        repetitions=arguments.sets,
        noise=arguments.noise,
        torque="commanded" if arguments.commanded else "interaction",
        progress=progress,
        **given(
            frequency_hz=getattr(arguments, "frequency_hz", None),
            law=arguments.law,
            perturbation=arguments.perturbation,
            duration_s=arguments.duration_s,
        ),
    )
    return Simulated(recording, truth)


def _rig(name: str, line: str, add_options: Any = _add_options) -> SimulatedRig:
    options = "--subject 3 --duration-s 5 --out session"
    return SimulatedRig(name, line, options, _simulate, add_options, subjects="1 (default) to 4")


RIGS: Final = (
    _rig("elbow", "the elbow in an exoskeleton, after Ruiz (2011): a posture, random torque"),
    _rig("elbow-cocontraction", "the same at levels of activity of both muscles"),
    _rig("elbow-varying", "the same while the stiffness goes up and down", _add_varying),
    _rig("elbow-calibration", "isometric torques, for the index of co-contraction"),
    _rig("elbow-spring", "a rhythmic movement against a rendered spring"),
    _rig("elbow-damper", "a rhythmic movement against a rendered damper"),
    _rig("elbow-inertia", "a rhythmic movement against a rendered inertia"),
)
