"""Fit a model of joint impedance to joint-level rows: over posture, over activation, over both.

Examples:
  armimpedance fit moment-arms joint.csv --order 2 --out posture.json
  armimpedance fit moment-arms joint.csv --order 2 --model box --box 0 90 30 120 --out box.json
  armimpedance fit activation cocontraction.csv force.csv --order 1 --torque --out muscles.json
  armimpedance fit muscles postures.csv cocontraction.csv force.csv --out arm.json

moment-arms: K_j and B_j of one activation over posture (polynomials of order 2L, L the order of the
  moment arms). polynomial: the source's least squares; sos (default for L >= 2): positive definite
  at every posture; separable: the same, each arm a function of its own joint's angle (few postures
  are enough); box: positive definite on a workspace.
activation: K_j and B_j of one posture over the six muscles' activations (columns alpha_1 ...).
  polynomial: the source's least squares; bernstein: stiffness never negative.
muscles: both together, moment arms that keep to an arm's published ones as far as data allow.

Rows come from: armimpedance map hand.csv --recording session --to joint --out joint.csv
In space (four angles, with three joints where the elbow was held) muscles alone makes a model, with
a table of moment arms: columns muscle, q_1_rad to q_4_rad, G_1_m to G_4_m (dL/dq). A hand whose
elbow was free is fitted as it is, without mapping, and says whose arm it is:
  armimpedance fit muscles hand.csv --recording session --arm arms.csv --order 1 --out arm.json
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

if TYPE_CHECKING:
    from armimpedance.muscles.models import HandRows, JointRows


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    from armimpedance.muscles.models import ACTIVATION_MODELS, MODEL_KINDS, POSTURE_MODELS
    from armimpedance.show.command.outputs import FIT, add_figure, add_out

    parser.add_argument("kind", choices=tuple(MODEL_KINDS))
    parser.add_argument("results", nargs="+", type=Path, metavar="RESULTS.csv")
    add_out(parser, "the model", FIT, required=True)
    add_figure(parser, "measured elements of K and B over those of the model")
    parser.add_argument(
        "--order",
        type=int,
        metavar="N",
        help="moment-arms and muscles: of the moment arms over posture (default: 2); activation: "
        "of stiffness over activation (default: 1)",
    )
    parser.add_argument(
        "--model",
        metavar="NAME",
        help=f"moment-arms: {POSTURE_MODELS.listed()}, polynomial below order 2; activation: "
        f"{ACTIVATION_MODELS.listed()}",
    )
    parser.add_argument(
        "--box",
        nargs=4,
        type=float,
        metavar=("S_LOW", "S_HIGH", "E_LOW", "E_HIGH"),
        help="moment-arms: the workspace, shoulder and elbow in degrees (default: as measured)",
    )
    _add_muscles(parser)
    parser.add_argument("--seed", type=int, default=0, help="seed of shuffles (default: 0)")


def _add_muscles(parser: argparse.ArgumentParser) -> None:
    """Options of the kinds that know single muscles."""
    parser.add_argument(
        "--arm",
        metavar="NAME|TABLE.csv",
        help="moment arms: planar6 (default), arm26; in space myoarm4, myoarm7; or a table",
    )
    parser.add_argument(
        "--torque",
        action="store_true",
        default=None,
        help="activation, muscles: fit the joint torque too (stiffness in proportion to tension)",
    )
    parser.add_argument(
        "--increasing",
        action="store_true",
        default=None,
        help="activation, bernstein: stiffness grows with activation",
    )
    parser.add_argument(
        "--no-curvature",
        action="store_true",
        default=None,
        help="leave out what tension adds through the paths' curvature, as the source does",
    )
    _add_combined(parser)


def _add_combined(parser: argparse.ArgumentParser) -> None:
    """Options of the kind `muscles` alone."""
    parser.add_argument(
        "--activation-order",
        type=int,
        metavar="N",
        help="muscles: of stiffness over activation (default: 1)",
    )
    parser.add_argument(
        "--prior-percent",
        type=float,
        metavar="P",
        help="muscles: how far moment arms may be from the arm's, one sd (default: 20)",
    )
    parser.add_argument(
        "--recording",
        type=Path,
        metavar="RECORDING",
        help="muscles: rows are of the hand in space, elbow free; whose arm it is",
    )


def run(args: argparse.Namespace) -> int:
    """Read the rows, fit, write the model, print how well it fits."""
    from armimpedance.muscles.models import JointRows, kind_of, write_model
    from armimpedance.muscles.show.predictions_plot import plot_model_fit
    from armimpedance.muscles.show.predictions_verb import predict
    from armimpedance.muscles.show.text import model_text
    from armimpedance.muscles.show.verb import fit_model
    from armimpedance.show.command.options import draw_picture
    from armimpedance.show.command.outputs import FIGURE, FIT, Output, check_outputs, check_seed
    from armimpedance.show.command.screen import bar

    check_seed(args.seed)
    check_outputs(
        Output("--out", args.out, FIT),
        Output("--figure", args.figure, FIGURE),
        reads=[*args.results, args.recording],
    )
    options = _options(args)
    rows = _rows(args)
    with bar("fitting") as progress:
        model = fit_model(args.kind, rows, **options, seed=args.seed, progress=progress)
    write_model(model, args.out)
    print(f"{len(rows.joint_angles)} rows, model {args.kind}\n\n{model_text(model)}")
    print(f"\nwritten to {args.out}")

    def draw() -> Any:
        inputs = {"postures": rows.joint_angles, "activations": rows.activation}
        needed = {name: inputs[name] for name in kind_of(model).needs}
        return plot_model_fit(predict(model, **needed), cast(JointRows, rows))

    draw_picture(
        args,
        draw,
        "Joint stiffness (above) and viscosity (below) as measured over those that the model makes "
        f"of the same {len(rows.joint_angles)} rows ({args.kind}), with 95 % intervals; s "
        "shoulder, e elbow. These rows were fitted: how well others are predicted is said with "
        "the model.",
    )
    return 0


def _rows(args: argparse.Namespace) -> JointRows | HandRows:
    """The rows of the joints, or of a hand whose elbow was free."""
    from armimpedance.core.errors import InputError
    from armimpedance.muscles.show.rows_csv import read_joint_rows
    from armimpedance.muscles.show.verb import free_hand_rows

    if args.recording is None:
        return read_joint_rows(args.results)
    if args.kind != "muscles":
        raise InputError(f"--recording with fit {args.kind}", expected="it with fit muscles")
    if args.figure is not None:
        raise InputError("--figure of rows of the hand", expected="one of predict --to hand")
    return free_hand_rows(args.results, args.recording)


def _options(args: argparse.Namespace) -> dict[str, Any]:
    """The keywords of the kind's fit; options of other kinds are refused."""
    import numpy as np

    from armimpedance.core.errors import InputError
    from armimpedance.muscles.models import MODEL_KINDS

    names_of_options = sorted({name for kind in MODEL_KINDS.values() for name in kind.options})
    given = {
        name: getattr(args, name) for name in names_of_options if getattr(args, name) is not None
    }
    keywords = MODEL_KINDS[args.kind].options
    for name in given:
        if name not in keywords:
            kinds = [kind.name for kind in MODEL_KINDS.values() if name in kind.options]
            flag = f"--{name.replace('_', '-')}"
            expected = f"it with fit {' or '.join(kinds)}"
            raise InputError(f"{flag} with fit {args.kind}", expected=expected)
    if "box" in given:
        given["box"] = np.radians(given["box"]).reshape(2, 2)
    if "no_curvature" in given:
        given["no_curvature"] = False
    return {keywords[name]: value for name, value in given.items()}
