"""The therapy robot behind `armimpedance simulate`: empty, with a person, with a mock-up."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal

from armimpedance.cli.simulated.elbow import refuse_elbow_options
from armimpedance.errors import InputError

if TYPE_CHECKING:
    from armimpedance.records import Recording
    from armimpedance.therapy import TherapyRobot
    from manipulandum_sim.therapy import Progress, TherapyDevice, TherapyTruth

#: Beside the recording: the robot before it was identified.
DRAWINGS_FILE: Final = "drawings.json"

SESSION: Final = "therapy"
#: Options of other rigs, and what they are when nobody gives them.
_OTHERS_ONLY: Final = {
    "disturbance": "minimum_jerk",
    "amplitude_mm": 5.0,
    "duration_s": None,
    "servo": None,
    "reflex": None,
    "markers": False,
}
#: Options of single tests of this rig.
_OWN: Final = {
    "mismatched": ("therapy-validation",),
    "lowering": (SESSION,),
    "subject": (SESSION,),
    "sets": (SESSION, "therapy-mockup"),
}


def refuse_therapy_options(arguments: argparse.Namespace) -> None:
    """Refuse this rig's options with another one.

    Raises
    ------
    InputError
    """
    for name in ("mismatched", "lowering"):
        if getattr(arguments, name):
            raise InputError(
                f"--{name} with {arguments.experiment}", expected=f"it with {_OWN[name][0]}"
            )


def simulate_therapy_test(arguments: argparse.Namespace, test: str) -> int:
    """Simulate, write recording, drawings and truth, say what is there."""
    from armimpedance.cli.inspect import describe
    from armimpedance.cli.parts.progress import bar

    refuse_elbow_options(arguments)
    for name, default in _OTHERS_ONLY.items():
        if getattr(arguments, name) != default:
            option = f"--{name.replace('_', '-')} with {arguments.experiment}"
            raise InputError(option, expected="an experiment that has it")
    for name, tests in _OWN.items():
        # --sets 0 is given, though 0 equals False
        given = getattr(arguments, name) is not None and getattr(arguments, name) is not False
        if given and test not in tests:
            raise InputError(f"--{name} with {test}", expected=f"it with {' or '.join(tests)}")
    if arguments.noise not in ("nominal", "none"):
        raise InputError(f"--noise {arguments.noise} with {test}", expected="nominal or none")
    with bar("simulating") as progress:
        recording, truth, device = _simulated(arguments, test, progress)
    write_therapy(recording, truth, drawings_of(device), arguments.out, arguments.table)
    print(describe(recording, str(arguments.out)))
    print(f"\nthe robot's drawings: {arguments.out / DRAWINGS_FILE}")
    return 0


def _simulated(
    arguments: argparse.Namespace, test: str, progress: Progress
) -> tuple[Recording, TherapyTruth, TherapyDevice]:
    from manipulandum_sim.therapy import therapy_device

    device = therapy_device()
    common: dict[str, Any] = {
        "seed": arguments.seed,
        "noise": arguments.noise,
        "progress": progress,
    }
    if test == "therapy-calibration":
        from manipulandum_sim.therapy import simulate_calibration

        return *simulate_calibration(**common), device
    if test == "therapy-validation":
        from manipulandum_sim.therapy import simulate_validation

        plant = device.mismatched() if arguments.mismatched else device
        return *simulate_validation(device=plant, **common), device
    if arguments.sets is not None:
        common["repetitions"] = arguments.sets
    if test == "therapy-mockup":
        from manipulandum_sim.therapy import simulate_mockup

        return *simulate_mockup(**common), device
    from manipulandum_sim.therapy import simulate_therapy

    subject = arguments.subject or "S1"
    return *simulate_therapy(subject=subject, lowering=arguments.lowering, **common), device


def drawings_of(device: TherapyDevice) -> TherapyRobot:
    """What is known of a simulated robot before it was identified."""
    from armimpedance.therapy import TherapyRobot

    return TherapyRobot(
        name=device.name,
        axes=device.axes,
        skeleton=device.skeleton,
        limits_rad=device.limits_rad,
        torque_limit_Nm=device.torque_limit_Nm,
        motor_inertia_kgm2=device.motor_inertia_kgm2,
    )


def write_therapy(
    recording: Recording,
    truth: TherapyTruth,
    drawings: TherapyRobot,
    folder: Path,
    table: Literal["parquet", "csv"] = "parquet",
) -> None:
    """Write a recording with the robot's drawings and its truth beside it, all or none."""
    from armimpedance.cli.simulate import TRUTH_FILE
    from armimpedance.files import write_robot
    from armimpedance.outputs import RECORDING_FILES, staged_folder
    from armimpedance.recordings import write_folder

    folder.parent.mkdir(parents=True, exist_ok=True)
    with staged_folder(folder, known=(*RECORDING_FILES, TRUTH_FILE, DRAWINGS_FILE)) as staged:
        write_folder(recording, staged, table=table)
        write_robot(drawings, staged / DRAWINGS_FILE)
        truth.write(staged / TRUTH_FILE)
