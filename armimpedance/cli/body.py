"""Base parameters of a body from its motion and contact forces, or of a robot from its torques.

Examples:
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
from typing import TYPE_CHECKING

from armimpedance.cli.passive_input import number, read_joint_motion
from armimpedance.errors import InputError

if TYPE_CHECKING:
    from armimpedance.body.rows import RowChoice
    from armimpedance.motion import MotionRecording

METHODS = {name: name for name in ("weighted", "consistent", "prior")} | {"ls": "least_squares"}


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("recording", metavar="RECORDING", type=Path)
    parser.add_argument("--out", type=Path, metavar="FIT.json")
    parser.add_argument("--method", default="weighted", help="weighted, ls, consistent or prior")
    parser.add_argument(
        "--motions", default="4", metavar="N|all|NAMES", help="that are fitted (default: best 4)"
    )
    parser.add_argument("--rows", choices=("base", "all"), help="base: the root's wrench alone")
    parser.add_argument(
        "--cutoff-hz", metavar="HZ|none", help="of the zero-phase low-pass (default: 6)"
    )
    parser.add_argument("--prior-sd-percent", type=float, metavar="PERCENT", help="default: 30")
    parser.add_argument(
        "--term",
        action="append",
        default=[],
        help="what every joint of a robot adds: viscosity, friction, inertia, offset",
    )
    parser.add_argument(
        "--passive-joint",
        action="append",
        default=[],
        metavar="NAME=REST_RAD",
        help="a relaxed joint: its k, h and f are fitted too; may be given again",
    )
    parser.add_argument(
        "--what-shows",
        action="store_true",
        help="fit what these motions show instead of refusing where they show too little",
    )
    parser.add_argument("--figure", type=Path, metavar="PATH.png", help="measured and predicted")


def run(arguments: argparse.Namespace) -> int:
    """Read, identify, print, write."""
    from armimpedance.body.identify import identify_body
    from armimpedance.cli.checks import check_outputs
    from armimpedance.report.body_text import body_object, body_text
    from armimpedance.report.fit_json import write_fit

    check_outputs(figure=arguments.figure, out=arguments.out)
    if arguments.method not in METHODS:
        raise InputError(f"--method {arguments.method}", expected=" or ".join(METHODS))
    percent = arguments.prior_sd_percent
    if percent is not None and arguments.method != "prior":
        raise InputError("--prior-sd-percent without --method prior", expected="both")
    recording, notes = read_joint_motion(arguments.recording)
    choice = row_choice(recording, arguments)
    fit = identify_body(
        recording,
        method=METHODS[arguments.method],  # type: ignore[arg-type]
        choice=choice,
        motions=_motions(arguments.motions),
        prior_sd=0.3 if percent is None else percent / 100,
        data_dependent=arguments.what_shows,
    )
    print("\n".join([*notes, body_text(fit)]))
    if arguments.out is not None:
        write_fit(fit.summary(), arguments.out, **body_object(fit, recording.skeleton))
    if arguments.figure is not None:
        from armimpedance.plots.body import body_figure
        from armimpedance.plots.style import save

        figure = body_figure(recording, choice, fit)
        save(figure, arguments.figure.with_suffix(""), (arguments.figure.suffix[1:],))
    return 0


def row_choice(recording: MotionRecording, arguments: argparse.Namespace) -> RowChoice:
    """Rows, columns and filter as asked, by default those of a body or a robot.

    Raises
    ------
    InputError
        An option that does not go with the recording.
    """
    from armimpedance.body.identify import CUTOFF_HZ
    from armimpedance.body.joint_terms import passive_terms, robot_terms
    from armimpedance.body.rows import RowChoice

    floating = recording.skeleton.floating
    joints, rests = _passive(arguments.passive_joint)
    if arguments.term and joints:
        raise InputError("--term with --passive-joint", expected="one of the two")
    terms = passive_terms(joints, rests) + robot_terms(recording.skeleton, arguments.term)
    cutoff = CUTOFF_HZ if arguments.cutoff_hz is None else None
    if arguments.cutoff_hz not in (None, "none"):
        cutoff = number(arguments.cutoff_hz, "--cutoff-hz", "Hz, or none")
    return RowChoice(
        rows=arguments.rows or ("base" if floating else "all"),
        cutoff_hz=cutoff,
        terms=terms,
        passive_joints=joints,
    )


def _passive(words: list[str]) -> tuple[tuple[str, ...], tuple[float, ...]]:
    joints, rests = [], []
    for word in words:
        name, equals, rest = word.partition("=")
        try:
            rests.append(float(rest))
        except ValueError:
            equals = ""
        if not (name and equals):
            raise InputError(f"--passive-joint {word}", expected="NAME=REST_RAD")
        joints.append(name)
    return tuple(joints), tuple(rests)


def _motions(word: str) -> int | list[str] | None:
    if word == "all":
        return None
    if word.lstrip("-").isdigit():
        return int(word)
    return word.split(",")
