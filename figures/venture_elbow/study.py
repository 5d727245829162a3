"""The examination of a relaxed elbow on simulated subjects, from markers to k, h and f."""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from armimpedance.core.errors import InputError
from armimpedance.core.motion import EmgSignals, MarkerRecording
from armimpedance.joint.relaxed import (
    METHODS,
    PassiveFit,
    PassiveSamples,
    from_motion,
    identify_passive,
)
from armimpedance.limb.mocap import joint_motion
from armimpedance.numerics.signals import EmgLevel, emg_gate
from manipulandum_sim.passive import PassiveTruth, simulate_passive_many

ELBOW: Final = "right_elbow_flexion"
#: Both of the source's subjects, in the words of a figure's ``subject``.
SUBJECTS: Final = "1,2"
#: The estimators side by side, the source's own first.
METHODS_SHOWN: Final = ("ls", *(name for name in METHODS if name != "ls"))
RATE_HZ: Final = 30.0
#: Frames of a P5 recording, as many samples as the source's tables count.
P5_FRAMES = {"1": 700, "2": 450}
#: Releases of one recording, and frames of each.
RELEASES = 4
RELEASE_FRAMES = 275
PRINTED_NAMES: Final = MappingProxyType({"p5": "P5", "release": "release"})


@dataclass(frozen=True)
class StudiedTest:
    """One test of one subject, recorded twice.

    Attributes
    ----------
    test : {"p5", "release"}
    subject : str
    markers : MarkerRecording
        Of the recording that the fits are made of.
    emg : EmgSignals
        Beside it.
    level : EmgLevel
        What the gate said of that EMG.
    truth : PassiveTruth
    samples, again : PassiveSamples
        Of that recording, and of another one of the same test.
    fits : mapping str -> PassiveFit
        By method.
    """

    test: str
    subject: str
    markers: MarkerRecording
    emg: EmgSignals
    level: EmgLevel
    truth: PassiveTruth
    samples: PassiveSamples
    again: PassiveSamples
    fits: dict[str, PassiveFit]

    def true(self, name: str) -> float:
        """The simulated elbow's k, h, f or q_r."""
        return float(getattr(self.truth, name)[self.truth.joints.index(ELBOW)])

    @property
    def title(self) -> str:
        """``P5, subject 1``."""
        return f"{PRINTED_NAMES[self.test]}, subject {self.subject}"


def study(experiment: str, *, subject: str, seed: int, sets: int) -> tuple[StudiedTest, ...]:
    """One test of one or several subjects (``"1,2"``); `sets`, of the hand's tests, plays no part.

    Raises
    ------
    InputError
        An unknown test or subject.
    """
    del sets
    return tuple(study_test(experiment, who, seed) for who in subject.split(","))


def study_test(test: str, subject: str, seed: int) -> StudiedTest:
    """Simulate two recordings of a test; fit the first by every method.

    Raises
    ------
    InputError
        An unknown test or subject.
    """
    if test not in PRINTED_NAMES:
        raise InputError(f"no passive test {test!r}", expected=" or ".join(PRINTED_NAMES))
    frames = P5_FRAMES.get(subject, P5_FRAMES["1"]) if test == "p5" else RELEASE_FRAMES
    (markers, truth), (other, _) = simulate_passive_many(
        test,  # type: ignore[arg-type]
        [seed, seed + 1],
        subject=subject,
        trials=1 if test == "p5" else RELEASES,
        duration_s=frames / RATE_HZ,
        rate_hz=RATE_HZ,
    )
    samples, again = (from_motion(joint_motion(m).motion, [ELBOW]) for m in (markers, other))
    rest = float(truth.q_r[truth.joints.index(ELBOW)])
    fits = {
        method: identify_passive(samples, rest_angle=rest, method=method, cross_validate=False)[0]
        for method in METHODS_SHOWN
    }
    if markers.emg is None:
        raise InputError(f"no EMG in test {test} of subject {subject}")
    level = emg_gate(markers.emg, markers.trials)
    return StudiedTest(test, subject, markers, markers.emg, level, truth, samples, again, fits)


def design(*studied: StudiedTest) -> str:
    """The sentence about the data that every caption holds."""
    who = " and ".join(dict.fromkeys(s.subject for s in studied))
    cutoff = studied[0].samples.cutoff_hz
    return (
        f"Simulated subject{'s' if 'and' in who else ''} {who}: a relaxed arm hanging on a trunk, "
        f"filmed at {RATE_HZ:g} frames/s by 8 markers with 0.5 mm of noise, joint angles by least "
        f"squares on the skeleton, zero-phase low-pass {cutoff:g} Hz, segments' inertia and rest "
        f"angle (1.5 rad) taken as known"
    )
