"""Predict joint or hand impedance from a fitted model, with 95 % intervals.

Examples:
  armimpedance predict posture.json --postures grid.csv --out joint.csv
  armimpedance predict muscles.json --activations emg.csv --out joint.csv
  armimpedance predict arm.json --postures grid.csv --activations emg.csv --out joint.csv
  armimpedance predict posture.json --postures grid.csv --recording session --to hand --out hand.csv
  armimpedance predict arm26 --postures grid.csv --to moment-arms --out arms.sto
  armimpedance predict arm.json --postures grid.csv --to moment-arms --joint elbow --out elbow.sto
  armimpedance predict muscles.json --activations emg.csv --to muscle --out muscles.sto

Postures have the columns q_shoulder_rad and q_elbow_rad, in space q_1_rad to q_4_rad (q_7_rad with
a free wrist), activations alpha_1 ... (0 to 1). Given both, row goes with row; a single row goes
with all rows of the other.
Where the model was never measured the row says so (columns extrapolated, reason). Intervals are
those of the model's mean.

--to moment-arms: r = -dL/dq of each muscle in m (OpenSim's sign: a flexor's is positive), of an arm
(planar6, arm26, myoarm4, myoarm7, a table) or as fitted (fit muscles). With --joint the columns are
the muscles alone, as OpenSim's analysis writes them. --to muscle: stiffness of each muscle, N/m; of
a model of one posture (fit activation) what activation adds to it.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Final

from armimpedance.core.conventions import NUMBERED_JOINTS, PLANAR_JOINTS

if TYPE_CHECKING:
    from armimpedance.muscles.models import HandPrediction, JointPrediction

#: What is asked of single muscles.
_TABLES: Final = ("moment-arms", "muscle")


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    from armimpedance.show.command.outputs import TABLE, add_figure, add_out

    parser.add_argument("model", type=Path, metavar="MODEL.json|ARM")
    parser.add_argument("--postures", type=Path, metavar="FILE.csv")
    parser.add_argument("--activations", type=Path, metavar="FILE.csv")
    add_out(parser, "the predictions", TABLE, long=True, required=True)
    add_figure(parser, "K and B of every row, what is extrapolated set apart")
    parser.add_argument("--to", choices=("joint", "hand", *_TABLES), default="joint")
    parser.add_argument(
        "--joint",
        choices=(*PLANAR_JOINTS, *NUMBERED_JOINTS),
        help="--to moment-arms: of this joint alone",
    )
    parser.add_argument(
        "--recording", type=Path, metavar="RECORDING", help="--to hand: whose arm's lengths"
    )
    parser.add_argument(
        "--force",
        nargs="+",
        type=float,
        metavar="N",
        help="--to hand: force by the hand on its environment along each axis, N (default: none)",
    )
    parser.add_argument(
        "--elbow",
        choices=("held", "free"),
        help="--to hand, in space: whether the upper arm is kept from turning about its own axis "
        "(default: the recording's column `elbow`, else free)",
    )


def run(args: argparse.Namespace) -> int:
    """Read, predict, write; say how much of it is extrapolated."""
    from armimpedance.muscles.show.predictions_plot import plot_predictions
    from armimpedance.muscles.show.predictions_verb import at_hand, predict
    from armimpedance.muscles.show.rows_csv import predictions_content
    from armimpedance.show.command.options import draw_picture
    from armimpedance.show.command.outputs import (
        FIGURE,
        TABLE,
        Output,
        check_long,
        check_outputs,
        write_result,
    )

    _check(args)
    reads = [args.model, args.postures, args.activations, args.recording]
    check_outputs(
        Output("--out", args.out, TABLE), Output("--figure", args.figure, FIGURE), reads=reads
    )
    check_long(args)
    if args.to in _TABLES:
        return _write_muscles(args)
    predicted = predict(args.model, postures=args.postures, activations=args.activations)
    shown: JointPrediction | HandPrediction = predicted
    if args.to == "hand":
        shown = at_hand(predicted, recording=args.recording, force_N=args.force, elbow=args.elbow)
    write_result(predictions_content(shown), args)
    outside = int(predicted.extrapolated.sum())
    note = f", {outside} of them extrapolated" if outside else ", none extrapolated"
    print(f"{len(predicted.joint_angles)} rows written to {args.out}{note}")
    draw_picture(
        args,
        lambda: plot_predictions(shown),
        f"Predicted stiffness and viscosity ({args.to}): ellipses to one scale, then the elements "
        f"with 95 % intervals of the model's mean. {outside} of {len(predicted.joint_angles)} rows "
        "lie outside of what was measured (squares).",
    )
    return 0


def _write_muscles(args: argparse.Namespace) -> int:
    """Write what is asked of single muscles."""
    from armimpedance.muscles.show.predictions_verb import OF_MUSCLES, moment_arm_rows, muscle_rows
    from armimpedance.show.files import table_content, write_content

    note = ""
    if args.to == "moment-arms":
        rows, outside = moment_arm_rows(args)
        note = f", {outside} of them extrapolated" if outside else ", none extrapolated"
    else:
        rows = muscle_rows(args)
    write_content(table_content(rows, described=OF_MUSCLES), args.out)
    print(f"{len(rows)} rows written to {args.out}{note}")
    return 0


def _check(args: argparse.Namespace) -> None:
    from armimpedance.core.errors import InputError

    options = ("recording", "force", "elbow", "joint", "figure", "postures", "activations")
    stated = [name for name in options if getattr(args, name) is not None]
    refused = {
        "joint": ("recording", "force", "elbow", "joint"),
        "hand": ("joint",),
        "moment-arms": ("recording", "force", "elbow", "figure", "activations"),
        "muscle": ("recording", "force", "elbow", "figure", "joint", "postures"),
    }[args.to]
    for name in stated:
        if name in refused:
            where = dict.fromkeys(("recording", "force", "elbow"), "--to hand")
            where["joint"] = "--to moment-arms"
            problem = f"--{name} with --to {args.to}"
            raise InputError(problem, expected=where.get(name, "it without"))
    needed = {"hand": "recording", "moment-arms": "postures", "muscle": "activations"}
    if args.to in needed and needed[args.to] not in stated:
        what = {"recording": "the subject's arm lengths", "postures": "angles of the joints"}
        wanted = what.get(needed[args.to], "activations of the muscles")
        raise InputError(f"--to {args.to} without --{needed[args.to]}", expected=wanted)
