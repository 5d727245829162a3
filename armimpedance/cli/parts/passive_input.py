"""What `armimpedance passive` reads: any of three kinds of recording -> passive samples."""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from armimpedance.cli.parts.checks import naming, number
from armimpedance.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

    from armimpedance.motion import EmgSignals, MotionRecording
    from armimpedance.passive import EmgLevel, PassiveSamples
    from armimpedance.skeleton import Skeleton

NO_EMG = "no EMG in the recording: whether the muscles were silent is not known"


@dataclass(frozen=True)
class PassiveInput:
    """Samples, what the EMG said, and what a reader must know."""

    samples: PassiveSamples
    emg: EmgLevel | None
    notes: tuple[str, ...]


def read_passive(path: Path, arguments: argparse.Namespace) -> PassiveInput:
    """Read a recording of kind "joint", "markers" or "motion", and pass its EMG through the gate.

    Raises
    ------
    InputError
        It cannot be read or used; which file, row, column, trial.
    """
    from armimpedance.recordings import is_moving

    _refuse_file(path)
    if is_moving(path):
        return _from_motion(path, arguments)
    return _from_torque(path, arguments)


def _from_torque(path: Path, arguments: argparse.Namespace) -> PassiveInput:
    from armimpedance.passive import from_joint_recording, recorded_emg
    from armimpedance.recordings import read_folder

    if arguments.joint:
        raise InputError(
            "--joint with a recording of angle and torque",
            expected="no --joint: all its joints are fitted",
        )
    cutoff, limit = _cutoff(arguments), _limit(arguments)
    recording = read_folder(path)
    if recording.kind != "joint":
        raise InputError(
            f"a recording of kind {recording.kind!r}",
            file=path,
            expected="kind 'joint', 'markers' or 'motion'",
        )
    with naming(path):
        level, notes = _gate(recorded_emg(recording), recording.trials, limit)
        samples = from_joint_recording(
            recording, cutoff_hz=cutoff, torque_sign=arguments.torque_sign
        )
    return PassiveInput(samples, level, notes)


def _from_motion(path: Path, arguments: argparse.Namespace) -> PassiveInput:
    from armimpedance.passive import from_motion

    if arguments.torque_sign is not None:
        raise InputError("--torque-sign with motion capture", expected="a recording of torque")
    cutoff, limit = _cutoff(arguments), _limit(arguments)
    motion, notes = read_joint_motion(path, arguments.longest_gap_s)
    with naming(path):
        level, more = _gate(motion.emg, motion.trials, limit)
        joints = arguments.joint or [_elbow(motion.skeleton)]
        samples = from_motion(motion, joints, cutoff_hz=cutoff)
    return PassiveInput(samples, level, (*notes, *more))


def read_joint_motion(
    path: Path, longest_gap_s: float = 0.2, *, forces: bool = False
) -> tuple[MotionRecording, tuple[str, ...]]:
    """Joint motion of a folder, from its markers where it holds those.

    Parameters
    ----------
    path : Path
    longest_gap_s : float
        Of lost markers to bridge.
    forces : bool
        Refuse a recording without force plates before its markers are followed.

    Raises
    ------
    InputError
        It cannot be read, or the markers do not determine the motion.
    """
    from armimpedance.cli.parts.progress import bar
    from armimpedance.mocap import joint_motion
    from armimpedance.motion import MotionRecording
    from armimpedance.recordings import open_motion_capture, recording_kind

    if not longest_gap_s > 0:
        raise InputError(f"--longest-gap-s {longest_gap_s:g}", expected="more than 0 s")
    _refuse_file(path)
    if (kind := recording_kind(path)) not in ("markers", "motion"):
        raise InputError(
            f"a recording of kind {kind!r}", file=path, expected="kind 'markers' or 'motion'"
        )
    recording = open_motion_capture(path)
    if isinstance(recording, MotionRecording):
        return recording, ()
    if forces and recording.wrenches is None:
        raise InputError(
            "markers without force plates", file=path, expected="the forces of all contacts"
        )
    with naming(path), bar("joint angles from markers") as progress:
        found = joint_motion(recording, longest_gap_s=longest_gap_s, progress=progress)
    worst = int(found.residual_rms_m.argmax())
    note = (
        f"skeleton follows {len(found.names)} markers; {found.names[worst]} worst, "
        f"{1e3 * found.residual_rms_m[worst]:.1f} mm rms"
    )
    return found.motion, (note, *found.warnings)


def _refuse_file(path: Path) -> None:
    if path.is_file():
        raise InputError(
            "is a file", file=path, expected="a recording's folder; `armimpedance convert` makes it"
        )


def _gate(
    emg: EmgSignals | None, trials: pd.DataFrame, limit: float | None
) -> tuple[EmgLevel | None, tuple[str, ...]]:
    from armimpedance.passive import emg_gate
    from armimpedance.report import emg_text

    if emg is None:
        return None, (NO_EMG,)
    if limit is None:
        return None, ("the EMG was not looked at (--emg-gate off)",)
    level = emg_gate(emg, trials, limit_percent=limit)
    return level, (emg_text(level),)


def _limit(arguments: argparse.Namespace) -> float | None:
    """Of the EMG gate in % of the maximum; None where the EMG is not looked at."""
    from armimpedance.passive import DEFAULT_LIMIT_PERCENT

    if arguments.emg_gate is None:
        return DEFAULT_LIMIT_PERCENT
    if arguments.emg_gate == "off":
        return None
    return number(arguments.emg_gate, "--emg-gate", "% of the maximum, or off")


def _cutoff(arguments: argparse.Namespace) -> float | None:
    from armimpedance.passive import DEFAULT_CUTOFF_HZ

    if arguments.cutoff_hz is None:
        return DEFAULT_CUTOFF_HZ
    if arguments.cutoff_hz == "none":
        return None
    return number(arguments.cutoff_hz, "--cutoff-hz", "more than 0 Hz, or none")


def _elbow(skeleton: Skeleton) -> str:
    hinges = [h.name for segment in skeleton.segments for h in segment.hinges]
    elbows = [name for name in hinges if "elbow_flexion" in name]
    if len(elbows) == 1:
        return elbows[0]
    if len(hinges) == 1:
        return hinges[0]
    raise InputError("which joint is passive?", expected=f"--joint with one of {', '.join(hinges)}")
