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
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from armimpedance.elbow import ElbowFit, VaryingImpedance
    from armimpedance.records import Recording


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("recording", metavar="RECORDING", type=Path)
    parser.add_argument("--out", type=Path, metavar="FIT.json|COURSE.csv")
    parser.add_argument(
        "--method",
        metavar="NAME",
        help="iv (default), output-error, derivative, arx (the source's)",
    )
    parser.add_argument(
        "--cutoff-hz",
        default="auto",
        metavar="HZ|auto|none",
        help="of the zero-phase low-pass on torque and angle (default: chosen and reported)",
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
    parser.add_argument("--joint", type=int, default=1, metavar="N", help="axis (default: 1)")
    parser.add_argument("--condition", metavar="NAME", help="trials of this condition only")
    parser.add_argument(
        "--time-varying",
        metavar="NAME",
        help="windows (the source's), quadratic, smoother, spline, emg",
    )
    parser.add_argument("--window-s", type=float, metavar="S", help="windows, quadratic: length")
    parser.add_argument(
        "--emg-law", action="store_true", help="B and K of each trial over the EMG amplitudes"
    )
    parser.add_argument(
        "--emg-cutoff-hz",
        metavar="HZ",
        help="of the amplitudes' low-pass, --time-varying emg: the lower, the less noisy, so long "
        "as the muscles are slower (default: 10)",
    )
    parser.add_argument("--flexor", metavar="MUSCLE", help="default: the recording's first muscle")
    parser.add_argument("--extensor", metavar="MUSCLE", help="default: the second")
    parser.add_argument(
        "--imcj",
        type=Path,
        metavar="RECORDING",
        help="with --emg-law: isometric torques that calibrate the index of co-contraction",
    )
    parser.add_argument("--figure", type=Path, metavar="PATH.png", help="draw the result")


def run(arguments: argparse.Namespace) -> int:
    """Read, fit, print, write."""
    from armimpedance.cli.parts.checks import check_outputs
    from armimpedance.cli.parts.elbow_input import check_choices
    from armimpedance.cli.parts.joint_input import read_joint

    check_outputs(figure=arguments.figure, out=arguments.out)
    check_choices(arguments)
    recording = read_joint(arguments.recording, arguments.condition)
    if arguments.time_varying is not None:
        return _over_time(recording, arguments)
    if arguments.emg_law:
        from armimpedance.cli.parts.elbow_law import run_law

        return run_law(recording, arguments)
    return _at_one_point(recording, arguments)


def _at_one_point(recording: Recording, arguments: argparse.Namespace) -> int:
    from armimpedance.cli.parts.elbow_input import fit_parts, fit_recording, with_pooling_told
    from armimpedance.files import write_fit
    from armimpedance.report import elbow_object, elbow_text

    parts = fit_parts(recording, arguments)
    fit = with_pooling_told(fit_recording(recording, arguments), parts)
    print(elbow_text(fit, parts))
    if arguments.out is not None:
        write_fit(fit.summary, arguments.out, **elbow_object(fit, parts))
    if arguments.figure is not None:
        _draw_fit(fit, recording, arguments)
    return 0


def _over_time(recording: Recording, arguments: argparse.Namespace) -> int:
    from armimpedance.cli.parts.checks import naming
    from armimpedance.cli.parts.elbow_input import amplitudes, band_edge, emg_cutoff
    from armimpedance.elbow import from_recording, identify_varying
    from armimpedance.files import write_varying
    from armimpedance.report import varying_text

    with naming(arguments.recording):
        samples = from_recording(recording, arguments.joint)
        emg = amplitudes(recording, arguments) if arguments.time_varying == "emg" else None
        varying = identify_varying(
            samples,
            method=arguments.time_varying,
            amplitude=None if emg is None else emg.amplitude,
            # one standard error per muscle: the mean square over time
            amplitude_sd=None if emg is None else (emg.sd**2).mean(axis=0) ** 0.5,
            amplitude_cutoff_hz=emg_cutoff(arguments),
            window_s=arguments.window_s,
            cutoff_hz=band_edge(arguments),
        )
    print(varying_text(varying, () if emg is None else (*emg.notes, *emg.warnings)))
    if arguments.out is not None:
        write_varying(varying, arguments.out)
        print(f"\n{len(varying.time_s)} rows written to {arguments.out}")
    if arguments.figure is not None:
        _draw_course(varying, arguments.figure)
    return 0


def _draw_course(varying: VaryingImpedance, path: Path) -> None:
    from armimpedance.plots import plot_varying_both, save

    save(plot_varying_both(varying), path.with_suffix(""), (path.suffix[1:],))


def _draw_fit(fit: ElbowFit, recording: Recording, arguments: argparse.Namespace) -> None:
    from armimpedance.elbow import from_recording
    from armimpedance.plots import plot_frequency_response, save

    samples = from_recording(recording, arguments.joint)
    figure = plot_frequency_response(samples, fit)
    save(figure, arguments.figure.with_suffix(""), (arguments.figure.suffix[1:],))
