"""One joint's torque and angle under a random perturbation, with the signs settled."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Final, Literal, cast, get_args

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord, IntArray
from armimpedance.core.conventions import command_columns, perturbation_columns
from armimpedance.core.errors import InputError, RecordError, check_number
from armimpedance.core.records import Recording
from armimpedance.limb.arm import arm_of
from armimpedance.numerics.signals import refuse_degrees

#: What must be in `recording.json`, and why.
TORQUE_FIELD: Final = (
    '"interaction" (measured between limb and device) or "commanded" (the motor\'s: arm and device)'
)

#: What a rig imposes on one joint: its angle, its torque, or, of finite impedance, neither.
Imposed = Literal["position", "torque", "both"]

#: Of an arm whose forearm alone is asked for, m.
_ANY_UPPER_ARM_M: Final = 0.3

_IMPOSED_ON_JOINT: Final = f"of a joint one of {', '.join(get_args(Imposed))}"

#: What is told of samples whose torque is the commanded one.
COMMANDED: Final = "the torque is the motor's command: I, B, K are those of arm and device"


@dataclass(frozen=True, eq=False)
class JointSamples(FrozenRecord):
    """What is fitted: ``tau = I theta'' + B theta' + K theta`` about an operating point (3).

    Samples of T trials, one trial after another.

    Attributes
    ----------
    sample_rate_hz : float
    trials : (T,) tuple of str
    offsets : (T + 1,) int
        Trial t is ``offsets[t]:offsets[t + 1]``.
    torque : (N,)
        N m, **on the limb**: positive accelerates the joint in its positive direction.
    angle : (N,)
        rad, as measured.
    torque_is : {"interaction", "commanded"}
        Measured between limb and device, or the motor's command, which moves both.
    perturbation : (N,) or None
        N m, what the device was told to add: no motion and no voluntary torque of the subject is
        in it, so it can serve as an instrument.
    command : (N,) or None
        rad, the angle that the device was told to take: an instrument as well.
    imposed : {"position", "torque", "both"} or None
        What the device imposed whatever the limb did; "both": a device of finite impedance, whose
        angle and torque answer the limb. None: not told, the record is asked.
    joint : int
        Axis of the recording, counted from 1.
    notes : tuple of str
    expected_inertia : float or None
        kg m^2, of the limb beyond the joint by the subject's size; None: it is not known which
        joint this is, or of whom.
    """

    sample_rate_hz: float
    trials: Annotated[tuple[str, ...], "t"]
    offsets: Annotated[IntArray, "t+1"]
    torque: Annotated[FloatArray, "n"]
    angle: Annotated[FloatArray, "n"]
    torque_is: Literal["interaction", "commanded"] = "interaction"
    perturbation: Annotated[FloatArray, "n"] | None = None
    command: Annotated[FloatArray, "n"] | None = None
    imposed: Imposed | None = None
    joint: int = 1
    notes: tuple[str, ...] = ()
    expected_inertia: float | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        rate = f"sample rate {self.sample_rate_hz} Hz"
        check_number(self.sample_rate_hz, rate, above=0, error=RecordError)
        if self.offsets[0] != 0 or (np.diff(self.offsets) <= 0).any():
            raise RecordError("a trial has no samples", expected="rising offsets from 0")
        if self.offsets[-1] != len(self.torque):
            raise RecordError(
                f"torque has shape {self.torque.shape}", expected=f"{self.offsets[-1]} samples"
            )
        if self.imposed not in (None, *get_args(Imposed)):
            raise RecordError(f"imposed {self.imposed!r}", expected=_IMPOSED_ON_JOINT)

    @property
    def n_trials(self) -> int:
        """Number of trials T."""
        return len(self.trials)

    def samples_of(self, row: int) -> slice:
        """The samples of trial `row`, counted from 0."""
        return slice(int(self.offsets[row]), int(self.offsets[row + 1]))


def from_recording(
    recording: Recording, joint: int = 1, imposed: str | None = None
) -> JointSamples:
    """Take one joint's samples from a recording of kind "joint".

    A `Recording` holds the torque by the limb on the device; here it is the one on the limb.

    Parameters
    ----------
    recording : Recording
    joint : int
        Axis of the recording, counted from 1.
    imposed : {"position", "torque", "both"}, optional
        What the rig imposed; it stands above what the recording says.

    Returns
    -------
    JointSamples

    Raises
    ------
    InputError
        Another kind of recording, no such joint, angles that cannot be radians, a recording that
        does not say whether it holds the interaction torque or the commanded one, or something
        imposed that no rig imposes on a joint.
    """
    if recording.kind != "joint":
        raise InputError(f"a recording of kind {recording.kind!r}", expected="kind 'joint'")
    if recording.torque is None:
        raise InputError(
            "it does not say which torque it holds", column="torque", expected=TORQUE_FIELD
        )
    if not 1 <= joint <= recording.axes:
        raise InputError(f"no joint {joint}", expected=f"1 to {recording.axes}")
    refuse_degrees(recording.position[:, [joint - 1]], (f"q{joint}",))
    told, notes = _imposed(recording, imposed)
    if recording.perturbation != "stochastic":
        notes = (
            *notes,
            "taken as a random perturbation, though recording.json does not say stochastic",
        )
    told_to = {}
    for columns in (perturbation_columns(recording.axes), command_columns("joint", recording.axes)):
        column = columns[joint - 1]
        signal = recording.extra.get(column)
        if signal is not None and not _varies(signal, recording.offsets):
            signal, notes = None, (*notes, f"{column} does not vary in every trial: not used")
        told_to[column] = signal
    perturbation, command = told_to.values()
    return JointSamples(
        sample_rate_hz=recording.sample_rate_hz,
        trials=tuple(str(t) for t in recording.trials["trial"]),
        offsets=recording.offsets,
        torque=-recording.force[:, joint - 1],
        angle=recording.position[:, joint - 1],
        torque_is=recording.torque,
        perturbation=perturbation,
        command=command,
        imposed=told,
        joint=joint,
        notes=notes,
        expected_inertia=_expected_inertia(recording),
    )


#: Pieces of a trial that are held against each other: none shorter (s), and at most so many.
PIECE_S: Final = 10.0
MOST_PIECES: Final = 6


def pieces_of(samples: JointSamples) -> dict[str, JointSamples]:
    """Pieces of long trials, by where each begins; none of trials too short for two of them.

    Parameters
    ----------
    samples : JointSamples

    Returns
    -------
    dict from a label, such as ``20 s`` or ``trial 2 at 0 s``, to JointSamples
        Of one trial each.
    """
    pieces = {}
    for row, trial in enumerate(samples.trials):
        at = samples.samples_of(row)
        seconds = (at.stop - at.start) / samples.sample_rate_hz
        count = min(MOST_PIECES, int(seconds / PIECE_S))
        edges = np.linspace(at.start, at.stop, max(count, 1) + 1).astype(np.int64)
        for first, last in zip(edges[:-1], edges[1:], strict=True):
            begins = f"{(first - at.start) / samples.sample_rate_hz:.0f} s"
            name = begins if samples.n_trials == 1 else f"trial {trial} at {begins}"
            if count > 1:
                pieces[name] = _cut(samples, trial, slice(int(first), int(last)))
    return pieces


def _cut(samples: JointSamples, trial: str, at: slice) -> JointSamples:
    return replace(
        samples,
        trials=(trial,),
        offsets=np.array([0, at.stop - at.start]),
        torque=samples.torque[at],
        angle=samples.angle[at],
        perturbation=None if samples.perturbation is None else samples.perturbation[at],
        command=None if samples.command is None else samples.command[at],
    )


def _expected_inertia(recording: Recording) -> float | None:
    """Of forearm and hand about the elbow, after D. A. Winter's table (see
    `limb.arm.anthropometry`).

    The joint is an elbow where its angle stands in the table of trials, or the length of forearm
    and hand was told; the body's mass has to be known as well.
    """
    subject = recording.subject
    elbow = subject.forearm_hand_m is not None or "q_elbow_rad" in recording.trials
    if recording.axes != 1 or recording.torque != "interaction" or not elbow:
        return None
    try:
        arm = arm_of(replace(subject, upper_arm_m=subject.upper_arm_m or _ANY_UPPER_ARM_M))
    except InputError:
        return None
    # about the elbow: I + m c^2
    about_centre = arm.forearm_hand_inertia_kgm2
    return float(about_centre + arm.forearm_hand_kg * arm.forearm_hand_com_m**2)


def _imposed(recording: Recording, asked: str | None) -> tuple[Imposed | None, tuple[str, ...]]:
    """What was imposed, by the option or the file, and a note where the two differ."""
    told = recording.imposed if asked is None else asked
    if told not in (None, *get_args(Imposed)):
        raise InputError(f"imposed {told!r}", expected=_IMPOSED_ON_JOINT)
    notes: tuple[str, ...] = ()
    if asked is not None and recording.imposed not in (None, asked):
        notes = (f"{asked} taken as imposed, as asked; recording.json says {recording.imposed}",)
    return cast(Imposed | None, told), notes


def _varies(signal: FloatArray, offsets: IntArray) -> bool:
    """Whether it varies in every trial."""
    ends = zip(offsets[:-1], offsets[1:], strict=True)
    return all(bool(np.ptp(signal[first:last]) > 0) for first, last in ends)
