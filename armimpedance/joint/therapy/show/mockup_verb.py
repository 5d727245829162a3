"""A mock-up of the arm in the therapy robot: does the robot measure what the pipes weigh?"""

from __future__ import annotations

from armimpedance.core.progress import Progress
from armimpedance.core.records import Recording
from armimpedance.joint.therapy.arm.mockup import MockupCheck, check_mockup as check_pipes, pipes
from armimpedance.joint.therapy.show.contributions import stepper
from armimpedance.joint.therapy.show.inputs import Robot, identified_robot
from armimpedance.show.verbs.sources import PathLike, naming, of_condition, read_recording

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
    """Compare what the robot measures of a mock-up of two weighed pipes with what they weigh.

    Parameters
    ----------
    recording : Recording or path
        Movements of the mock-up about elevation, up and down, and about the vertical axis.
    robot : TherapyRobot, RobotCalibration or path
        Identified.
    upper_pipe, lower_pipe : (mass_kg, length_m, diameter_m)
        On the robot's upper arm, and on its forearm.
    upper_arm_m : float, optional
        Length that the robot was adjusted to, m; by default that of the recording's subject.
    condition : str, optional
        Only trials of this condition.
    progress : function (done, all), optional
        Called after each trial.

    Returns
    -------
    MockupCheck
        Gravity and inertia with their intervals, beside what masses and lengths say.

    Raises
    ------
    InputError
        Fewer than two movements about either axis, elevation one way only, no length, or another
        robot's recording.

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
