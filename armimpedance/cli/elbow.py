"""Inertia, viscosity and stiffness of one joint under a random perturbation, after Ruiz (2011).

Examples:
  armimpedance simulate elbow --subject 1 --out session       something to try it on
  armimpedance elbow session --out fit.json
  armimpedance elbow session --method arx --cutoff-hz 10 --out arx.json
  armimpedance elbow moving --time-varying smoother --out course.csv
  armimpedance elbow moving --time-varying emg --flexor biceps --extensor triceps --out course.csv
  armimpedance elbow levels --emg-law --out law.json
  armimpedance elbow levels --emg-law --imcj calibration --out law.json

tau = I theta'' + B theta' + K theta is fitted about the operating point (the mean). The recording
is of kind "joint" and says in "torque" whether it holds the interaction torque, between limb and
device, or the commanded one: the second returns arm plus device.
Trials are pooled; single conditions and trials follow in the table and in FIT.json.

--time-varying: I constant, B and K over time with pointwise 95 % bands, as a CSV.
--emg-law: one I, B, K per trial, then B and K linear in the EMG of flexor and extensor.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from armimpedance.cli.parts.elbow_input import FIT as AT_ONE_POINT, LAW
from armimpedance.cli.parts.outputs import (
    FIGURE,
    FIT,
    TABLE,
    Output,
    add_figure,
    add_out,
    check_outputs,
)

if TYPE_CHECKING:
    from armimpedance.records import Recording


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    from armimpedance.elbow import METHODS

    parser.add_argument("recording", metavar="RECORDING", type=Path)
    add_out(parser, "the fit, a .json; with --time-varying the course", TABLE)
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
    _configure_course_and_law(parser)
    parser.add_argument("--joint", type=int, default=1, metavar="N", help="axis (default: 1)")
    parser.add_argument("--condition", metavar="NAME", help="trials of this condition only")
    add_figure(parser, "draw the result")


def _configure_course_and_law(parser: argparse.ArgumentParser) -> None:
    from armimpedance.elbow import VARYING_METHODS

    parser.add_argument(
        "--time-varying",
        metavar="NAME",
        help=f"B and K over time: {', '.join(VARYING_METHODS)}; windows are the source's",
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
    from armimpedance.analyses import naming, of_condition, read_recording
    from armimpedance.cli.parts.elbow_input import analysis_of, options_of

    analysis = analysis_of(arguments)
    over_time = analysis not in (AT_ONE_POINT, LAW)
    check_outputs(
        Output("--out", arguments.out, TABLE if over_time else FIT),
        Output("--figure", arguments.figure, FIGURE),
        reads=[arguments.recording, arguments.imcj],
    )
    options = options_of(arguments, analysis)
    with naming(arguments.recording):
        recording = of_condition(read_recording(arguments.recording), arguments.condition)
        if over_time:
            return _over_time(recording, options, arguments)
        if analysis == LAW:
            return _law(recording, options, arguments)
        return _at_one_point(recording, options, arguments)


def _at_one_point(
    recording: Recording, options: dict[str, Any], arguments: argparse.Namespace
) -> int:
    from armimpedance.analyses import elbow
    from armimpedance.cli.parts.progress import bar
    from armimpedance.elbow import from_recording
    from armimpedance.files import write_fit
    from armimpedance.plots import plot_frequency_response
    from armimpedance.report import elbow_text

    with bar("fitting") as progress:
        fit = elbow(recording, **options, progress=progress)
    if arguments.out is not None:
        write_fit(fit.summary, arguments.out, **fit.to_dict())
    if arguments.figure is not None:
        samples = from_recording(recording, arguments.joint)
        _save(plot_frequency_response(samples, fit), arguments.figure)
    print(elbow_text(fit))
    return 0


def _over_time(recording: Recording, options: dict[str, Any], arguments: argparse.Namespace) -> int:
    from armimpedance.analyses import elbow_over_time
    from armimpedance.cli.parts.progress import bar
    from armimpedance.files import write_varying
    from armimpedance.plots import plot_varying_both
    from armimpedance.report import varying_text

    with bar("estimating the course") as progress:
        course = elbow_over_time(recording, **options, progress=progress)
    if arguments.out is not None:
        write_varying(course, arguments.out)
    if arguments.figure is not None:
        _save(plot_varying_both(course), arguments.figure)
    print(varying_text(course))
    if arguments.out is not None:
        print(f"\n{len(course.time_s)} rows written to {arguments.out}")
    return 0


def _law(recording: Recording, options: dict[str, Any], arguments: argparse.Namespace) -> int:
    from armimpedance.analyses import emg_law
    from armimpedance.cli.parts.progress import bar
    from armimpedance.files import write_fit
    from armimpedance.plots import plot_emg_law
    from armimpedance.report import law_text

    with bar("fitting trials") as progress:
        law = emg_law(recording, **options, imcj=arguments.imcj, progress=progress)
    if arguments.out is not None:
        write_fit(law.summary, arguments.out, **law.to_dict())
    if arguments.figure is not None:
        _save(plot_emg_law(law), arguments.figure)
    print(law_text(law))
    return 0


def _save(figure: Any, path: Path) -> None:
    from armimpedance.plots import save

    save(figure, path.with_suffix(""), (path.suffix[1:],))
