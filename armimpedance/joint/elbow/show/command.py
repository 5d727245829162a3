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
from typing import Any, Final, Literal

from armimpedance.core.errors import InputError
from armimpedance.show.command.options import add_choice, add_despite
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

# What `armimpedance elbow` is asked: which analysis, and which options have a meaning in it.

#: Analyses beside the courses over time, which have their methods' names.
FIT: Final = "fit"
LAW: Final = "law"
_AT_ONE_POINT: Final = ((FIT, LAW), "it without --time-varying")
#: Methods for two pathways that take trials as they come.
_PRIORS: Final = ("cascade", "cascade-smooth", "cascade-jumps")
#: Option -> the analyses in which it has a meaning, and how a message puts that.
_MEANT_FOR: Final[dict[str, tuple[tuple[str, ...], str]]] = {
    "--method": _AT_ONE_POINT,
    "--decimation": _AT_ONE_POINT,
    "--lowest-hz": _AT_ONE_POINT,
    "--imposed": ((FIT,), "it without --time-varying and --emg-law"),
    "--window-s": (("windows", "quadratic"), "it with --time-varying windows or quadratic"),
    "--imcj": ((LAW,), "it with --emg-law"),
    "--flexor": ((LAW, "emg"), "it with an analysis of EMG: --emg-law or --time-varying emg"),
    "--extensor": ((LAW, "emg"), "it with an analysis of EMG: --emg-law or --time-varying emg"),
    "--emg-cutoff-hz": (("emg",), "it with --time-varying emg"),
    "--over": (_PRIORS, "it with --time-varying cascade"),
    "--aligned": ((*_PRIORS, "ensemble", "short-segments"), "it with --time-varying cascade"),
}


def analysis_of(arguments: argparse.Namespace) -> str:
    """Which analysis is asked for: "fit", "law" or a time-varying method's name.

    Raises InputError: two of them, an unknown method, or an option that has no effect on this one.
    """
    from armimpedance.joint.elbow.cascade.methods import CASCADE_METHODS
    from armimpedance.joint.elbow.stationary.methods import METHODS
    from armimpedance.joint.elbow.varying.methods import VARYING_METHODS

    course = arguments.time_varying
    if course is not None and arguments.emg_law:
        raise InputError("--time-varying with --emg-law", expected="one of them")
    METHODS.named(arguments.method)
    analysis = LAW if arguments.emg_law else FIT
    if course is not None:
        names = (*VARYING_METHODS, *CASCADE_METHODS)
        if course not in names:
            raise InputError(f"unknown method {course!r}", expected=f"one of {', '.join(names)}")
        analysis = course
    for option, (analyses, expected) in _MEANT_FOR.items():
        given = getattr(arguments, option[2:].replace("-", "_")) not in (None, False, "auto")
        if given and analysis not in analyses:
            raise InputError(f"{option} has no effect here", expected=expected)
    return analysis


def options_of(arguments: argparse.Namespace, analysis: str) -> dict[str, Any]:
    """The options of this analysis as its verb takes them.

    Raises InputError: a word that is no number, or none that the option allows.
    """
    common = {name: getattr(arguments, name) for name in ("joint", "condition", "despite")}
    muscles = {"flexor": arguments.flexor, "extensor": arguments.extensor}
    if analysis in (FIT, LAW):
        at_one_point = {
            "method": arguments.method,
            "cutoff_hz": _cutoff(arguments.cutoff_hz),
            "decimation": _decimation(arguments.decimation),
            "lowest_hz": _positive(arguments.lowest_hz, "--lowest-hz"),
        }
        of_fit, of_law = {"imposed": arguments.imposed}, {**muscles, "imcj": arguments.imcj}
        return {**common, **at_one_point, **(of_fit if analysis == FIT else of_law)}
    edge = _cutoff(arguments.cutoff_hz)
    if edge is None:
        raise InputError("--cutoff-hz none with --time-varying", expected="Hz or auto")
    return {
        **common,
        **muscles,
        "method": analysis,
        "window_s": arguments.window_s,
        "over": arguments.over,
        "aligned": arguments.aligned,
        "cutoff_hz": None if edge == "auto" else edge,
        "emg_cutoff_hz": _positive(arguments.emg_cutoff_hz, "--emg-cutoff-hz"),
    }


def _cutoff(word: str) -> float | None | Literal["auto"]:
    """Hz, None for no filter, or to be chosen."""
    from armimpedance.show.command.outputs import number

    if word == "auto":
        return "auto"
    return None if word == "none" else number(word, "--cutoff-hz", "more than 0 Hz, auto or none")


def _positive(word: str | None, option: str) -> float | None:
    from armimpedance.show.command.outputs import number

    return None if word is None else number(word, option, "more than 0 Hz")


def _decimation(word: str) -> int | Literal["auto"]:
    """A whole number, or to be chosen."""
    if word == "auto":
        return "auto"
    if not word.isdigit() or int(word) < 1:
        raise InputError(f"--decimation {word}", expected="1, 2, 3, ... or auto")
    return int(word)


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
    add_choice(parser, "recording")
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
    from armimpedance.show.verbs.results import read_recording

    with bar("fitting") as progress:
        fit = elbow(arguments.recording, **options, progress=progress)
    write_result(fit.content, arguments)
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
    from armimpedance.joint.elbow.show.text import varying_text
    from armimpedance.show.command.options import draw_picture
    from armimpedance.show.command.screen import bar

    with bar("estimating the course") as progress:
        course = elbow_over_time(arguments.recording, **options, progress=progress)
    written = ""
    write_result(course.content, arguments)
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

    with bar("fitting trials") as progress:
        law = emg_law(arguments.recording, **options, progress=progress)
    write_result(law.content, arguments)
    print(law_text(law))
    draw_picture(
        arguments,
        lambda: plot_emg_law(law),
        "Measured stiffness and viscosity of each trial over those that the law makes of its EMG, "
        "with 95 % intervals.",
    )
