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

#: Text of an error: what `recording.json` must state, and why.
TORQUE_FIELD: Final = (
    '"interaction" (measured between limb and device) or "commanded" (the motor\'s: arm and device)'
)

#: What a rig imposes on a joint: angle, torque, or (with a finite impedance) neither, "both".
Imposed = Literal["position", "torque", "both"]

#: Stand-in length of an upper arm that is not stated, m: the forearm does not depend on it.
_ANY_UPPER_ARM_M: Final = 0.3

_IMPOSED_ON_JOINT: Final = f"of a joint one of {', '.join(get_args(Imposed))}"

#: Warning for samples whose torque is the commanded one.
COMMANDED: Final = "the torque is the motor's command: I, B, K are those of arm and device"


@dataclass(frozen=True, eq=False)
class JointSamples(FrozenRecord):
    """Torque and angle of one joint for ``tau = I theta'' + B theta' + K theta`` (3).

    The angle is about an operating point. Samples of T trials, one trial after another.

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
        N m, the torque that the device was commanded to add. It depends neither on the motion nor
        on the subject's voluntary torque, so it can serve as an instrument.
    command : (N,) or None
        rad, the angle that the device was commanded to take: an instrument as well.
    imposed : {"position", "torque", "both"} or None
        Quantity that the device imposed whatever the limb did. "both": a device of finite
        impedance, whose angle and torque depend on the limb. None: not stated; it is determined
        from the record.
    joint : int
        Axis of the recording, counted from 1.
    notes : tuple of str
    expected_inertia : float or None
        kg m^2, of the limb beyond the joint, from the subject's size; None if the joint or the
        subject's size is not known.
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

    A `Recording` has the torque of the limb on the device; the samples have that on the limb.

    Parameters
    ----------
    recording : Recording
    joint : int
        Axis of the recording, counted from 1.
    imposed : {"position", "torque", "both"}, optional
        What the rig imposed; it overrides the recording.

    Returns
    -------
    JointSamples

    Raises
    ------
    InputError
        Another kind of recording, no such joint, angles that cannot be radians, a recording that
        does not state whether its torque is the interaction torque or the commanded one, or a value
        of `imposed` that is not among the three.
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
    stated, notes = _imposed(recording, imposed)
    if recording.perturbation != "stochastic":
        notes = (
            *notes,
            "taken as a random perturbation, though recording.json does not say stochastic",
        )
    instruments = {}
    for columns in (perturbation_columns(recording.axes), command_columns("joint", recording.axes)):
        column = columns[joint - 1]
        signal = recording.extra.get(column)
        if signal is not None and not _varies(signal, recording.offsets):
            signal, notes = None, (*notes, f"{column} does not vary in every trial: not used")
        instruments[column] = signal
    perturbation, command = instruments.values()
    return JointSamples(
        sample_rate_hz=recording.sample_rate_hz,
        trials=tuple(str(t) for t in recording.trials["trial"]),
        offsets=recording.offsets,
        torque=-recording.force[:, joint - 1],
        angle=recording.position[:, joint - 1],
        torque_is=recording.torque,
        perturbation=perturbation,
        command=command,
        imposed=stated,
        joint=joint,
        notes=notes,
        expected_inertia=_expected_inertia(recording),
    )


#: Shortest piece of a trial, s, and largest number of pieces, for the comparison over time.
PIECE_S: Final = 10.0
MOST_PIECES: Final = 6


def pieces_of(samples: JointSamples) -> dict[str, JointSamples]:
    """Pieces of long trials, labelled by their start; too short trials are not divided.

    Parameters
    ----------
    samples : JointSamples

    Returns
    -------
    dict from a label, such as ``20 s`` or ``trial 2 at 0 s``, to JointSamples
        Each value holds one piece of one trial.
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
    """Inertia of forearm and hand about the elbow, after D. A. Winter's table (see
    `limb.arm.anthropometry`).

    None unless the body's mass is known and the joint is an elbow: the table of trials has its
    angle, or the length of forearm and hand is stated.
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


def _imposed(recording: Recording, option: str | None) -> tuple[Imposed | None, tuple[str, ...]]:
    """Return what was imposed, from the option or the file, and a note where the two differ."""
    stated = recording.imposed if option is None else option
    if stated not in (None, *get_args(Imposed)):
        raise InputError(f"imposed {stated!r}", expected=_IMPOSED_ON_JOINT)
    notes: tuple[str, ...] = ()
    if option is not None and recording.imposed not in (None, option):
        notes = (f"{option} taken as imposed, as asked; recording.json says {recording.imposed}",)
    return cast(Imposed | None, stated), notes


def _varies(signal: FloatArray, offsets: IntArray) -> bool:
    """Return True if the signal varies in every trial."""
    ends = zip(offsets[:-1], offsets[1:], strict=True)
    return all(bool(np.ptp(signal[first:last]) > 0) for first, last in ends)
