"""Stiffness, viscosity and friction of relaxed joints, from any recording that shows them."""

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
from armimpedance.show.verbs.checks import TopicChecks, checked
from armimpedance.show.verbs.results import PathLike, naming, read

if TYPE_CHECKING:
    import pandas as pd

NO_EMG = "no EMG in the recording: whether the muscles were silent is not known"


@dataclass(frozen=True)
class _Options:
    """How a recording becomes samples; see `passive`."""

    joints: Sequence[str] | None
    cutoff_hz: float | None
    emg_gate_percent: float | None
    torque_sign: Literal[1, -1] | None
    longest_gap_s: float | None
    progress: Progress | None


def passive(
    recording: Recording | MarkerRecording | MotionRecording | PathLike,
    *,
    rest_angle: RestAngle | Mapping[str, RestAngle] = "free",
    method: str | None = None,
    quadratic: bool = False,
    friction: bool = True,
    mass_sd_percent: float | None = None,
    joints: Sequence[str] | None = None,
    cutoff_hz: float | None = 8.0,
    emg_gate_percent: float | None = 3.0,
    torque_sign: Literal[1, -1] | None = None,
    longest_gap_s: float | None = None,
    validate: Recording | MarkerRecording | MotionRecording | PathLike | None = None,
    despite: str | Collection[str] = (),
    progress: Progress | None = None,
) -> PassiveFits:
    """Fit ``k (q - q_r) + h qd + f sign(qd) [+ K (q - q_r)^2]`` to the passive torque of joints.

    The torque is measured, or it is minus that of inertia and gravity of a skeleton that moves as
    its markers or its joints did (Venture, in-vivo elbow).

    Parameters
    ----------
    recording : Recording, MarkerRecording, MotionRecording or path
        Angle and torque of joints (kind ``joint``), or markers or joint motion with a skeleton that
        has masses.
    rest_angle : float, "free", or a mapping of joints to either
        Where the elastic torque vanishes, rad. ``"free"``: it is fitted, which may widen the
        interval of k several times; a joint that a mapping does not name is free.
    method : {"output-error", "parallel", "ls"}, optional
        A fit to the measured swing itself (the default), every term through the filter, or the
        source's with its unfiltered sign.
    quadratic : bool
        Whether ``K (q - q_r)^2`` is fitted too.
    friction : bool
        Whether ``f sign(qd)`` is fitted; False where the joint is known to have no dry friction.
    mass_sd_percent : float, optional
        Standard error of the limb's mass, %, which moves k, h and f in proportion: 0 where it was
        weighed. By default that of the recording's subject (``mass_sd_kg``), else what tables of
        masses differ by. Not with measured torque.
    joints : sequence of str, optional
        Angles of the skeleton; by default its only elbow. Of a recording of angle and torque all
        joints are fitted.
    cutoff_hz : float or None
        Cut-off of the zero-phase low-pass, Hz; None: no filter. A joint that swings at 5 Hz needs
        15.
    emg_gate_percent : float or None
        A muscle above this part of its maximum, %, is not relaxed; None: the EMG is not looked at.
    torque_sign : {1, -1}, optional
        Only with angle and torque: 1 where the passive torque is recorded, -1 where it is the
        torque of the limb on the device. Without it the sign is turned where no passive joint
        could have it.
    longest_gap_s : float, optional
        Only with markers: longest loss of a marker to bridge, s (default: 0.2).
    validate : Recording, MarkerRecording, MotionRecording or path, optional
        Another recording of the same joints, whose torque is predicted.
    despite : str or collection of str
        Names of checks of `inspect` whose STOP is overruled; the notes say so.
    progress : function, optional
        Called with how much is done, of how much: frames of markers, then joints.

    Returns
    -------
    PassiveFits
        One fit a joint, with notes and the level of the EMG.

    Raises
    ------
    InputError
        The recording cannot be read or used, a muscle was active, or an option has no effect on it.
    NotIdentifiableError
        The motion cannot show a parameter; it is named.
    EstimationError
        The search does not settle, or the skeleton cannot follow the markers.

    Examples
    --------
    >>> from armimpedance.joint.relaxed.show import passive
    >>> from manipulandum_sim.passive import simulate_passive
    >>> markers, truth = simulate_passive("release", trials=2, duration_s=4.0)
    >>> elbow = passive(markers, rest_angle=1.5, mass_sd_percent=3)["right_elbow_flexion"]
    >>> elbow.parameters["k"].unit
    'N m/rad'
    >>> list(elbow.to_frame().index)
    ['k', 'h', 'f']
    """
    options = _Options(joints, cutoff_hz, emg_gate_percent, torque_sign, longest_gap_s, progress)
    given = read(recording)
    with naming(recording):
        samples, emg, notes = _samples(given, options)
        marks = checked(given, despite, TopicChecks(plates=check_plates))
        told = _mass_sd(given, mass_sd_percent)
        fits = identify_passive(
            samples,
            rest_angle=rest_angle,
            method=method,
            quadratic=quadratic,
            friction=friction,
            progress=progress,
        )
    fits = replace(fits, notes=(*marks, *notes), emg=emg)
    muscles = _muscles_finding(emg)
    fits = fits.each(lambda fit: fit.doubted(muscles, _size(fit)))
    if samples.hinges is not None:
        fits = fits.each(lambda fit: fit.with_mass_sd(told))
    if validate is None:
        return fits
    others, _, _ = _samples(validate, options)
    named = isinstance(validate, str | os.PathLike)
    with naming(validate):
        return fits.predicting(others, str(validate) if named else "another recording")


def _samples(
    source: Recording | MarkerRecording | MotionRecording | PathLike, options: _Options
) -> tuple[PassiveSamples, EmgLevel | None, tuple[str, ...]]:
    """Passive samples of any recording, what its EMG says, and notes."""
    recording = read(source)
    with naming(source):
        if isinstance(recording, Recording):
            return _from_torque(recording, options)
        return _from_motion(recording, options)


def _from_torque(
    recording: Recording, options: _Options
) -> tuple[PassiveSamples, EmgLevel | None, tuple[str, ...]]:
    if recording.kind != "joint":
        raise InputError(
            f"a recording of kind {recording.kind!r}",
            expected="kind 'joint', 'markers' or 'motion'",
        )
    if options.joints is not None:
        raise InputError(
            "joints chosen in a recording of angle and torque",
            expected="none chosen: all its joints are fitted",
        )
    if options.longest_gap_s is not None:
        raise InputError("gaps to bridge in angle and torque", expected="a recording of markers")
    level, notes = _gated(recorded_emg(recording), recording.trials, options)
    samples = from_joint_recording(
        recording, cutoff_hz=options.cutoff_hz, torque_sign=options.torque_sign
    )
    return samples, level, notes


def _from_motion(
    recording: MarkerRecording | MotionRecording, options: _Options
) -> tuple[PassiveSamples, EmgLevel | None, tuple[str, ...]]:
    if options.torque_sign is not None:
        raise InputError(
            "a sign of the torque with motion capture", expected="a recording of torque"
        )
    motion, notes = motion_of(
        recording, longest_gap_s=options.longest_gap_s, progress=options.progress
    )
    level, more = _gated(motion.emg, motion.trials, options)
    joints = options.joints or [_elbow(motion.skeleton)]
    samples = from_motion(motion, joints, cutoff_hz=options.cutoff_hz)
    return samples, level, (*notes, *more)


def _mass_sd(
    recording: Recording | MarkerRecording | MotionRecording, percent: float | None
) -> float | None:
    """Sd of the limb's mass as a fraction, as somebody told it, or None."""
    if percent is not None:
        if isinstance(recording, Recording):
            raise InputError("a mass with measured torque", expected="markers or joint motion")
        return percent / 100
    who = recording.subject
    if who.mass_sd_kg is None or who.mass_kg is None:
        return None
    return who.mass_sd_kg / who.mass_kg


def _muscles_finding(emg: EmgLevel | None) -> Finding:
    """Whether the muscles were silent; that there is no EMG stands among the notes."""
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
    emg: EmgSignals | None, trials: pd.DataFrame, options: _Options
) -> tuple[EmgLevel | None, tuple[str, ...]]:
    """What the gate says of the EMG, and a note on it."""
    if emg is None:
        return None, (NO_EMG,)
    if options.emg_gate_percent is None:
        return None, ("the EMG was not looked at",)
    level = emg_gate(emg, trials, limit_percent=options.emg_gate_percent)
    return level, (str(level),)


def _elbow(skeleton: Skeleton) -> str:
    """The skeleton's only elbow, or its only hinge."""
    hinges = [h.name for segment in skeleton.segments for h in segment.hinges]
    elbows = [name for name in hinges if "elbow_flexion" in name]
    only = elbows if len(elbows) == 1 else hinges
    if len(only) == 1:
        return only[0]
    raise InputError("which joint is passive?", expected=f"one or more of {', '.join(hinges)}")
