"""The contents of a recording of any kind, as lines of text."""

from __future__ import annotations

from typing import Any

from armimpedance.core.findings import told_not_taken
from armimpedance.core.motion import MarkerRecording, MotionRecording
from armimpedance.core.records import Recording
from armimpedance.recordings import AnyRecording
from armimpedance.show.text.numbers import counted


def describe(recording: AnyRecording, title: str) -> str:
    """The contents of a recording, as lines of text.

    Parameters
    ----------
    recording : Recording, MarkerRecording or MotionRecording
    title : str
        The first line, such as the recording's path.

    Returns
    -------
    str
    """
    trials = recording.trials
    own = _of_limb(recording) if isinstance(recording, Recording) else _of_body(recording)
    seconds = len(recording.time_s) / recording.sample_rate_hz
    lines = [
        title,
        f"  {own[0]}",
        f"  {counted(recording.n_trials, 'trial')}, "
        f"{counted(trials['condition'].nunique(), 'condition')}, "
        f"{seconds:.1f} s at {recording.sample_rate_hz:g} Hz",
        f"  subject {recording.subject.id}{own[1]}",
        *(f"  {line}" for line in own[2:]),
        *(f"  {step}" for step in recording.provenance if not told_not_taken([step])),
        *_not_taken(recording),
        "\nConditions",
    ]
    for condition, group in trials.groupby("condition", sort=False):
        lines.append(f"  {condition}: {counted(len(group), 'trial')}{_directions(group)}")
    return "\n".join(lines)


def _not_taken(recording: AnyRecording) -> list[str]:
    """List the parts of the file that were not read."""
    sentences = told_not_taken(recording.provenance)
    return ["\nNot taken", *(f"  {sentence}" for sentence in sentences)] if sentences else []


def _of_limb(recording: Recording) -> list[str]:
    """The measured quantity, the text behind the subject's name, and further lines."""
    axes = "1 axis" if recording.axes == 1 else f"{recording.axes} axes"
    what = f"{recording.perturbation} perturbation"
    if moves_a_robot(recording):
        what = "movements of a robot, torques of its motors"
    mass = f"; mass between sensor and hand {recording.handle_mass_kg:g} kg"
    lines = [
        f"{recording.kind}, {axes}, {what}",
        mass if recording.kind == "hand" or recording.handle_mass_kg else "",
        f"trial columns: {', '.join(map(str, recording.trials.columns))}",
    ]
    if recording.emg is not None:
        lines.append(f"EMG ({recording.emg_unit}): {', '.join(recording.muscles)}")
    if recording.joint_angles is not None:
        lines.append(f"joint angles: {recording.joint_angles.shape[1]}")
    return lines


def _of_body(recording: MarkerRecording | MotionRecording) -> list[str]:
    """The same of a moving body."""
    skeleton = recording.skeleton
    if isinstance(recording, MarkerRecording):
        what = counted(len(recording.names), "marker")
    else:
        body = recording.skeleton
        coordinates = counted(len(body.coordinates), "coordinate")
        what = f"{coordinates} of {counted(len(body.segments), 'segment')}"
    plates = 0 if recording.wrenches is None else recording.wrenches.shape[1]
    lines = [
        f"{what}, {counted(plates, 'force plate') if plates else 'no force plates'}",
        f"; skeleton {skeleton.mass_kg:.1f} kg" if skeleton else "",
    ]
    if recording.emg is not None:
        emg = recording.emg
        lines.append(f"EMG ({emg.unit}) at {emg.sample_rate_hz:g} Hz: {', '.join(emg.muscles)}")
    return lines


def moves_a_robot(recording: Recording) -> bool:
    """Return True if a recording holds movements with motor torques, and no disturbance.

    Parameters
    ----------
    recording : Recording

    Returns
    -------
    bool
    """
    return recording.torque == "commanded" and recording.perturbation == "returning"


def _directions(group: Any) -> str:
    if "direction_deg" not in group:
        return ""
    if "elevation_deg" in group:
        count = len(group[["direction_deg", "elevation_deg"]].dropna().drop_duplicates())
        return f", {count} directions in space"
    directions = sorted(group["direction_deg"].dropna().unique())
    shown = ", ".join(f"{d:g}" for d in directions[:12])
    return f", directions {shown}{' …' if len(directions) > 12 else ''} deg"
