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
from pathlib import Path
from typing import TYPE_CHECKING

from armimpedance.joint.therapy.show.options import CONTRIBUTION
from armimpedance.show.command.options import add_choice
from armimpedance.show.command.outputs import (
    FIGURE,
    TABLE,
    Output,
    OutputPath,
    add_figure,
    add_out,
    check_long,
    check_outputs,
    write_result,
)
from armimpedance.show.verbs.kinds import listed

if TYPE_CHECKING:
    from armimpedance.joint.therapy.show.contributions import Contributions


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("recording", metavar="RECORDING", type=Path)
    CONTRIBUTION.configure(parser)
    add_out(parser, "one row a movement", TABLE, long=True)
    parser.add_argument(
        "--samples", type=OutputPath, metavar="FILE", help=f"one row a sample: {listed(TABLE)}"
    )
    parser.add_argument("--live", action="store_true", help="sample by sample, and timed")
    add_figure(parser, "the movements")
    add_choice(parser, "recording")


def run(arguments: argparse.Namespace) -> int:
    """Read, compute, write, print."""
    from armimpedance.joint.therapy.show.plots import plot_feedback
    from armimpedance.joint.therapy.show.verb import contribution
    from armimpedance.show.command.options import draw_picture
    from armimpedance.show.command.screen import bar

    check_outputs(
        Output("--out", arguments.out, TABLE),
        Output("--samples", arguments.samples, TABLE),
        Output("--figure", arguments.figure, FIGURE),
        reads=(arguments.recording, *CONTRIBUTION.reads(arguments)),
    )
    check_long(arguments)
    keywords = CONTRIBUTION.keywords(arguments)
    with bar("movements") as progress:
        results = contribution(arguments.recording, **keywords, progress=progress)
    # before writing: an error of the live form must not leave only some of the files
    live = _live(results, arguments.recording) if arguments.live else ""
    _write(results, arguments)
    _print(results, arguments, live)
    draw_picture(
        arguments,
        lambda: plot_feedback(results.movements, results.robot, results.arm, unrepeatable=True),
        "The movements, condition by condition, and how much of each is the patient's own, with "
        "what does not repeat between movements shaded.",
    )
    return 0


def _live(results: Contributions, recording: Path) -> str:
    """Differences between the live form and the results, and the duration of an update."""
    from armimpedance.show.command.screen import bar
    from armimpedance.show.verbs.results import naming

    with naming(recording), bar("live") as progress:
        return repr(results.replay(progress))


def _write(results: Contributions, arguments: argparse.Namespace) -> None:
    write_result(results.content, arguments)
    if arguments.samples is not None:
        results.write_samples(arguments.samples)


def _print(results: Contributions, arguments: argparse.Namespace, live: str) -> None:
    from textwrap import fill

    from armimpedance.joint.therapy.show.text import contribution_text
    from armimpedance.show.text import TABLE_WIDTH

    left_out = [f"left out: {sentence}" for sentence in results.left_out.values()]
    print(contribution_text(results))
    for sentence in (*results.notes, *left_out):
        print("\n" + fill(sentence, TABLE_WIDTH))
    if arguments.out is not None:
        print(f"\n{len(results)} rows written to {arguments.out}")
    if arguments.samples is not None:
        samples = sum(len(m.time_s) for m in results.movements)
        print(f"{samples} samples written to {arguments.samples}")
    if live:
        print("\n" + fill(live, TABLE_WIDTH))
