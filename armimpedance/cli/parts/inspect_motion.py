"""What a recording of markers or joint motion holds, as text, and whether it can be used."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from armimpedance.arrays import BoolArray, IntArray
    from armimpedance.motion import MarkerRecording, MotionRecording


def inspect_moving(path: Path, kind: str) -> int:
    """Read, describe and check a recording of kind "markers" or "motion".

    Raises
    ------
    InputError
        It cannot be read, or not be used.
    """
    from armimpedance.cli.parts.checks import naming
    from armimpedance.recordings import read_markers, read_motion

    recording: MarkerRecording | MotionRecording
    if kind == "markers":
        recording = markers = read_markers(path)
        lines = _marker_checks(markers)
        if markers.wrenches is not None:
            lines.append(
                "--    the force plates: `body` checks them once the joints' motion is found"
            )
    else:
        recording = motion = read_motion(path)
        with naming(path):
            lines = _plate_checks(motion)
    print(describe_moving(recording, str(path)))
    print("\nChecks")
    for line in [*lines, *_emg_checks(recording)]:
        print(f"  {line}")
    return 0


def describe_moving(recording: MarkerRecording | MotionRecording, title: str) -> str:
    """What is in a recording, as lines of text."""
    from armimpedance.motion import MarkerRecording
    from armimpedance.report import counted

    trials, seconds = recording.trials, len(recording.time_s) / recording.sample_rate_hz
    subject, skeleton = recording.subject, recording.skeleton
    if isinstance(recording, MarkerRecording):
        what = counted(len(recording.names), "marker")
    else:
        body = recording.skeleton
        what = (
            f"{counted(len(body.coordinates), 'coordinate')} of "
            f"{counted(len(body.segments), 'segment')}"
        )
    plates = 0 if recording.wrenches is None else recording.wrenches.shape[1]
    lines = [
        title,
        f"  {what}, {counted(plates, 'force plate') if plates else 'no force plates'}",
        f"  {counted(recording.n_trials, 'trial')}, "
        f"{counted(trials['condition'].nunique(), 'condition')}, "
        f"{seconds:.1f} s at {recording.sample_rate_hz:g} Hz",
        f"  subject {subject.id}" + (f"; skeleton {skeleton.mass_kg:.1f} kg" if skeleton else ""),
    ]
    if recording.emg is not None:
        emg = recording.emg
        lines.append(f"  EMG ({emg.unit}) at {emg.sample_rate_hz:g} Hz: {', '.join(emg.muscles)}")
    lines += [f"  {step}" for step in recording.provenance]
    lines.append("\nConditions")
    for condition, group in trials.groupby("condition", sort=False):
        lines.append(f"  {condition}: {counted(len(group), 'trial')}")
    return "\n".join(lines)


def _marker_checks(recording: MarkerRecording) -> list[str]:
    """How many samples of each marker are lost, and whether a skeleton knows them."""
    import numpy as np

    lost = np.isnan(recording.positions[..., 0])
    lines = []
    for marker in np.flatnonzero(lost.any(axis=0)):
        longest = _longest_gap(lost[:, marker], recording.offsets) / recording.sample_rate_hz
        share = 100 * lost[:, marker].mean()
        lines.append(
            f"WARN  {recording.names[marker]}: not seen in {share:.1f} % of the frames, "
            f"for {longest:.2f} s at the longest"
        )
    if not lost.any():
        lines.append("ok    all markers are seen in all frames")
    if recording.skeleton is None:
        lines.append("--    not known: the skeleton that the markers sit on (skeleton.json)")
        return lines
    unknown = sorted(set(recording.names) - set(recording.skeleton.marker_names))
    if unknown:
        lines.append(f"WARN  the skeleton has no place for {', '.join(unknown)}")
    return lines


def _longest_gap(lost: BoolArray, offsets: IntArray) -> int:
    """Most lost samples in a row within one trial."""
    import numpy as np

    longest = 0
    for start, end in zip(offsets[:-1], offsets[1:], strict=True):
        edges = np.diff(np.concatenate([[0], lost[start:end].astype(int), [0]]))
        runs = np.flatnonzero(edges == -1) - np.flatnonzero(edges == 1)
        longest = max(longest, int(runs.max(initial=0)))
    return longest


def _plate_checks(recording: MotionRecording) -> list[str]:
    from armimpedance.body import check_body

    if recording.wrenches is None:
        return ["--    not known: contact forces (`body` needs plates, or a robot's torque)"]
    check_body(recording)
    return ["ok    the plates bear the body's weight, and their moments fit its place"]


def _emg_checks(recording: MarkerRecording | MotionRecording) -> list[str]:
    from armimpedance.errors import ArmImpedanceError
    from armimpedance.passive import emg_gate
    from armimpedance.report import emg_text

    if recording.emg is None:
        return ["--    not known: whether the muscles were silent (no EMG)"]
    try:
        return [f"ok    {emg_text(emg_gate(recording.emg, recording.trials))}"]
    except ArmImpedanceError as error:
        return [f"WARN  {error}"]
