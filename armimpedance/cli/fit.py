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
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from armimpedance.files import Model
    from armimpedance.muscles import JointRows

#: Which kinds take which options; others are refused with these.
_OF_KIND = {
    "moment-arms": ("order", "model", "box"),
    "activation": ("order", "model", "arm", "torque", "increasing", "no_curvature"),
    "muscles": ("order", "arm", "activation_order", "prior_percent", "torque", "no_curvature"),
}


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("kind", choices=tuple(_OF_KIND))
    parser.add_argument("results", nargs="+", type=Path, metavar="RESULTS.csv")
    parser.add_argument("--out", required=True, type=Path, metavar="MODEL.json")
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
        help="moment-arms: polynomial, sos, separable, box; activation: polynomial, bernstein",
    )
    parser.add_argument(
        "--box",
        nargs=4,
        type=float,
        metavar=("S_LOW", "S_HIGH", "E_LOW", "E_HIGH"),
        help="moment-arms: the workspace, shoulder and elbow in degrees (default: as measured)",
    )
    parser.add_argument(
        "--arm",
        metavar="NAME|TABLE.csv",
        help="moment arms: planar6 (default), arm26, or a table of your own",
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
    parser.add_argument("--seed", type=int, default=0, help="of shuffles (default: 0)")


def run(arguments: argparse.Namespace) -> int:
    """Read the rows, fit, print how well, write the model."""
    from armimpedance.cli.parts.checks import check_outputs, check_seed
    from armimpedance.files import read_joint_rows, write_model
    from armimpedance.report import model_text

    check_seed(arguments.seed)
    check_outputs(figure=None, out=arguments.out)
    _check_options(arguments)
    rows = read_joint_rows(arguments.results)
    fit = {"moment-arms": _moment_arms, "activation": _activation, "muscles": _muscles}
    model = fit[arguments.kind](rows, arguments)
    print(f"{rows.n_rows} rows, model {arguments.kind}\n\n{model_text(model)}")
    write_model(model, arguments.out)
    print(f"\nwritten to {arguments.out}")
    return 0


def _check_options(arguments: argparse.Namespace) -> None:
    from armimpedance.errors import InputError

    for option in sorted({name for names in _OF_KIND.values() for name in names}):
        if getattr(arguments, option) is not None and option not in _OF_KIND[arguments.kind]:
            kinds = " or ".join(kind for kind, names in _OF_KIND.items() if option in names)
            flag = f"--{option.replace('_', '-')}"
            raise InputError(f"{flag} with fit {arguments.kind}", expected=f"it with fit {kinds}")


def _moment_arms(rows: JointRows, arguments: argparse.Namespace) -> Model:
    import numpy as np

    from armimpedance.cli.parts.progress import bar
    from armimpedance.muscles import fit_posture_model

    box = None if arguments.box is None else np.radians(arguments.box).reshape(2, 2)
    with bar("fitting") as progress:
        return fit_posture_model(
            rows,
            order=2 if arguments.order is None else arguments.order,
            model=arguments.model,
            box=box,
            seed=arguments.seed,
            progress=progress,
        )


def _activation(rows: JointRows, arguments: argparse.Namespace) -> Model:
    from armimpedance.arm import arm_named
    from armimpedance.muscles import fit_activation_model

    return fit_activation_model(
        rows,
        arm_named(arguments.arm or "planar6"),
        order=1 if arguments.order is None else arguments.order,
        model=arguments.model,
        torque=bool(arguments.torque),
        increasing=bool(arguments.increasing),
        curvature=not arguments.no_curvature,
        seed=arguments.seed,
    )


def _muscles(rows: JointRows, arguments: argparse.Namespace) -> Model:
    from armimpedance.arm import arm_named
    from armimpedance.muscles import fit_muscle_model

    return fit_muscle_model(
        rows,
        arm_named(arguments.arm or "planar6"),
        moment_arm_order=2 if arguments.order is None else arguments.order,
        activation_order=1 if arguments.activation_order is None else arguments.activation_order,
        prior_percent=20.0 if arguments.prior_percent is None else arguments.prior_percent,
        torque=bool(arguments.torque),
        curvature=not arguments.no_curvature,
        seed=arguments.seed,
    )
