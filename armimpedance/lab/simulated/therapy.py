"""A robot for arm therapy of five axes, after Guidali (2013): empty, with a person, with pipes."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any, Final

from armimpedance.core.progress import Progress
from armimpedance.lab.parts.simulation import DRAWINGS_FILE, Simulated, SimulatedRig, given

if TYPE_CHECKING:
    from armimpedance.core.records import Recording
    from armimpedance.joint.therapy import TherapyRobot
    from manipulandum_sim.therapy import TherapyDevice, TherapyTruth


def _add_sets(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--sets", type=int, help="how often each movement is repeated (3)")


def _add_session(parser: argparse.ArgumentParser) -> None:
    _add_sets(parser)
    help_text = "the arm is let down again, recorded too"
    parser.add_argument("--lowering", action="store_true", help=help_text)


def _add_validation(parser: argparse.ArgumentParser) -> None:
    help_text = "heavier, with more friction and stiffer cables than calibrated"
    parser.add_argument("--mismatched", action="store_true", help=help_text)


def _simulate(name: str, arguments: argparse.Namespace, progress: Progress) -> Simulated:
    from armimpedance.joint.therapy.show import write_robot
    from manipulandum_sim.therapy import therapy_device

    device = therapy_device()
    common = {"seed": arguments.seed, "noise": arguments.noise, "progress": progress}
    recording, truth = _SIMULATORS[name](arguments, device, common)
    drawings = drawings_of(device)
    return Simulated(recording, truth, {DRAWINGS_FILE: lambda path: write_robot(drawings, path)})


def _session(
    arguments: argparse.Namespace, _device: TherapyDevice, common: dict[str, Any]
) -> tuple[Recording, TherapyTruth]:
    from manipulandum_sim.therapy import simulate_therapy

    common |= given(repetitions=arguments.sets)
    subject = arguments.subject or "S1"
    return simulate_therapy(subject=subject, lowering=arguments.lowering, **common)


def _calibration(
    _arguments: argparse.Namespace, _device: TherapyDevice, common: dict[str, Any]
) -> tuple[Recording, TherapyTruth]:
    from manipulandum_sim.therapy import simulate_calibration

    return simulate_calibration(**common)


def _validation(
    arguments: argparse.Namespace, device: TherapyDevice, common: dict[str, Any]
) -> tuple[Recording, TherapyTruth]:
    from manipulandum_sim.therapy import simulate_validation

    plant = device.mismatched() if arguments.mismatched else device
    return simulate_validation(device=plant, **common)


def _mockup(
    arguments: argparse.Namespace, _device: TherapyDevice, common: dict[str, Any]
) -> tuple[Recording, TherapyTruth]:
    from manipulandum_sim.therapy import simulate_mockup

    return simulate_mockup(**common, **given(repetitions=arguments.sets))


_SIMULATORS: Final = {
    "therapy": _session,
    "therapy-calibration": _calibration,
    "therapy-validation": _validation,
    "therapy-mockup": _mockup,
}


def drawings_of(device: TherapyDevice) -> TherapyRobot:
    """Design data of a simulated robot, before it is identified."""
    from armimpedance.joint.therapy import TherapyRobot

    return TherapyRobot(
        name=device.name,
        axes=device.axes,
        skeleton=device.skeleton,
        limits_rad=device.limits_rad,
        torque_limit_Nm=device.torque_limit_Nm,
        motor_inertia_kgm2=device.motor_inertia_kgm2,
    )


def _rig(
    name: str, line: str, options: str, add_options: Any = None, subjects: str = ""
) -> SimulatedRig:
    noise = ("nominal", "none")
    return SimulatedRig(name, line, options, _simulate, add_options, subjects=subjects, noise=noise)


RIGS: Final = (
    _rig(
        "therapy",
        "a person in a therapy robot, after Guidali (2013): passive to resistive movements",
        "--subject P2 --out patient",
        _add_session,
        subjects="S1 (default) to S12; P1 to P7 with neurological problems",
    ),
    _rig("therapy-calibration", "sweeps and holds of the empty robot", "--out calibration"),
    _rig("therapy-validation", "movements of the empty robot", "--out moving", _add_validation),
    _rig("therapy-mockup", "two pipes in place of an arm", "--out pipes", _add_sets),
)
