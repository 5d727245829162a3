"""Read samples of relaxed joints from any suitable recording, check and fit them."""

from __future__ import annotations

import os
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

from armimpedance.core.errors import InputError
from armimpedance.core.findings import Finding
from armimpedance.core.motion import EmgSignals, MarkerRecording, MotionRecording
from armimpedance.core.progress import Progress
from armimpedance.core.records import Recording
from armimpedance.core.skeleton import Skeleton
from armimpedance.joint.body import check_plates
from armimpedance.joint.relaxed.equations import RestAngle
from armimpedance.joint.relaxed.identify import identify_passive
from armimpedance.joint.relaxed.linear import from_joint_recording
from armimpedance.joint.relaxed.passive_fit import PassiveFit, PassiveFits
from armimpedance.joint.relaxed.samples import PassiveSamples, from_motion
from armimpedance.limb.mocap import motion_of
from armimpedance.numerics.criticism import check_joint_size
from armimpedance.numerics.signals import EmgLevel, emg_gate, recorded_emg
from armimpedance.recordings import AnyRecording
from armimpedance.show.verbs.checks import TopicChecks, checked
from armimpedance.show.verbs.results import PathLike, naming, read

if TYPE_CHECKING:
    import pandas as pd

NO_EMG = "no EMG in the recording: whether the muscles were silent is not known"


@dataclass(frozen=True)
class PassiveReading:
    """Settings for reading a recording as samples; see `passive`."""

    joints: Sequence[str] | None
    cutoff_hz: float | None
    emg_gate_percent: float | None
    torque_sign: Literal[1, -1] | None
    longest_gap_s: float | None
    progress: Progress | None


@dataclass(frozen=True)
class PassiveModel:
    """Settings of the fit; see `passive`."""

    rest_angle: RestAngle | Mapping[str, RestAngle]
    method: str | None
    quadratic: bool
    friction: bool
    mass_sd_percent: float | None


def fit_passive(
    recording: AnyRecording | PathLike,
    model: PassiveModel,
    reading: PassiveReading,
    *,
    validate: AnyRecording | PathLike | None = None,
    despite: str | Collection[str] = (),
) -> PassiveFits:
    """Read, check and fit; predict another recording if there is one."""
    source = read(recording)
    with naming(recording):
        samples, emg, notes = _samples(source, reading)
        marks = checked(source, despite, TopicChecks(plates=check_plates))
        mass_sd = _mass_sd(source, model.mass_sd_percent)
        fits = identify_passive(
            samples,
            rest_angle=model.rest_angle,
            method=model.method,
            quadratic=model.quadratic,
            friction=model.friction,
            progress=reading.progress,
        )
    fits = replace(fits, notes=(*marks, *notes), emg=emg)
    muscles = _muscles_finding(emg)
    fits = fits.each(lambda fit: fit.doubted(muscles, _size(fit)))
    if samples.hinges is not None:
        fits = fits.each(lambda fit: fit.with_mass_sd(mass_sd))
    if validate is None:
        return fits
    others, _, _ = _samples(validate, reading)
    named = isinstance(validate, str | os.PathLike)
    with naming(validate):
        return fits.predicting(others, str(validate) if named else "another recording")


def _samples(
    source: AnyRecording | PathLike, reading: PassiveReading
) -> tuple[PassiveSamples, EmgLevel | None, tuple[str, ...]]:
    """Passive samples of any recording, the level of its EMG, and notes."""
    recording = read(source)
    with naming(source):
        if isinstance(recording, Recording):
            return _from_torque(recording, reading)
        return _from_motion(recording, reading)


def _from_torque(
    recording: Recording, reading: PassiveReading
) -> tuple[PassiveSamples, EmgLevel | None, tuple[str, ...]]:
    if recording.kind != "joint":
        raise InputError(
            f"a recording of kind {recording.kind!r}",
            expected="kind 'joint', 'markers' or 'motion'",
        )
    if reading.joints is not None:
        raise InputError(
            "joints chosen in a recording of angle and torque",
            expected="none chosen: all its joints are fitted",
        )
    if reading.longest_gap_s is not None:
        raise InputError("gaps to bridge in angle and torque", expected="a recording of markers")
    level, notes = _gated(recorded_emg(recording), recording.trials, reading)
    samples = from_joint_recording(
        recording, cutoff_hz=reading.cutoff_hz, torque_sign=reading.torque_sign
    )
    return samples, level, notes


def _from_motion(
    recording: MarkerRecording | MotionRecording, reading: PassiveReading
) -> tuple[PassiveSamples, EmgLevel | None, tuple[str, ...]]:
    if reading.torque_sign is not None:
        raise InputError(
            "a sign of the torque with motion capture", expected="a recording of torque"
        )
    motion, notes = motion_of(
        recording, longest_gap_s=reading.longest_gap_s, progress=reading.progress
    )
    level, more = _gated(motion.emg, motion.trials, reading)
    joints = reading.joints or [_elbow(motion.skeleton)]
    samples = from_motion(motion, joints, cutoff_hz=reading.cutoff_hz)
    return samples, level, (*notes, *more)


def _mass_sd(recording: AnyRecording, percent: float | None) -> float | None:
    """Stated sd of the limb's mass as a fraction, or None."""
    if percent is not None:
        if isinstance(recording, Recording):
            raise InputError("a mass with measured torque", expected="markers or joint motion")
        return percent / 100
    subject = recording.subject
    if subject.mass_sd_kg is None or subject.mass_kg is None:
        return None
    return subject.mass_sd_kg / subject.mass_kg


def _muscles_finding(emg: EmgLevel | None) -> Finding:
    """Finding on whether the muscles were silent; missing EMG is also reported in a note."""
    if emg is None:
        return Finding("muscles", "missing", "EMG was not looked at: nothing says they were silent")
    highest = float(emg.highest_percent.max())
    return Finding(
        "muscles",
        "ok",
        f"at most {highest:.1f} % of the maximum over {emg.window_s:g} s",
        f"{emg.limit_percent:g} %",
    )


def _size(fit: PassiveFit) -> Finding:
    k = fit.parameters["k"]
    return check_joint_size("stiffness at rest", k.value, k.sd_robust)


def _gated(
    emg: EmgSignals | None, trials: pd.DataFrame, reading: PassiveReading
) -> tuple[EmgLevel | None, tuple[str, ...]]:
    """Level of the EMG by the gate, and a note on it."""
    if emg is None:
        return None, (NO_EMG,)
    if reading.emg_gate_percent is None:
        return None, ("the EMG was not looked at",)
    level = emg_gate(emg, trials, limit_percent=reading.emg_gate_percent)
    return level, (str(level),)


def _elbow(skeleton: Skeleton) -> str:
    """The skeleton's only elbow, or its only hinge."""
    hinges = [h.name for segment in skeleton.segments for h in segment.hinges]
    elbows = [name for name in hinges if "elbow_flexion" in name]
    only = elbows if len(elbows) == 1 else hinges
    if len(only) == 1:
        return only[0]
    raise InputError("which joint is passive?", expected=f"one or more of {', '.join(hinges)}")
