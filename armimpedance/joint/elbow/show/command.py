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
from typing import TYPE_CHECKING, Any, Final

from armimpedance.core.errors import InputError
from armimpedance.joint.elbow.show.options import ELBOW, ELBOW_OVER_TIME, EMG_LAW
from armimpedance.show.command.options import add_choice
from armimpedance.show.command.outputs import TABLE, add_figure, add_out
from armimpedance.show.command.verb import Command

if TYPE_CHECKING:
    from armimpedance.joint.elbow.elbow_result import ElbowFit

# The requested analysis of `armimpedance elbow`, and the options that have an effect in it.

#: Names of the analyses other than courses over time; those have their methods' names.
FIT: Final = "fit"
LAW: Final = "law"
_AT_ONE_POINT: Final = ((FIT, LAW), "it without --time-varying")
#: Methods for two pathways that do not need repeated trials of one course.
_PRIORS: Final = ("cascade", "cascade-smooth", "cascade-jumps")
#: Option -> the analyses in which it has an effect, and the expectation in a message.
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
    """Name of the requested analysis: "fit", "law" or a time-varying method's name.

    Raises InputError: two of them, or an option that has no effect on this one.
    """
    course = arguments.time_varying
    if course is not None and arguments.emg_law:
        raise InputError("--time-varying with --emg-law", expected="one of them")
    analysis = (LAW if arguments.emg_law else FIT) if course is None else course
    for option, (analyses, expected) in _MEANT_FOR.items():
        stated = getattr(arguments, option[2:].replace("-", "_")) not in (None, False, "auto")
        if stated and analysis not in analyses:
            raise InputError(f"{option} has no effect here", expected=expected)
    return analysis


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments: those of its three analyses, each once."""
    parser.add_argument("recording", metavar="RECORDING", type=Path)
    add_out(
        parser,
        "the fit (FIT.json), or a row a parameter; with --time-varying the course",
        TABLE,
        long=True,
    )
    parser.add_argument(
        "--emg-law", action="store_true", help="B and K of each trial over the EMG amplitudes"
    )
    ELBOW.configure(parser)
    ELBOW_OVER_TIME.configure_beside(parser, ELBOW)
    EMG_LAW.configure_beside(parser, ELBOW, ELBOW_OVER_TIME)
    add_choice(parser, "recording")
    add_figure(parser, "draw the result")


def run(arguments: argparse.Namespace) -> int:
    """Run the requested analysis: check, read, fit, write, print and draw."""
    analysis = analysis_of(arguments)
    if analysis == FIT:
        return _fit(arguments).run(arguments)
    return (_LAW if analysis == LAW else _COURSE).run(arguments)


def _fit(arguments: argparse.Namespace) -> Command:
    """Command that fits I, B and K about an operating point."""

    def draw(fit: ElbowFit) -> Any:
        from armimpedance.joint.elbow.samples import from_recording
        from armimpedance.joint.elbow.show.plot import plot_frequency_response
        from armimpedance.show.verbs.results import read_recording

        trials = read_recording(arguments.recording, condition=arguments.condition)
        return plot_frequency_response(
            from_recording(trials, arguments.joint, arguments.imposed), fit
        )

    return Command(
        ELBOW,
        progress="fitting",
        call="armimpedance.joint.elbow.show.verb:elbow",
        text="armimpedance.joint.elbow.show.text:elbow_text",
        draw=draw,
        caption=lambda fit: (
            "Compliance over frequency: gain (a) and phase (b) measured without a model, with "
            f"95 % intervals, and as I, B and K of method {fit.method} make them; dashed beyond "
            "the band that motion and torque share; coherence (c)."
        ),
    )


_COURSE: Final = Command(
    ELBOW_OVER_TIME,
    progress="estimating the course",
    call="armimpedance.joint.elbow.show.over_time_verb:elbow_over_time",
    text="armimpedance.joint.elbow.show.text:varying_text",
    draw="armimpedance.joint.elbow.show.plot:plot_varying_both",
    caption=lambda course: (
        f"Stiffness (a) and viscosity (b) over time by method {course.method}, first trial, "
        "with pointwise 95 % bands."
    ),
    rows=lambda course: len(course.time_s),
)
_LAW: Final = Command(
    EMG_LAW,
    progress="fitting trials",
    call="armimpedance.joint.elbow.show.emg_verb:emg_law",
    text="armimpedance.joint.elbow.show.text:law_text",
    draw="armimpedance.joint.elbow.show.plot:plot_emg_law",
    caption="Measured stiffness and viscosity of each trial over those that the law makes of its "
    "EMG, with 95 % intervals.",
)
