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
from typing import TYPE_CHECKING, Literal

from armimpedance.cli.parts.checks import naming, number
from armimpedance.cli.parts.passive_input import read_joint_motion
from armimpedance.errors import InputError

if TYPE_CHECKING:
    from armimpedance.body import RowChoice
    from armimpedance.motion import MotionRecording
    from armimpedance.skeleton import Skeleton

METHODS = {"ls": "least_squares"} | {n: n for n in ("weighted", "consistent", "prior")}
#: No joint rests further from zero, rad; degrees do.
_LARGEST_REST = 6.3


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("recording", metavar="RECORDING", type=Path)
    parser.add_argument("--out", type=Path, metavar="FIT.json")
    parser.add_argument(
        "--method",
        default="weighted",
        metavar="NAME",
        help="ls, weighted (default), consistent or prior",
    )
    parser.add_argument(
        "--motions",
        default="4",
        metavar="N|all|NAMES",
        help="to fit: at most N, chosen by how they excite (default: 4), all, or these conditions",
    )
    parser.add_argument(
        "--rows",
        choices=("base", "all"),
        help="base: the root's wrench alone (default of a body); all: every joint's torque too "
        "(default of a robot)",
    )
    parser.add_argument(
        "--cutoff-hz", metavar="HZ|none", help="of the zero-phase low-pass (default: 6)"
    )
    parser.add_argument(
        "--prior-sd-percent",
        type=float,
        metavar="PERCENT",
        help="--method prior: how far a mass may be from the skeleton's (default: 30)",
    )
    parser.add_argument(
        "--noise-draws",
        type=int,
        metavar="N",
        help="of added noise, to take off what the angles' own noise does (default: 6; 0: none)",
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
        "--what-shows",
        action="store_true",
        help="fit what these motions show instead of refusing where they show too little",
    )
    parser.add_argument(
        "--figure", type=Path, metavar="PATH.png", help="draw wrench and prediction"
    )


def run(arguments: argparse.Namespace) -> int:
    """Read, identify, print, write."""
    from armimpedance.body import identify_body
    from armimpedance.cli.parts.checks import check_outputs
    from armimpedance.cli.parts.progress import bar
    from armimpedance.files import write_fit
    from armimpedance.report import body_object, body_text

    check_outputs(figure=arguments.figure, out=arguments.out)
    if arguments.method not in METHODS:
        raise InputError(f"--method {arguments.method}", expected=f"one of {', '.join(METHODS)}")
    prior_sd = _prior_sd(arguments)
    recording, notes = read_joint_motion(arguments.recording, forces=True)
    choice = row_choice(recording, arguments)
    with naming(arguments.recording), bar("identifying") as progress:
        fit = identify_body(
            recording,
            method=METHODS[arguments.method],  # type: ignore[arg-type]
            choice=choice,
            motions=_motions(arguments.motions),
            prior_sd=prior_sd,
            data_dependent=arguments.what_shows,
            noise_draws=_draws(arguments.noise_draws),
            progress=progress,
        )
    print("\n".join([*notes, body_text(fit)]))
    if arguments.out is not None:
        write_fit(fit.summary(), arguments.out, **body_object(fit, recording.skeleton))
    if arguments.figure is not None:
        from armimpedance.plots import body_figure, save

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
    from armimpedance.body import CUTOFF_HZ, RowChoice, passive_terms, robot_terms

    floating = recording.skeleton.floating
    joints, rests = _passive(arguments.passive_joint, recording.skeleton)
    if arguments.term and joints:
        raise InputError("--term with --passive-joint", expected="one of the two")
    rows: Literal["base", "all"] = arguments.rows or ("base" if floating else "all")
    if arguments.term and rows == "base":
        raise InputError(
            "--term with the rows of the root, which no joint's torque enters",
            expected="--rows all, of a recording with measured torque",
        )
    terms = passive_terms(joints, rests) + robot_terms(recording.skeleton, arguments.term)
    cutoff = CUTOFF_HZ if arguments.cutoff_hz is None else None
    if arguments.cutoff_hz not in (None, "none"):
        cutoff = number(arguments.cutoff_hz, "--cutoff-hz", "more than 0 Hz, or none")
    return RowChoice(
        rows=rows,
        cutoff_hz=cutoff,
        terms=terms,
        passive_joints=joints,
    )


def _prior_sd(arguments: argparse.Namespace) -> float:
    percent = arguments.prior_sd_percent
    if percent is None:
        return 0.3
    if arguments.method != "prior":
        raise InputError("--prior-sd-percent without --method prior", expected="both")
    if not 0 < percent < float("inf"):
        raise InputError(f"--prior-sd-percent {percent:g}", expected="more than 0")
    return float(percent) / 100


def _passive(words: list[str], skeleton: Skeleton) -> tuple[tuple[str, ...], tuple[float, ...]]:
    hinges = skeleton.coordinates[len(skeleton.root_coordinates) :]
    joints, rests = [], []
    for word in words:
        name, _, rest = word.partition("=")
        try:
            angle = float(rest)
        except ValueError:
            angle = float("nan")
        if angle != angle:
            raise InputError(f"--passive-joint {word}", expected="NAME=REST_RAD, as elbow=0.3")
        if abs(angle) > _LARGEST_REST:
            raise InputError(f"--passive-joint {word} looks like degrees", expected="radians")
        if name not in hinges:
            raise InputError(
                f"--passive-joint {word}: no such joint", expected=f"one of {', '.join(hinges)}"
            )
        joints.append(name)
        rests.append(angle)
    return tuple(joints), tuple(rests)


def _motions(word: str) -> int | list[str] | None:
    if word == "all":
        return None
    if word.lstrip("-").isdigit():
        return int(word)
    return word.split(",")


def _draws(given: int | None) -> int:
    from armimpedance.body import NOISE_DRAWS

    if given is None:
        return NOISE_DRAWS
    if given != 0 and given < 2:
        raise InputError(f"--noise-draws {given}", expected="2 or more, or 0")
    return given
