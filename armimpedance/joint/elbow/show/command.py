"""Inertia, viscosity and stiffness of one joint under a random perturbation, after Ruiz (2011).

Examples:
  armimpedance simulate elbow --subject 1 --out session       something to try it on
  armimpedance elbow session --out fit.json
  armimpedance elbow session --method arx --cutoff-hz 10 --out arx.json
  armimpedance elbow moving --time-varying smoother --out course.csv
  armimpedance elbow moving --time-varying emg --flexor biceps --extensor triceps --out course.csv
  armimpedance elbow servoed --time-varying cascade --out course.csv
  armimpedance elbow servoed --time-varying cascade --over angle --out course.csv
  armimpedance elbow levels --emg-law --out law.json
  armimpedance elbow levels --emg-law --imcj calibration --out law.json

tau = I theta'' + B theta' + K theta is fitted about the operating point (the mean). The recording
is of kind "joint" and says in "torque" whether it holds the interaction torque, between limb and
device, or the commanded one: the second returns arm plus device. It may say what the rig imposes
("imposed": position, torque or both), and hold the commanded angle (q1_command_rad) or the torque
that the device was told to add (tau1_perturbation_Nm).
Trials are pooled; single conditions and trials follow in the table and in FIT.json.

--time-varying: I constant, B and K over time with pointwise 95 % bands, as a CSV. Without a
name, or with cascade: of an imposed angle, with the course of a reflex where one is seen.
--emg-law: one I, B, K per trial, then B and K linear in the EMG of flexor and extensor.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from armimpedance.joint.elbow.show.command_input import FIT, LAW
from armimpedance.show.command.options import add_despite
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
    from armimpedance.joint.elbow.stationary.methods import METHODS

    parser.add_argument("recording", metavar="RECORDING", type=Path)
    add_out(
        parser,
        "the fit (FIT.json), or a row a parameter; with --time-varying the course",
        TABLE,
        long=True,
    )
    parser.add_argument("--method", metavar="NAME", help=f"{METHODS.listed()}; arx is the source's")
    parser.add_argument(
        "--cutoff-hz",
        default="auto",
        metavar="HZ|auto|none",
        help="edge of the zero-phase low-pass on torque and angle (default: chosen and reported)",
    )
    parser.add_argument(
        "--decimation",
        default="auto",
        metavar="N|auto",
        help="keep every N-th sample after the filter (default: chosen and reported)",
    )
    parser.add_argument(
        "--lowest-hz",
        metavar="HZ",
        help="leave out the motion below this: reflexes and what the subject does (default: all)",
    )
    parser.add_argument(
        "--imposed",
        choices=("position", "torque", "both"),
        help="what the rig imposed on the joint, above what recording.json says; both: a device "
        "of finite impedance (default: as recorded or told, else the record is asked)",
    )
    _configure_course_and_law(parser)
    parser.add_argument("--joint", type=int, default=1, metavar="N", help="axis (default: 1)")
    parser.add_argument("--condition", metavar="NAME", help="trials of this condition only")
    add_despite(parser)
    add_figure(parser, "draw the result")


def _configure_course_and_law(parser: argparse.ArgumentParser) -> None:
    from armimpedance.joint.elbow.cascade.methods import CASCADE_METHODS
    from armimpedance.joint.elbow.varying.methods import VARYING_METHODS

    parser.add_argument(
        "--time-varying",
        nargs="?",
        const=CASCADE_METHODS.default,
        metavar="NAME",
        help=f"B and K over time: {', '.join(VARYING_METHODS)} (windows are the source's); of an "
        f"imposed angle, with a reflex: {', '.join(CASCADE_METHODS)} (default: cascade)",
    )
    parser.add_argument(
        "--over",
        metavar="VARIABLE",
        help="cascade: courses over angle, torque, emg_MUSCLE, phase (0 to 1) or another column",
    )
    parser.add_argument(
        "--aligned", action="store_true", help="cascade: trials are realizations of one course"
    )
    parser.add_argument("--window-s", type=float, metavar="S", help="windows, quadratic: length")
    parser.add_argument(
        "--emg-law", action="store_true", help="B and K of each trial over the EMG amplitudes"
    )
    parser.add_argument(
        "--emg-cutoff-hz",
        metavar="HZ",
        help="edge of the amplitudes' low-pass, --time-varying emg: the lower, the less noisy, so "
        "long as the muscles are slower (default: 10)",
    )
    parser.add_argument("--flexor", metavar="MUSCLE", help="default: the recording's first muscle")
    parser.add_argument("--extensor", metavar="MUSCLE", help="default: the second")
    parser.add_argument(
        "--imcj",
        type=Path,
        metavar="RECORDING",
        help="with --emg-law: isometric torques that calibrate the index of co-contraction",
    )


def run(arguments: argparse.Namespace) -> int:
    """Read, fit, write, print."""
    from armimpedance.joint.elbow.show.command_input import analysis_of, options_of

    analysis = analysis_of(arguments)
    at_one_point, law = analysis == FIT, analysis == LAW
    check_long(arguments)
    check_outputs(
        Output("--out", arguments.out, TABLE),
        Output("--figure", arguments.figure, FIGURE),
        reads=[arguments.recording, arguments.imcj],
    )
    options = options_of(arguments, analysis)
    act = _at_one_point if at_one_point else _law if law else _over_time
    act(options, arguments)
    return 0


def _at_one_point(options: dict[str, Any], arguments: argparse.Namespace) -> None:
    from armimpedance.joint.elbow.samples import from_recording
    from armimpedance.joint.elbow.show.plot import plot_frequency_response
    from armimpedance.joint.elbow.show.text import elbow_text
    from armimpedance.joint.elbow.show.verb import elbow
    from armimpedance.show.command.options import draw_picture
    from armimpedance.show.command.screen import bar
    from armimpedance.show.files import fit_content
    from armimpedance.show.verbs.sources import read_recording

    with bar("fitting") as progress:
        fit = elbow(arguments.recording, **options, progress=progress)
    write_result(fit_content({**fit.summary.to_dict(), **fit.to_dict()}), arguments)
    print(elbow_text(fit))

    def draw() -> Any:
        trials = read_recording(arguments.recording, condition=arguments.condition)
        return plot_frequency_response(
            from_recording(trials, arguments.joint, arguments.imposed), fit
        )

    draw_picture(
        arguments,
        draw,
        "Compliance over frequency: gain (a) and phase (b) measured without a model, with 95 % "
        f"intervals, and as I, B and K of method {fit.method} make them; dashed beyond the band "
        "that motion and torque share; coherence (c).",
    )


def _over_time(options: dict[str, Any], arguments: argparse.Namespace) -> None:
    from armimpedance.joint.elbow.show.over_time_verb import elbow_over_time
    from armimpedance.joint.elbow.show.plot import plot_varying_both
    from armimpedance.joint.elbow.show.table import varying_content
    from armimpedance.joint.elbow.show.text import varying_text
    from armimpedance.show.command.options import draw_picture
    from armimpedance.show.command.screen import bar

    with bar("estimating the course") as progress:
        course = elbow_over_time(arguments.recording, **options, progress=progress)
    written = ""
    write_result(varying_content(course), arguments)
    if arguments.out is not None:
        written = f"\n\n{len(course.time_s)} rows written to {arguments.out}"
    print(varying_text(course) + written)
    draw_picture(
        arguments,
        lambda: plot_varying_both(course),
        f"Stiffness (a) and viscosity (b) over time by method {course.method}, first trial, with "
        "pointwise 95 % bands.",
    )


def _law(options: dict[str, Any], arguments: argparse.Namespace) -> None:
    from armimpedance.joint.elbow.show.emg_verb import emg_law
    from armimpedance.joint.elbow.show.plot import plot_emg_law
    from armimpedance.joint.elbow.show.text import law_text
    from armimpedance.show.command.options import draw_picture
    from armimpedance.show.command.screen import bar
    from armimpedance.show.files import fit_content

    with bar("fitting trials") as progress:
        law = emg_law(arguments.recording, **options, progress=progress)
    write_result(fit_content({**law.summary.to_dict(), **law.to_dict()}), arguments)
    print(law_text(law))
    draw_picture(
        arguments,
        lambda: plot_emg_law(law),
        "Measured stiffness and viscosity of each trial over those that the law makes of its EMG, "
        "with 95 % intervals.",
    )
