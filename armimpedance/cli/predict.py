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
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from armimpedance.muscles import JointPrediction

#: What each kind of model has to be told.
_NEEDS = {
    "moment-arms": ("postures",),
    "activation": ("activations",),
    "muscles": ("postures", "activations"),
}


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("model", type=Path, metavar="MODEL.json")
    parser.add_argument("--postures", type=Path, metavar="FILE.csv")
    parser.add_argument("--activations", type=Path, metavar="FILE.csv")
    parser.add_argument("--out", required=True, type=Path, metavar="FILE.csv")
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


def run(arguments: argparse.Namespace) -> int:
    """Read, predict, write; say how much of it is extrapolated."""
    from armimpedance.cli.parts.checks import check_outputs
    from armimpedance.files import read_model, write_predictions

    check_outputs(figure=None, out=arguments.out)
    _check_hand(arguments)
    kind, model = read_model(arguments.model)
    predicted = _predict(kind, model, arguments)
    at = predicted if arguments.to == "joint" else _at_hand(predicted, arguments)
    write_predictions(at, arguments.out)
    outside = int(predicted.extrapolated.sum())
    note = f", {outside} of them extrapolated" if outside else ", none extrapolated"
    print(f"{len(predicted.joint_angles)} rows written to {arguments.out}{note}")
    return 0


def _check_hand(arguments: argparse.Namespace) -> None:
    from armimpedance.errors import InputError

    given = [name for name in ("recording", "force") if getattr(arguments, name) is not None]
    if arguments.to == "joint" and given:
        raise InputError(f"--{given[0]} with --to joint", expected="--to hand")
    if arguments.to == "hand" and arguments.recording is None:
        raise InputError("--to hand without --recording", expected="the subject's arm lengths")


def _predict(kind: str, model: Any, arguments: argparse.Namespace) -> JointPrediction:
    from armimpedance.errors import InputError
    from armimpedance.files import joined, read_activations, read_postures

    for name in ("postures", "activations"):
        wanted = name in _NEEDS[kind]
        if wanted != (getattr(arguments, name) is not None):
            problem = f"a {kind} model {'without' if wanted else 'with'} --{name}"
            needs = " and ".join(f"--{n}" for n in _NEEDS[kind])
            raise InputError(problem, file=arguments.model, expected=needs)
    postures = None if arguments.postures is None else read_postures(arguments.postures)
    activations = None
    if arguments.activations is not None:
        activations = read_activations(arguments.activations, len(model.muscles))
    postures, activations = joined(postures, activations)
    predicted: JointPrediction = model.predict(
        *(given for given in (postures, activations) if given is not None)
    )
    return predicted


def _at_hand(predicted: JointPrediction, arguments: argparse.Namespace) -> Any:
    from armimpedance.levels import kinematic_arm
    from armimpedance.muscles import at_hand
    from armimpedance.recordings import read_metadata

    subject = read_metadata(arguments.recording / "recording.json").subject
    return at_hand(predicted, kinematic_arm(subject), arguments.force)
