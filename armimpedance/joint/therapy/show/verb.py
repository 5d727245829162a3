"""The patient's contribution in robot-assisted therapy, in three steps (Guidali 2013).

The empty robot is calibrated once, a person's relaxed arm in it once per session. With both, the
person's contribution to every movement can be computed.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from armimpedance.core.progress import Progress
from armimpedance.core.records import Recording
from armimpedance.core.workers import single_threaded
from armimpedance.joint.therapy.arm.calibrate import identify_arm
from armimpedance.joint.therapy.arm.mockup import MockupCheck, check_mockup as check_pipes, pipes
from armimpedance.joint.therapy.arm.movements import movement_torques
from armimpedance.joint.therapy.arm.passive_arm import PassiveArm, segments_of
from armimpedance.joint.therapy.arm.verdict import ArmCalibration
from armimpedance.joint.therapy.robot.calibrate import RobotCalibration, identify_robot
from armimpedance.joint.therapy.robot.checks import check_recording, validate_robot
from armimpedance.joint.therapy.robot.therapy_robot import TherapyRobot
from armimpedance.joint.therapy.share.of_movement import contribution_of
from armimpedance.joint.therapy.show.contributions import Contributions, stepper
from armimpedance.joint.therapy.show.models_json import (
    Arm,
    Robot,
    arm_of,
    axes_without_model,
    identified_robot,
    notes_on_person,
    refuse_other_robot,
    robot_of,
)
from armimpedance.joint.therapy.show.options import CONTRIBUTION
from armimpedance.show.text import moves_a_robot
from armimpedance.show.verbs.checks import checked
from armimpedance.show.verbs.results import PathLike, naming, of_condition, read_recording


@single_threaded
def calibrate_robot(
    recording: Recording | PathLike,
    drawings: TherapyRobot | PathLike,
    *,
    validate: Recording | PathLike | None = None,
    despite: str | Collection[str] = (),
    progress: Progress | None = None,
) -> RobotCalibration:
    """Identify friction, cables and counterbalance spring of the empty robot.

    Parameters
    ----------
    recording : Recording or path
        Trials of the conditions "sweep" and "hold", of kind "joint" with the motors' torques.
    drawings : TherapyRobot or path
        Robot before the identification: its links, rotors and limits.
    validate : Recording or path, optional
        Other movements of the empty robot, to compare their torques with predictions.
    despite : str or collection of str
        Names of checks of `inspect` whose STOP is overruled; the result says so.
    progress : function (done, all), optional
        Called after each trial.

    Returns
    -------
    RobotCalibration
        The robot with its loads; `joint.therapy.show.write_robot` writes it.

    Raises
    ------
    InputError
        The recording is not of this robot, or the robot was not empty; an axis has no sweeps;
        sweeps or holds are in one direction only, or at too few speeds above the static range.
    NotIdentifiableError
        The sweeps of an axis do not separate its terms.

    Examples
    --------
    A simulated session takes too long for an example (docs/how_to/therapy_robot.md has one):

    >>> from armimpedance.joint.therapy.show import calibrate_robot
    >>> robot = calibrate_robot("calibration", "drawings.json", validate="moving")  # doctest: +SKIP
    >>> robot.to_frame()  # doctest: +SKIP

    A missing file is named in the message:

    >>> calibrate_robot("calibration", "nowhere.json")
    Traceback (most recent call last):
    armimpedance.core.errors.InputError: nowhere.json: cannot be read: No such file or directory
    """
    robot = robot_of(drawings)
    sweeps = read_recording(recording)
    other_movements = None if validate is None else read_recording(validate)
    step = stepper(
        progress, sweeps.n_trials + (0 if other_movements is None else other_movements.n_trials)
    )
    with naming(recording):
        marks = _marks(sweeps, despite)
        calibration = identify_robot(sweeps, robot, step=step)
    calibration = replace(calibration, notes=(*marks, *calibration.notes))
    if other_movements is None:
        return calibration
    with naming(validate):
        validation = validate_robot(other_movements, calibration.robot, step=step)
    return replace(calibration, validation=validation)


@single_threaded
def calibrate_arm(
    recording: Recording | PathLike,
    robot: Robot,
    *,
    mass_kg: float | None = None,
    upper_arm_m: float | None = None,
    forearm_m: float | None = None,
    hand_m: float | None = None,
    point_masses: bool = False,
    mass_sd: float = PassiveArm.mass_sd,
    condition: str = "passive",
    emg_gate_percent: float | None = 3.0,
    despite: str | Collection[str] = (),
    progress: Progress | None = None,
) -> ArmCalibration:
    """Identify the load of a person's relaxed arm in the robot: weight, inertia, stiffness.

    Parameters
    ----------
    recording : Recording or path
        Three or more passive repetitions of every movement; other conditions are not used.
    robot : TherapyRobot, RobotCalibration or path
        Identified robot.
    mass_kg : float, optional
        Mass of the whole body, kg; by default from the recording's subject.
    upper_arm_m, forearm_m, hand_m : float, optional
        Shoulder to elbow, elbow to wrist, wrist to finger tip, m; by default from the subject.
    point_masses : bool
        True for segments without an inertia about their own center, as in the source.
    mass_sd : float
        Standard deviation of a person's masses about the table, as a fraction.
    condition : str
        Condition of the passive trials.
    emg_gate_percent : float or None
        Limit of the EMG in % of its maximum, above which there is no calibration; None: no limit.
    despite : str or collection of str
        Names of checks of `inspect` whose STOP is overruled; the result says so.
    progress : function (done, all), optional
        Called after each trial.

    Returns
    -------
    ArmCalibration
        The arm with its uncertainty; `joint.therapy.show.write_arm` writes it.

    Raises
    ------
    InputError
        No passive trials, or fewer than three repetitions of a movement; a mass or length is not
        known; a muscle was active; the robot's loads are not known, or the recording is of another
        robot.

    Examples
    --------
    A simulated session takes too long for an example (docs/how_to/contribution.md has one):

    >>> from armimpedance.joint.therapy.show import calibrate_arm
    >>> arm = calibrate_arm("session", "robot.json", mass_kg=72.0)  # doctest: +SKIP
    >>> arm.to_frame()  # doctest: +SKIP

    A missing file is named in the message:

    >>> calibrate_arm("session", "nowhere.json")
    Traceback (most recent call last):
    armimpedance.core.errors.InputError: nowhere.json: cannot be read: No such file or directory
    """
    identified = identified_robot(robot)
    session = read_recording(recording)
    with naming(recording):
        segments = segments_of(
            session.subject,
            mass_kg=mass_kg,
            upper_arm_m=upper_arm_m,
            forearm_m=forearm_m,
            hand_m=hand_m,
            point_masses=point_masses,
        )
        marks = _marks(session, despite)
        calibration = identify_arm(
            session,
            identified,
            segments,
            upper_arm_m=upper_arm_m,
            mass_sd=mass_sd,
            condition=condition,
            emg_gate_percent=emg_gate_percent,
            step=stepper(progress, _trials_of(session, condition)),
        )
    summary = replace(calibration.summary, warnings=(*marks, *calibration.summary.warnings))
    return replace(calibration, summary=summary)


@CONTRIBUTION.function
def contribution(
    recording: Recording | PathLike,
    *,
    robot: Robot,
    arm: Arm,
    condition: str | None = None,
    unrepeatable: bool = False,
    despite: str | Collection[str] = (),
    progress: Progress | None = None,
) -> Contributions:
    """Compute the patient's own contribution to each movement.

    0 % is a passive arm, 100 % an arm that needs no support; below 0 % the arm resists.

    Parameters
    ----------
    recording : Recording or path
        Recording of a person in the robot.
    {options}
    progress : function (done, all), optional
        Called after each trial.

    Returns
    -------
    Contributions
        One `Contribution` per movement.

    Raises
    ------
    InputError
        The robot or an axis of the arm was not calibrated, the arm is another person's, the
        recording is of another robot, or no axis has a passive model.

    Examples
    --------
    A simulated session takes too long for an example (docs/how_to/contribution.md has one):

    >>> from armimpedance.joint.therapy.show import contribution
    >>> session = contribution("session", robot="robot.json", arm="arm.json")  # doctest: +SKIP
    >>> session.to_frame()[["trial", "share_percent"]]  # doctest: +SKIP

    A missing file is named in the message:

    >>> contribution("session", robot="nowhere.json", arm="arm.json")
    Traceback (most recent call last):
    armimpedance.core.errors.InputError: nowhere.json: cannot be read: No such file or directory
    """
    identified, passive = identified_robot(robot), arm_of(arm)
    with naming(arm):
        refuse_other_robot(passive, identified, robot)
        identified.adjusted_to(passive.upper_arm_m)
    session = read_recording(recording)
    with naming(recording):
        session = of_condition(session, condition)
        marks = _marks(session, despite)
    with naming(arm):
        notes = (*marks, *notes_on_person(passive, session.subject))
    with naming(recording):
        check_recording(session, identified)
        step = stepper(progress, session.n_trials)
        torques = movement_torques(session, identified, passive, step=step)
    with naming(arm):
        left_out = axes_without_model((m.axis_name for m in torques), passive, unrepeatable)
    kept = np.array([m.axis_name not in left_out for m in torques])
    movements = tuple(m for m in torques if m.axis_name not in left_out)
    with naming(recording):
        results = [contribution_of(m, identified, passive, unrepeatable=True) for m in movements]
    return Contributions(
        tuple(results), movements, session.select(kept), identified, passive, left_out, notes
    )


def _marks(recording: Recording, despite: str | Collection[str]) -> tuple[str, ...]:
    """Notes of the checks on movements of a robot; empty for others, which the analysis checks."""
    return checked(recording, despite) if moves_a_robot(recording) else ()


def _trials_of(recording: Recording, condition: str) -> int:
    return int((recording.trials["condition"].astype(str) == condition).sum())


# A mock-up of the arm in the therapy robot: measured torques and the weights of its pipes.

Pipe = tuple[float, float, float]


def check_mockup(
    recording: Recording | PathLike,
    robot: Robot,
    *,
    upper_pipe: Pipe,
    lower_pipe: Pipe,
    upper_arm_m: float | None = None,
    condition: str | None = None,
    progress: Progress | None = None,
) -> MockupCheck:
    """Compare the robot's measurements of a mock-up of two weighed pipes with their weight.

    Parameters
    ----------
    recording : Recording or path
        Movements of the mock-up about elevation, up and down, and about the vertical axis.
    robot : TherapyRobot, RobotCalibration or path
        Identified robot.
    upper_pipe, lower_pipe : (mass_kg, length_m, diameter_m)
        Pipes on the robot's upper arm, and on its forearm.
    upper_arm_m : float, optional
        Length to which the robot was adjusted, m; by default from the recording's subject.
    condition : str, optional
        Use only trials of this condition.
    progress : function (done, all), optional
        Called after each trial.

    Returns
    -------
    MockupCheck
        Gravity and inertia with their intervals, and their values from masses and lengths.

    Raises
    ------
    InputError
        Fewer than two movements about either axis, elevation in one direction only, no length, or
        a recording of another robot.

    Examples
    --------
    >>> from armimpedance.joint.therapy.show import check_mockup
    >>> upper, lower = (1.8, 0.32, 0.1), (1.7, 0.3, 0.09)
    >>> check_mockup("pipes", "nowhere.json", upper_pipe=upper, lower_pipe=lower)
    Traceback (most recent call last):
    armimpedance.core.errors.InputError: nowhere.json: cannot be read: No such file or directory
    """
    identified = identified_robot(robot)
    session = read_recording(recording)
    with naming(recording):
        chosen = of_condition(session, condition)
        step = stepper(progress, chosen.n_trials)
        tubes = pipes(upper_pipe, lower_pipe)
        return check_pipes(chosen, identified, tubes, upper_arm_m=upper_arm_m, step=step)
