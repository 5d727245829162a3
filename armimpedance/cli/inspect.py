"""Say what a recording holds, whether it can be used, and what is missing.

Examples:
  armimpedance inspect session
  armimpedance inspect exam.zip --force-by device

Exit status 0 also where a check warns; 2 where the recording cannot be used.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from armimpedance.cli.estimate import add_force_by, open_checked

if TYPE_CHECKING:
    from armimpedance.records import Recording
    from armimpedance.signals import Check

#: Checks that fail where nothing pushed the joint and let it return.
OF_DISTURBANCE = ("disturbance", "returns to start", "force sign")
#: An axis of a robot that travels further than this moves, rad.
MOVES_RAD = 0.05
MARKS = {"ok": "ok  ", "warning": "WARN", "unusable": "STOP"}


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("recording", metavar="RECORDING", type=Path)
    add_force_by(parser)


def run(arguments: argparse.Namespace) -> int:
    """Print contents, checks and a verdict."""
    from armimpedance.errors import InputError
    from armimpedance.recordings import is_moving, recording_kind
    from armimpedance.report import counted

    if is_moving(arguments.recording):
        from armimpedance.cli.parts.inspect_motion import inspect_moving

        return inspect_moving(arguments.recording, recording_kind(arguments.recording))
    recording = open_checked(arguments.recording, arguments.force_by)
    print(describe(recording, str(arguments.recording)))
    checks = _checks(recording)
    print("\nChecks")
    for check in checks:
        print(f"  {MARKS[check.verdict]}  {check.name}: {check.message}")
    for missing in _missing(recording):
        print(f"  --    not known: {missing}")
    stops = [check for check in checks if check.verdict == "unusable"]
    if stops:
        raise InputError(
            f"cannot be used: {stops[0].name}: {stops[0].message}", file=arguments.recording
        )
    warnings = sum(check.verdict == "warning" for check in checks)
    print("\nUsable" + (f", with {counted(warnings, 'warning')}" if warnings else ""))
    return 0


def _checks(recording: Recording) -> list[Check]:
    """All checks; a joint that nothing disturbed is none the worse for other commands."""
    from armimpedance.impedance import check_delay
    from armimpedance.signals import Check, check_recording

    if moves_a_robot(recording):
        text = "the motors': `therapy robot`, `arm` and `contribution` take such a recording"
        moving = _moving_axes(replace(recording, perturbation="stochastic"))
        return [*check_recording(moving), Check("torque", "ok", text)]
    checks = [*check_recording(recording), *check_delay(recording), *_emg_checks(recording)]
    if recording.kind != "joint" or "onset_s" in recording.trials:
        return checks
    if all(check.verdict == "ok" for check in checks if check.name in OF_DISTURBANCE):
        return checks
    text = "no returning one is seen: `passive` takes such a recording, `estimate` does not"
    others = check_recording(replace(recording, perturbation="stochastic"))
    return [*others, Check("disturbance", "warning", text)]


def _emg_checks(recording: Recording) -> list[Check]:
    """Of the raw EMG beside a random perturbation; without it I, B and K can still be fitted."""
    from armimpedance.signals import check_emg

    if recording.emg is None or recording.perturbation != "stochastic":
        return []
    if recording.emg_unit != "V":
        return []
    return [
        replace(c, name=f"EMG {c.name}", verdict="ok" if c.verdict == "ok" else "warning")
        for c in check_emg(recording)
    ]


def moves_a_robot(recording: Recording) -> bool:
    """Whether it holds the motors' torques of movements, and no disturbance."""
    return recording.torque == "commanded" and recording.perturbation == "returning"


def _moving_axes(recording: Recording) -> Recording:
    """The axes that move: one that is held stays within a step or two of its encoder."""
    import numpy as np

    moves = np.ptp(recording.position, axis=0) > MOVES_RAD
    if not moves.any():
        return recording
    position, force = recording.position[:, moves], recording.force[:, moves]
    return replace(recording, position=position, force=force)


def describe(recording: Recording, title: str) -> str:
    """What is in a recording, as lines of text."""
    from armimpedance.report import counted

    trials = recording.trials
    seconds = len(recording.time_s) / recording.sample_rate_hz
    axes = "1 axis" if recording.axes == 1 else f"{recording.axes} axes"
    what = f"{recording.perturbation} perturbation"
    if moves_a_robot(recording):
        what = "movements of a robot, torques of its motors"
    lines = [
        title,
        f"  {recording.kind}, {axes}, {what}",
        f"  {counted(recording.n_trials, 'trial')}, "
        f"{counted(trials['condition'].nunique(), 'condition')}, "
        f"{seconds:.1f} s at {recording.sample_rate_hz:g} Hz",
        f"  subject {recording.subject.id}; mass between sensor and hand "
        f"{recording.handle_mass_kg:g} kg",
        f"  trial columns: {', '.join(map(str, trials.columns))}",
    ]
    if recording.emg is not None:
        lines.append(f"  EMG ({recording.emg_unit}): {', '.join(recording.muscles)}")
    if recording.joint_angles is not None:
        lines.append(f"  joint angles: {recording.joint_angles.shape[1]}")
    lines += [f"  {step}" for step in recording.provenance]
    lines.append("\nConditions")
    for condition, group in trials.groupby("condition", sort=False):
        lines.append(f"  {condition}: {counted(len(group), 'trial')}{_directions(group)}")
    return "\n".join(lines)


def _directions(group: object) -> str:
    if "direction_deg" not in group:  # type: ignore[operator]
        return ""
    directions = sorted(group["direction_deg"].dropna().unique())  # type: ignore[index]
    shown = ", ".join(f"{d:g}" for d in directions[:12])
    return f", directions {shown}{' …' if len(directions) > 12 else ''} deg"


def _missing(recording: Recording) -> list[str]:
    """What later stages will ask for and this recording does not have."""
    subject, missing = recording.subject, []
    if recording.kind == "hand":
        if recording.shoulder_m is None:
            missing.append("shoulder_m (orientation of ellipses assumes the origin)")
        if recording.handle_mass_kg == 0:
            missing.append("handle_mass_kg (M will include whatever is held)")
        if subject.upper_arm_m is None or subject.forearm_hand_m is None:
            missing.append("subject.upper_arm_m, forearm_hand_m (needed by 'map --to joint')")
    elif moves_a_robot(recording):
        return missing if subject.mass_kg is not None else ["subject.mass_kg (`therapy arm`)"]
    elif recording.perturbation == "stochastic" and recording.torque is None:
        missing.append("torque: interaction or commanded (`elbow` refuses a recording without it)")
    if recording.emg is None:
        missing.append("EMG (needed by activation models and EMG laws only)")
    return missing
