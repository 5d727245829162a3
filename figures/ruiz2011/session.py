"""The posture test in the powered exoskeleton on simulated subjects, trial by trial."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.core.errors import InputError
from armimpedance.core.records import Recording
from armimpedance.joint.elbow import ElbowFit, JointSamples, from_recording, identify_elbow
from manipulandum_sim.elbow import ElbowTruth, simulate_elbow

#: All of the source's subjects, in the words of a figure's ``subject``.
SUBJECTS: Final = "1,2,3,4"
#: As many as the source's.
REPETITIONS = 5
DURATION_S = 10.0


@dataclass(frozen=True)
class Session:
    """One subject's posture test.

    Attributes
    ----------
    subject : str
    recording : Recording
    truth : ElbowTruth
    fits : tuple of ElbowFit
        One for each repetition, default method.
    """

    subject: str
    recording: Recording
    truth: ElbowTruth
    fits: tuple[ElbowFit, ...]

    def samples(self, row: int) -> JointSamples:
        """One repetition, counted from 0."""
        return from_recording(self.recording.select(np.array([row])))

    def true(self, name: str) -> float:
        """B or K, the same throughout the session."""
        return float(self.truth.trial_means(name).mean())


def study(experiment: str, *, subject: str, seed: int, sets: int) -> tuple[Session, ...]:
    """Sessions of one or several subjects (``"1,2"``); `sets`, of the hand's tests, plays no part.

    Raises
    ------
    InputError
        An unknown experiment or subject.
    """
    del sets
    if experiment != "elbow_posture":
        raise InputError(f"no experiment {experiment!r}", expected="elbow_posture")
    return tuple(study_session(who, seed) for who in subject.split(","))


def study_session(subject: str, seed: int) -> Session:
    """Simulate a session and fit each of its repetitions.

    Raises
    ------
    InputError
        An unknown subject.
    """
    recording, truth = simulate_elbow(
        "posture", subject=subject, seed=seed, repetitions=REPETITIONS, duration_s=DURATION_S
    )
    rows = range(recording.n_trials)
    fits = [identify_elbow(from_recording(recording.select(np.array([r])))) for r in rows]
    return Session(subject, recording, truth, tuple(fits))


def design(*sessions: Session) -> str:
    """The sentence about the data that every caption holds."""
    who = ", ".join(one.subject for one in sessions)
    return (
        f"Simulated subject{'s' if len(sessions) > 1 else ''} {who} in a simulated exoskeleton "
        f"that perturbs the held elbow by random torque behind a low-pass at 10 Hz; {REPETITIONS} "
        f"repetitions of {DURATION_S:g} s at 1 kHz, interaction torque and angle with the noise "
        "and the steps of their sensors, voluntary torque and tremor of the subject"
    )
