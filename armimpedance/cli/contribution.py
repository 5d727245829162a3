"""How much of a robot-assisted movement is the patient's own, after Guidali (2013).

Examples:
  armimpedance simulate therapy --subject P2 --out session        something to try it on
  armimpedance arm session --robot robot.json --out arm.json
  armimpedance contribution session --robot robot.json --arm arm.json --out result.csv
  armimpedance contribution session --robot robot.json --arm arm.json --samples samples.csv
  armimpedance contribution session --robot robot.json --arm arm.json --live

0 % is a passive arm, 100 % an arm that needs no support, below 0 one that resists. One row a
movement:
  share       c of tau_user = c tau_h + d (robot's own inertia), least squares: the number to read
  projection  100 sum(user arm) / sum(arm^2): the same where the robot moves the arm; who moves
              freely accelerates the robot too, which this one counts
  ratio       100 sum(user) / sum(arm), the source's (4): singular where the arm's torque changes
              its sign within the movement (valid: |sum| / sum|.| at least .2)
  reference   (19), against the mean support of the person's own passive repetitions
--samples writes every sample, (3); --live runs the recording through the live form, one sample at a
time, and says how long an update takes and how far it is from the batch.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from armimpedance.contribution.arm import PassiveArm
    from armimpedance.contribution.robot import TherapyRobot
    from armimpedance.contribution.torques import MovementTorques
    from armimpedance.records import Recording


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("recording", metavar="RECORDING", type=Path)
    parser.add_argument("--robot", type=Path, required=True, metavar="ROBOT.json")
    parser.add_argument("--arm", type=Path, required=True, metavar="ARM.json")
    parser.add_argument("--out", type=Path, metavar="RESULT.csv")
    parser.add_argument("--samples", type=Path, metavar="SAMPLES.csv", help="every sample too")
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
    from armimpedance.cli.checks import check_outputs, naming
    from armimpedance.cli.joint_input import read_joint
    from armimpedance.contribution.checks import check_recording
    from armimpedance.contribution.metric import contribution_of
    from armimpedance.contribution.movements import movement_torques
    from armimpedance.report.contribution_csv import write_contributions
    from armimpedance.report.contribution_text import contribution_text
    from armimpedance.report.therapy_json import read_arm, read_robot

    check_outputs(figure=arguments.figure, out=arguments.out)
    check_outputs(figure=None, out=arguments.samples)
    robot, arm = read_robot(arguments.robot), read_arm(arguments.arm)
    recording = read_joint(arguments.recording, arguments.condition)
    with naming(arguments.recording):
        check_recording(recording, robot)
        recording, refused = with_a_model(recording, robot, arm, arguments.unrepeatable)
        movements = movement_torques(recording, robot, arm)
        results = [contribution_of(m, robot, arm, unrepeatable=True) for m in movements]
    print(contribution_text(results))
    for sentence in refused:
        print(f"\nleft out: {sentence}")
    if arguments.out is not None:
        write_contributions(results, arguments.out)
        print(f"\n{len(results)} rows written to {arguments.out}")
    if arguments.samples is not None:
        _write_samples(movements, robot, arm, arguments.samples)
    if arguments.figure is not None:
        _draw(movements, robot, arm, arguments.figure)
    if arguments.live:
        with naming(arguments.recording):
            _run_live(recording, robot, arm)
    return 0


def with_a_model(
    recording: Recording, robot: TherapyRobot, arm: PassiveArm, unrepeatable: bool
) -> tuple[Recording, list[str]]:
    """The trials whose axis has a passive model, and why the others have none.

    Raises
    ------
    InputError
        An axis without passive calibration, or no axis with a model.
    """
    from armimpedance.contribution.metric import usable_elastic
    from armimpedance.contribution.movements import cut_movements
    from armimpedance.errors import InputError

    axes = [robot.axes[m.axis] for m in cut_movements(recording, robot)]
    refused = {}
    for axis in dict.fromkeys(axes):
        arm.elastic_of(axis)
        try:
            usable_elastic(arm, axis, unrepeatable=unrepeatable)
        except InputError as error:
            refused[axis] = error
    if len(refused) == len(set(axes)):
        raise next(iter(refused.values()))
    kept = [axis not in refused for axis in axes]
    return recording.select(kept), [str(error) for error in refused.values()]


def _write_samples(
    movements: tuple[MovementTorques, ...], robot: TherapyRobot, arm: PassiveArm, path: Path
) -> None:
    from armimpedance.contribution.metric import sample_contribution
    from armimpedance.report.contribution_csv import write_samples

    pairs = [(m, sample_contribution(m, robot, arm)) for m in movements]
    write_samples(pairs, path)
    print(f"{sum(len(m.time_s) for m in movements)} samples written to {path}")


def _draw(
    movements: tuple[MovementTorques, ...], robot: TherapyRobot, arm: PassiveArm, path: Path
) -> None:
    from armimpedance.plots.contribution import plot_feedback
    from armimpedance.plots.style import save

    save(
        plot_feedback(movements, robot, arm, unrepeatable=True),
        path.with_suffix(""),
        (path.suffix[1:],),
    )


def _run_live(recording: Recording, robot: TherapyRobot, arm: PassiveArm) -> None:
    from armimpedance.contribution.replay import replay

    report = replay(recording, robot, arm, unrepeatable=True)
    same = "the same flags" if report.flags_differ == 0 else f"{report.flags_differ} flags differ"
    print(
        f"\nlive: {report.n_updates} updates, {1e3 * report.median_s:.3f} ms each (median), 99 % "
        f"within {1e3 * report.p99_s:.3f} ms, results {1e3 * report.delay_s:.0f} ms late; at most "
        f"{report.largest_difference:.1g} from the results in one piece, {same}"
    )
