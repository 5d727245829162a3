"""Predict joint or hand impedance from a fitted model, with 95 % intervals.

Examples:
  armimpedance predict posture.json --postures grid.csv --out joint.csv
  armimpedance predict muscles.json --activations emg.csv --out joint.csv
  armimpedance predict arm.json --postures grid.csv --activations emg.csv --out joint.csv
  armimpedance predict posture.json --postures grid.csv --recording session --to hand --out hand.csv

Postures have the columns q_shoulder_rad and q_elbow_rad, activations alpha_1 ... (0 to 1). Given
both, row goes with row; a single row goes with all rows of the other. Where the model was never
measured the row says so (columns extrapolated, reason). Intervals are those of the model's mean.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from armimpedance.muscles import HandPrediction, JointPrediction


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    from armimpedance.cli.parts.outputs import TABLE, add_figure, add_out

    parser.add_argument("model", type=Path, metavar="MODEL.json")
    parser.add_argument("--postures", type=Path, metavar="FILE.csv")
    parser.add_argument("--activations", type=Path, metavar="FILE.csv")
    add_out(parser, "the predictions", TABLE, required=True)
    add_figure(parser, "K and B of every row, what is extrapolated set apart")
    parser.add_argument("--to", choices=("joint", "hand"), default="joint")
    parser.add_argument(
        "--recording", type=Path, metavar="RECORDING", help="--to hand: whose arm's lengths"
    )
    parser.add_argument(
        "--force",
        nargs=2,
        type=float,
        metavar=("FX", "FY"),
        help="--to hand: force by the hand on its environment, N (default: none)",
    )


def run(args: argparse.Namespace) -> int:
    """Read, predict, write; say how much of it is extrapolated."""
    from armimpedance.analyses import at_hand, predict
    from armimpedance.cli.parts.figure import draw_picture
    from armimpedance.cli.parts.outputs import FIGURE, TABLE, Output, check_outputs
    from armimpedance.files import write_predictions
    from armimpedance.plots import plot_predictions

    _check_hand(args)
    reads = [args.model, args.postures, args.activations, args.recording]
    check_outputs(
        Output("--out", args.out, TABLE), Output("--figure", args.figure, FIGURE), reads=reads
    )
    predicted = predict(args.model, postures=args.postures, activations=args.activations)
    shown: JointPrediction | HandPrediction = predicted
    if args.to == "hand":
        shown = at_hand(predicted, recording=args.recording, force_N=args.force)
    write_predictions(shown, args.out)
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


def _check_hand(args: argparse.Namespace) -> None:
    from armimpedance.errors import InputError

    given = [name for name in ("recording", "force") if getattr(args, name) is not None]
    if args.to == "joint" and given:
        raise InputError(f"--{given[0]} with --to joint", expected="--to hand")
    if args.to == "hand" and args.recording is None:
        raise InputError("--to hand without --recording", expected="the subject's arm lengths")
