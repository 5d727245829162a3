"""Rigs of moving bodies behind `armimpedance simulate`: a relaxed arm, a body on force plates."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal

if TYPE_CHECKING:
    from armimpedance.motion import MarkerRecording, MotionRecording
    from manipulandum_sim.body import BodyTruth
    from manipulandum_sim.passive import PassiveTruth

PASSIVE: Final = ("p5", "release")
BODY: Final = "body"
#: Noise name -> marker noise (m); angles (rad), forces (N), moments (Nm).
_MARKERS_M: Final = {"nominal": 0.5e-3, "sensor": 0.5e-3, "none": 0.0}
_BODY: Final = {"nominal": (0.001, 1.0, 0.5), "sensor": (0.001, 1.0, 0.5), "none": (0.0, 0.0, 0.0)}
#: Options of the hand's experiments and what they are when nobody gives them.
_HAND_ONLY: Final = {
    "disturbance": "minimum_jerk",
    "duration_s": None,
    "amplitude_mm": 5.0,
    "servo": None,
    "reflex": None,
    "sets": None,
}


def simulate_rig(arguments: argparse.Namespace) -> int:
    """Simulate, write recording and truth, say what is there."""
    from armimpedance.cli.parts.inspect_motion import describe_moving
    from armimpedance.errors import InputError

    for name, default in _HAND_ONLY.items():
        if getattr(arguments, name) != default:
            raise InputError(
                f"--{name.replace('_', '-')} with {arguments.experiment}",
                expected="an experiment that pushes the hand",
            )
    if arguments.noise not in _MARKERS_M:
        raise InputError(f"--noise {arguments.noise}", expected=" or ".join(_MARKERS_M))
    recording, truth = _simulated(arguments)
    write_moving(recording, truth, arguments.out, arguments.table)
    print(describe_moving(recording, str(arguments.out)))
    return 0


def _simulated(
    arguments: argparse.Namespace,
) -> tuple[MarkerRecording | MotionRecording, PassiveTruth | BodyTruth]:
    if arguments.experiment == BODY:
        from manipulandum_sim.body import simulate_body
        from manipulandum_sim.studio import Studio

        angle, force, moment = _BODY[arguments.noise]
        return simulate_body(
            subject=arguments.subject or "A",
            seed=arguments.seed,
            angle_noise_rad=angle,
            force_noise_N=force,
            moment_noise_Nm=moment,
            markers=Studio(_MARKERS_M[arguments.noise]) if arguments.markers else False,
        )
    from armimpedance.cli.parts.progress import bar
    from manipulandum_sim.passive import simulate_passive

    with bar("simulating") as progress:
        return simulate_passive(
            arguments.experiment,
            subject=arguments.subject or "1",
            seed=arguments.seed,
            marker_noise_m=_MARKERS_M[arguments.noise],
            progress=progress,
        )


def write_moving(
    recording: MarkerRecording | MotionRecording,
    truth: PassiveTruth | BodyTruth,
    folder: Path,
    table: Literal["parquet", "csv"] = "parquet",
) -> None:
    """Write a recording of markers or motion with its truth beside it, both or neither."""
    from armimpedance.cli.simulate import TRUTH_FILE
    from armimpedance.motion import MarkerRecording
    from armimpedance.outputs import RECORDING_FILES, staged_folder
    from armimpedance.recordings import EMG_FILES, SKELETON_FILE, write_markers, write_motion

    folder.parent.mkdir(parents=True, exist_ok=True)
    known = (*RECORDING_FILES, *EMG_FILES, SKELETON_FILE, TRUTH_FILE)
    with staged_folder(folder, known=known) as staged:
        if isinstance(recording, MarkerRecording):
            write_markers(recording, staged, table)
        else:
            write_motion(recording, staged, table)
        truth.write(staged / TRUTH_FILE)
