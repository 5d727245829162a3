"""How much of a robot-assisted movement is the patient's own, after Guidali (2013).

Examples:
  armimpedance simulate therapy --subject P2 --out session        something to try it on
  armimpedance therapy arm session --robot robot.json --out arm.json
  armimpedance therapy contribution session --robot robot.json --arm arm.json --out result.csv
  armimpedance therapy contribution session --robot robot.json --arm arm.json --samples samples.csv
  armimpedance therapy contribution session --robot robot.json --arm arm.json --live

The robot must have been identified (`armimpedance therapy robot`), the person's relaxed arm
measured in it (`armimpedance therapy arm`). 0 % is a passive arm, 100 % an arm that needs no
support, below 0 one that resists. tau_h is what the passive arm needs, tau_user what of it the
person gives: tau_h less the support, which is the motor's torque beyond what the robot itself
needs. One row a movement:
  share       the number to read: c of tau_user = c tau_h + d (robot's inertia torque), by least
              squares, so that to accelerate the robot too is not counted as carrying the arm
  projection  100 sum(tau_user tau_h) / sum(tau_h^2): the same where the robot moves the arm; who
              moves freely accelerates the robot too, which this one counts
  ratio       100 sum(tau_user) / sum(tau_h), the source's (4): not valid where tau_h changes its
              sign within the movement, that is where |sum(tau_h)| / sum|tau_h| is below .2
  reference   (19), against the mean support of the person's own passive repetitions
Sums are over the samples in which the axis moves. An axis whose passive repetitions did not agree
is left out, and the command says so; --unrepeatable goes on all the same.
--samples writes every sample, (3); --live runs the recording through the live form, one sample at a
time, and says how long an update takes and how far it is from the results in one piece.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from armimpedance.records import Recording
    from armimpedance.therapy import MovementTorques, PassiveArm, TherapyRobot


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("recording", metavar="RECORDING", type=Path)
    parser.add_argument(
        "--robot",
        type=Path,
        required=True,
        metavar="ROBOT.json",
        help="as `therapy robot` wrote it",
    )
    parser.add_argument(
        "--arm",
        type=Path,
        required=True,
        metavar="ARM.json",
        help="as `therapy arm` wrote it",
    )
    parser.add_argument("--out", type=Path, metavar="RESULT.csv", help="one row a movement")
    parser.add_argument("--samples", type=Path, metavar="SAMPLES.csv", help="one row a sample")
    parser.add_argument("--condition", metavar="NAME", help="trials of this condition only")
    parser.add_argument("--live", action="store_true", help="sample by sample, and timed")
    parser.add_argument("--figure", type=Path, metavar="PATH.png", help="draw the movements")
    parser.add_argument(
        "--unrepeatable",
        action="store_true",
        help="go on where the passive repetitions of an axis did not agree",
    )


def run(arguments: argparse.Namespace) -> int:
    """Read, compute, print, write."""
    from textwrap import fill

    from armimpedance.cli.parts.checks import check_outputs, naming, refuse_same_file
    from armimpedance.cli.parts.joint_input import read_joint
    from armimpedance.files import write_contributions
    from armimpedance.report import TABLE_WIDTH, contribution_text
    from armimpedance.therapy import check_recording, contribution_of, movement_torques

    check_outputs(figure=arguments.figure, out=arguments.out)
    check_outputs(figure=None, out=arguments.samples)
    inputs = {"robot": arguments.robot, "arm": arguments.arm}
    refuse_same_file(inputs, out=arguments.out, samples=arguments.samples)
    robot, arm = _robot_and_arm(arguments)
    recording = read_joint(arguments.recording, arguments.condition)
    with naming(arguments.arm):
        note = _same_person(arm, recording)
    with naming(arguments.recording):
        check_recording(recording, robot)
        every = movement_torques(recording, robot, arm)
    with naming(arguments.arm):
        refused = axes_without_model([m.axis_name for m in every], arm, arguments.unrepeatable)
    kept = [m.axis_name not in refused for m in every]
    movements = tuple(m for m, keep in zip(every, kept, strict=True) if keep)
    with naming(arguments.recording):
        results = [contribution_of(m, robot, arm, unrepeatable=True) for m in movements]
        # before anything is written: what the live form refuses leaves no half result
        live = _live(recording.select(kept), robot, arm) if arguments.live else ""
    print(contribution_text(results) + note)
    for sentence in refused.values():
        print("\n" + fill(f"left out: {sentence}", TABLE_WIDTH))
    if arguments.out is not None:
        write_contributions(results, arguments.out)
        print(f"\n{len(results)} rows written to {arguments.out}")
    if arguments.samples is not None:
        _write_samples(movements, robot, arm, arguments.samples)
    if arguments.figure is not None:
        _draw(movements, robot, arm, arguments.figure)
    if live:
        print("\n" + fill(live, TABLE_WIDTH))
    return 0


def _robot_and_arm(arguments: argparse.Namespace) -> tuple[TherapyRobot, PassiveArm]:
    """Robot and arm that belong together; errors name the file that is at fault."""
    from armimpedance.cli.parts.checks import naming
    from armimpedance.errors import InputError
    from armimpedance.files import read_arm, read_robot

    robot, arm = read_robot(arguments.robot), read_arm(arguments.arm)
    with naming(arguments.robot):
        robot.identified  # noqa: B018
    with naming(arguments.arm):
        if arm.robot != robot.name:
            raise InputError(
                f"the arm of subject {arm.subject} was measured in the robot {arm.robot!r}",
                expected=f"one measured in {robot.name!r}, the robot of {arguments.robot}",
            )
        robot.adjusted_to(arm.upper_arm_m)
    return robot, arm


def _same_person(arm: PassiveArm, recording: Recording) -> str:
    """A note where the robot was adjusted differently; another person's arm is refused.

    Raises
    ------
    InputError
        The arm and the recording are of different subjects.
    """
    from armimpedance.errors import InputError
    from armimpedance.records import Subject

    subject = recording.subject
    if Subject.id not in (arm.subject, subject.id) and arm.subject != subject.id:
        raise InputError(
            f"the passive arm of subject {arm.subject}",
            expected=f"that of subject {subject.id}, whose recording this is",
        )
    length = subject.upper_arm_m
    if length is None or abs(length - arm.upper_arm_m) < 1e-3:
        return ""
    return (
        f"\n\nthe robot was adjusted to {arm.upper_arm_m:.3f} m when the arm was measured, and "
        f"that was used;\nthe recording says {length:.3f} m"
    )


def axes_without_model(axes: Sequence[str], arm: PassiveArm, unrepeatable: bool) -> dict[str, str]:
    """The moving axes that have no passive model, each with a sentence that says why.

    Raises
    ------
    InputError
        An axis without passive calibration, or no axis with a model.
    """
    from armimpedance.errors import InputError
    from armimpedance.therapy import usable_elastic

    refused = {}
    for axis in dict.fromkeys(axes):
        arm.elastic_of(axis)
        try:
            usable_elastic(arm, axis, unrepeatable=unrepeatable)
        except InputError as error:
            refused[axis] = error.problem
    if len(refused) == len(set(axes)):
        raise InputError(
            next(iter(refused.values())),
            expected="passive repetitions that agree, or --unrepeatable to go on with these",
        )
    return {axis: f"{problem}; --unrepeatable goes on" for axis, problem in refused.items()}


def _write_samples(
    movements: tuple[MovementTorques, ...], robot: TherapyRobot, arm: PassiveArm, path: Path
) -> None:
    from armimpedance.files import write_samples
    from armimpedance.therapy import sample_contribution

    pairs = [(m, sample_contribution(m, robot, arm)) for m in movements]
    write_samples(pairs, path)
    print(f"{sum(len(m.time_s) for m in movements)} samples written to {path}")


def _draw(
    movements: tuple[MovementTorques, ...], robot: TherapyRobot, arm: PassiveArm, path: Path
) -> None:
    from armimpedance.plots import plot_feedback, save

    save(
        plot_feedback(movements, robot, arm, unrepeatable=True),
        path.with_suffix(""),
        (path.suffix[1:],),
    )


def _live(recording: Recording, robot: TherapyRobot, arm: PassiveArm) -> str:
    """What the live form says, and how long it takes."""
    from armimpedance.therapy import replay

    report = replay(recording, robot, arm, unrepeatable=True)
    same = "the same flags" if report.flags_differ == 0 else f"{report.flags_differ} flags differ"
    return (
        f"live: {report.n_updates} updates, {1e3 * report.median_s:.3f} ms each (median), 99 % "
        f"within {1e3 * report.p99_s:.3f} ms, results {1e3 * report.delay_s:.0f} ms late; at most "
        f"{report.largest_difference:.1g} from the results in one piece, {same}"
    )
