"""Base parameters of a body from its motion and contact forces, or of a robot from its torques.

Examples:
  armimpedance simulate body --out session               something to try it on
  armimpedance body session --out fit.json
  armimpedance body session --method prior --prior-sd-percent 30 --motions 4 --figure check.png
  armimpedance body session --motions walk,squat,all_joints --cutoff-hz 8 --out fit.json
  armimpedance body robot --rows all --term viscosity --term friction --term offset --motions all

The recording is a folder of kind "motion" (joint angles, force plates or joint torques, and
skeleton.json) or of kind "markers" with force plates. Fitted are the combinations of masses, first
moments and inertias that such motion can show; from the six equations of the root alone, so that no
joint torque is needed (Venture). The motions that excite best are chosen (--motions: how many, all,
or which), the others are predicted. Methods: ls, weighted (rows by their residuals; default),
consistent (every segment physically possible), prior (the same, near the skeleton's own masses).
"""

from __future__ import annotations

import argparse
from pathlib import Path

from armimpedance.core.errors import InputError
from armimpedance.show.command.outputs import (
    FIGURE,
    TABLE,
    Output,
    add_figure,
    add_out,
    check_long,
    check_outputs,
    write_result,
)


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    from armimpedance.joint.body.methods import METHODS

    parser.add_argument("recording", metavar="RECORDING", type=Path)
    add_out(
        parser,
        "all that is known of the base parameters (FIT.json), or a row a parameter",
        TABLE,
        long=True,
    )
    add_figure(parser, "the wrench and its prediction")
    parser.add_argument("--method", metavar="NAME", help=METHODS.listed())
    parser.add_argument(
        "--motions",
        default="4",
        metavar="N|all|NAMES",
        help="to fit: at most N, chosen by how they excite (default: 4), all, or these conditions",
    )
    parser.add_argument(
        "--prior-sd-percent",
        type=float,
        metavar="PERCENT",
        help="--method prior: how far a mass may be from the skeleton's (default: 30)",
    )
    parser.add_argument(
        "--what-shows",
        action="store_true",
        help="fit what these motions show instead of refusing where they show too little",
    )
    _configure_equations(parser)


def _configure_equations(parser: argparse.ArgumentParser) -> None:
    """Which rows and columns the equations have, and how the motion gets into them."""
    parser.add_argument(
        "--rows",
        choices=("base", "all"),
        help="base: the root's wrench alone (default of a body); all: every joint's torque too "
        "(default of a robot)",
    )
    parser.add_argument(
        "--cutoff-hz",
        default="6",
        metavar="HZ|none",
        help="cut-off of the zero-phase low-pass (default: 6)",
    )
    parser.add_argument(
        "--term",
        action="append",
        default=[],
        metavar="NAME",
        help="what every joint of a robot adds: viscosity, friction, inertia or offset; may be "
        "given again",
    )
    parser.add_argument(
        "--passive-joint",
        action="append",
        default=[],
        metavar="NAME=REST_RAD",
        help="a relaxed joint: its k, h and f are fitted too; may be given again",
    )
    parser.add_argument(
        "--longest-gap-s",
        type=float,
        metavar="S",
        help="longest loss of a marker to bridge (default: 0.2)",
    )


def run(arguments: argparse.Namespace) -> int:
    """Identify, write, print."""
    from armimpedance.joint.body.show.plot import body_figure
    from armimpedance.joint.body.show.text import body_text
    from armimpedance.joint.body.show.verb import body
    from armimpedance.show.command.options import draw_picture
    from armimpedance.show.command.outputs import number
    from armimpedance.show.command.screen import bar

    out, figure, cutoff = arguments.out, arguments.figure, arguments.cutoff_hz
    check_outputs(
        Output("--out", out, TABLE), Output("--figure", figure, FIGURE), reads=[arguments.recording]
    )
    check_long(arguments)
    with bar("identifying") as progress:
        fit = body(
            arguments.recording,
            method=arguments.method,
            motions=_motions(arguments.motions),
            rows=arguments.rows,
            cutoff_hz=None
            if cutoff == "none"
            else number(cutoff, "--cutoff-hz", "more than 0 Hz, or none"),
            terms=arguments.term,
            passive_joints=_rest_angles(arguments.passive_joint),
            prior_sd_percent=arguments.prior_sd_percent,
            what_shows=arguments.what_shows,
            longest_gap_s=arguments.longest_gap_s,
            progress=progress,
        )
    write_result(fit.content, arguments)
    print(body_text(fit))
    held = "fitted" if fit.held_out is None else "held-out"
    draw_picture(
        arguments,
        lambda: body_figure(fit),
        f"Measured and predicted wrench (or joint torques) of the {held} motion whose moments vary "
        "most.",
    )
    return 0


def _rest_angles(words: list[str]) -> dict[str, float]:
    """Passive joints and their rest angles, from ``NAME=REST_RAD``."""
    rests: dict[str, float] = {}
    for word in words:
        name, _, rest = word.partition("=")
        try:
            rests[name] = float(rest)
        except ValueError:
            raise InputError(
                f"--passive-joint {word}", expected="NAME=REST_RAD, as elbow=0.3"
            ) from None
    return rests


def _motions(word: str) -> int | list[str] | None:
    if word == "all":
        return None
    return int(word) if word.lstrip("-").isdigit() else word.split(",")
