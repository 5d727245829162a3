"""The source's whole study on simulated people: a calibrated robot, arms, contributions.

Each part is simulated and analysed when a figure first asks for it, and once for all figures of a
build: the robot from its sweeps and holds, with that robot every person's passive arm, and with
both the contribution of every movement.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np

from armimpedance.core.errors import InputError
from armimpedance.core.records import Recording
from armimpedance.joint.therapy import (
    ArmCalibration,
    ArmSegment,
    AxisValidation,
    Contribution,
    MockupCheck,
    MovementTorques,
    PassiveArm,
    RobotCalibration,
    TherapyRobot,
    check_mockup,
    contribution_of,
    identify_arm,
    identify_robot,
    movement_torques,
    pipes,
    segments_of,
    slides,
    validate_robot,
)
from armimpedance.lab.simulated.therapy import drawings_of
from manipulandum_sim.therapy import (
    THERAPY_SUBJECTS,
    TherapyTruth,
    simulate_calibration,
    simulate_mockup,
    simulate_therapy_many,
    simulate_validation,
    therapy_device,
)

#: All people of the source, in the words of a figure's ``subject``.
SUBJECTS: Final = ",".join(THERAPY_SUBJECTS)
#: Whose session is shown as a therapist sees it.
SHOWN: Final = "P2"
#: Trials with the empty robot that validate it.
VALIDATION_TRIALS = 8
#: Of sweeps that no model was fitted to, deg/s; the source's.
UNFITTED_DEG_S: Final = 15.0
#: People who are simulated side by side; bounds the memory that their exact courses take.
AT_ONCE: Final = 5


@dataclass(frozen=True)
class CalibratedRobot:
    """The empty robot's session, its truth, and what was identified from it."""

    recording: Recording
    truth: TherapyTruth
    found: RobotCalibration


@dataclass(frozen=True)
class MockUp:
    """The mock-up's session: torques of all movements, what it weighs, and the torques' model."""

    torques: tuple[MovementTorques, ...]
    check: MockupCheck


@dataclass(frozen=True)
class Measured:
    """One movement's contribution beside its truth.

    Attributes
    ----------
    found : Contribution
    truth_percent, truth_projection_percent, truth_share_percent : float
        (4), the projection, and the share beside the robot's own inertia torque, of the simulated
        torques in the samples that `found` counts: those in which the axis moves.
    whole_percent : float
        (4) of the simulated torques from onset to end.
    """

    found: Contribution
    truth_percent: float
    truth_projection_percent: float
    truth_share_percent: float
    whole_percent: float


@dataclass(frozen=True)
class Person:
    """One person's session.

    Attributes
    ----------
    name : str
    passive : Recording
        Of the passive movements.
    truth : TherapyTruth
    calibration : ArmCalibration
    measured : tuple of Measured
        Of all movements about axes with a passive model.
    refused : tuple of (str, str)
        Axes without one, and why.
    movements : tuple of MovementTorques
        Kept of `SHOWN` only.
    """

    name: str
    passive: Recording
    truth: TherapyTruth
    calibration: ArmCalibration
    measured: tuple[Measured, ...]
    refused: tuple[tuple[str, str], ...]
    movements: tuple[MovementTorques, ...]

    @property
    def group(self) -> str:
        """ "S" or "P"."""
        return self.name[0]

    def of(self, movement: str, condition: str) -> list[Measured]:
        """The repetitions of one movement in one condition; none where refused."""
        wanted = (movement, condition)
        return [m for m in self.measured if (m.found.movement, m.found.condition) == wanted]


@dataclass(frozen=True)
class TherapyStudy:
    """The study of some people; `seed` gives all of it again."""

    subjects: tuple[str, ...]
    seed: int

    @cached_property
    def robot(self) -> CalibratedRobot:
        """From sweeps and holds."""
        recording, truth = simulate_calibration(seed=self.seed)
        return CalibratedRobot(
            recording, truth, identify_robot(recording, drawings_of(therapy_device()))
        )

    @cached_property
    def unfitted_sweeps(self) -> Recording:
        """Sweeps at a speed that the calibration leaves out, with noise of their own."""
        recording, _ = simulate_calibration(
            seed=self.seed + 1, speeds_deg_s=(UNFITTED_DEG_S,), held_angles=0
        )
        return recording

    @property
    def identified(self) -> TherapyRobot:
        """The robot with its loads."""
        return self.robot.found.robot

    @cached_property
    def validated(self) -> tuple[AxisValidation, ...]:
        """Movements of the robot that was calibrated."""
        recording, _ = simulate_validation(seed=self.seed, trials=VALIDATION_TRIALS)
        return validate_robot(recording, self.identified)

    @cached_property
    def mismatched(self) -> tuple[AxisValidation, ...]:
        """Movements of a robot that has grown apart from its calibration."""
        recording, _ = simulate_validation(
            seed=self.seed, trials=VALIDATION_TRIALS, device=therapy_device().mismatched()
        )
        return validate_robot(recording, self.identified)

    @cached_property
    def mockup(self) -> MockUp:
        """Two pipes in the robot."""
        recording, _ = simulate_mockup(seed=self.seed)
        segments = pipes()
        length = recording.subject.upper_arm_m
        check = check_mockup(recording, self.identified, segments)
        arm = weighed(recording.subject.id, self.identified, length, segments)
        return MockUp(movement_torques(recording, self.identified, arm), check)

    @cached_property
    def people(self) -> tuple[Person, ...]:
        """Everybody's session."""
        people: list[Person] = []
        for first in range(0, len(self.subjects), AT_ONCE):
            some = self.subjects[first : first + AT_ONCE]
            sessions = simulate_therapy_many(some, self.seed)
            people += [_person(*session, self.identified) for session in sessions]
        return tuple(people)

    def person(self, name: str) -> Person:
        """One of them.

        Raises
        ------
        InputError
            Not among the people of this study.
        """
        for person in self.people:
            if person.name == name:
                return person
        raise InputError(f"no subject {name!r} in the study", expected=", ".join(self.subjects))


def weighed(
    name: str, robot: TherapyRobot, length: float | None, segments: tuple[ArmSegment, ...]
) -> PassiveArm:
    """A mock-up's arm."""
    if length is None:
        raise InputError("a mock-up without upper_arm_m", expected="the length of its first pipe")
    return PassiveArm(name, robot.name, length, segments, mass_sd=0.0)


def _person(recording: Recording, truth: TherapyTruth, robot: TherapyRobot) -> Person:
    name = recording.subject.id
    calibration = identify_arm(recording, robot, segments_of(recording.subject))
    movements = movement_torques(recording, robot, calibration.arm)
    measured, refused = [], {}
    for row, movement in enumerate(movements):
        try:
            found = contribution_of(movement, robot, calibration.arm)
        except InputError as error:
            refused[movement.axis_name] = str(error)
            continue
        measured.append(_beside_truth(found, movement, row, truth, robot))
    passive = (recording.trials["condition"] == "passive").to_numpy()
    return Person(
        name=name,
        passive=recording.select(np.flatnonzero(passive)),
        truth=replace(truth, motion=None),
        calibration=calibration,
        measured=tuple(measured),
        refused=tuple(refused.items()),
        movements=movements if name == SHOWN else (),
    )


def _beside_truth(
    found: Contribution,
    movement: MovementTorques,
    row: int,
    truth: TherapyTruth,
    robot: TherapyRobot,
) -> Measured:
    if truth.motion is None or truth.contribution is None:
        raise InputError(f"subject {truth.subject}: no true courses")
    moves = slides(movement.qd, float(robot.identified.rise_rad_s[movement.axis]))
    at = truth.samples_at(row, movement.time_s[moves])
    true = truth.motion.contribution(movement.axis, at, movement.robot_inertia[moves])
    return Measured(
        found,
        truth_percent=true.ratio,
        truth_projection_percent=true.projection,
        truth_share_percent=true.share,
        whole_percent=float(truth.contribution[row]),
    )


def study(experiment: str, *, subject: str, seed: int, sets: int) -> TherapyStudy:
    """The study of the people of ``"S1,S2"``; `sets`, of the hand's tests, plays no part.

    Raises
    ------
    InputError
        An unknown experiment.
    """
    del sets
    if experiment != "therapy":
        raise InputError(f"no experiment {experiment!r}", expected="therapy")
    return TherapyStudy(tuple(subject.split(",")), seed)


def design(studied: TherapyStudy) -> str:
    """The sentence about the robot that every caption holds."""
    return (
        "Simulated: an exoskeleton of five axes with the source's friction and cables (Table 3), "
        "assumed masses, static friction and Stribeck velocity (0.5 deg/s), identified from its "
        f"own sweeps and holds; seed {studied.seed}"
    )
