"""Estimate inertia, viscosity and stiffness of every condition of one or more recordings.

Examples:
  armimpedance estimate session --out hand.csv --figure hand.png
  armimpedance estimate session --by condition --by day --out hand_by_day.csv
  armimpedance estimate monday tuesday --method paper --out paper.csv
  armimpedance estimate session --method all --out every_method.csv
  armimpedance estimate session --out hand.xlsx         a workbook: intervals, checks, methods
  armimpedance estimate session --out long.csv --long   one row a number, with its unit

Each row holds M, B and K with standard errors and 95 % intervals clustered by trial, and size,
orientation and shape of their ellipses. M is the limb's own: the mass between force sensor and
hand (handle_mass_kg of the recording) is subtracted; M_with_handle is as measured.

--method all runs every method, prints them side by side, says why a method cannot run on this
recording, and which ones differ from the default by more than chance: an assumption that fails.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from armimpedance.core.conventions import group_name
from armimpedance.core.errors import InputError
from armimpedance.core.inputs import Inputs, distinct_names, inputs_now
from armimpedance.hand.still.show.options import ALL, ESTIMATE
from armimpedance.show.command.options import add_choice
from armimpedance.show.command.outputs import (
    FIGURE,
    TABLE,
    WITH_CHECKS,
    Output,
    add_figure,
    add_out,
    check_long,
    check_outputs,
    write_result,
)
from armimpedance.show.verbs.options import LEAVE_OUT

if TYPE_CHECKING:
    from armimpedance.core.findings import Finding
    from armimpedance.hand.show.estimates import Estimates
    from armimpedance.hand.still.show.verb import ComparedMethods


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("recordings", nargs="+", metavar="RECORDING", type=Path)
    add_out(parser, "the results", TABLE, long=True)
    add_figure(parser, "M, K and B of every group, and beside it motion and force of one trial")
    ESTIMATE.configure(parser)
    parser.add_argument(
        "--format",
        choices=("csv", "json", "parquet"),
        help="format of --out, which its ending says as well",
    )
    LEAVE_OUT.add(parser)
    add_choice(parser, "recordings", leave_out=False)


def run(arguments: argparse.Namespace) -> int:
    """Estimate, write the results, print a table."""
    _check(arguments)
    before = inputs_now(*arguments.recordings)
    together = arguments.method == ALL
    parts = [_of_recording(path, arguments, together) for path in arguments.recordings]
    estimates = _joined([part for part, _ in parts], arguments.recordings)
    write_result(estimates.content, arguments, _checks(arguments))
    if together:
        print("\n\n".join(text for _, text in parts), end="\n\n")
    else:
        from armimpedance.hand.show.text import summary_table

        print(summary_table(estimates))
    if arguments.out is not None:
        print(f"{'' if together else chr(10)}{len(estimates)} rows written to {arguments.out}")
    _draw(estimates, arguments, before)
    return 0


def _draw(estimates: Estimates, arguments: argparse.Namespace, before: Inputs) -> None:
    """Draw Figs 6 and 7 of Tsuji (1997) from these results; the former in a file of its own."""
    if arguments.figure is None:
        return
    from armimpedance.hand.still.show.plot import plot_estimates, plot_motion_and_force
    from armimpedance.hand.still.show.trials_plot import plot_fit
    from armimpedance.show.command.options import draw_picture
    from armimpedance.show.verbs.results import read_recording, without_trials

    method = estimates[0].method
    path, first = arguments.recordings[0], estimates[0]
    whole = read_recording(path, force_by=arguments.force_by)
    recording = without_trials(whole, arguments.leave_out)
    before.check()  # pictures and numbers are of one recording
    draw_picture(
        arguments,
        lambda: plot_estimates(estimates),
        f"Inertia, stiffness and viscosity of each group (method {method}) with 95 % intervals: "
        "ellipses where the hand was, or row by row, each to one scale, beside the elements of K.",
    )
    name = group_name({k: v for k, v in first.keys.items() if k != "recording"})
    if recording.perturbation == "stochastic":
        draw_picture(
            arguments,
            lambda: plot_fit(recording, first),
            f"Measured force and the force that M, B and K (method {method}) make of the motion, "
            f"{name}: the block of one second that they explain best (above) and worst (below).",
            "_motion",
        )
        return
    draw_picture(
        arguments,
        lambda: plot_motion_and_force(recording, first),
        f"Motion and force of one trial, {name}; dashed: the force that M, B and K (method "
        f"{method}) make of the motion. Offset and ramp are those of the fit.",
        "_motion",
    )


def _check(arguments: argparse.Namespace) -> None:
    """Refuse early what cannot succeed, and options without effect."""
    out, wanted = arguments.out, arguments.format
    figure = arguments.figure
    motion = None if figure is None else figure.with_name(f"{figure.stem}_motion{figure.suffix}")
    check_outputs(
        Output("--out", out, TABLE),
        Output("--figure", figure, FIGURE),
        Output("--figure", motion, FIGURE),
        reads=arguments.recordings,
    )
    check_long(arguments)
    distinct_names(arguments.recordings)
    if wanted is not None and out is None:
        raise InputError(f"--format {wanted} without --out", expected="a file to write")
    if wanted is not None and out.suffix != f".{wanted}":
        raise InputError(f"not what --format {wanted} says", file=out, expected=f"a .{wanted}")
    if arguments.seed and arguments.covariance != "bootstrap":
        problem = f"--seed with --covariance {arguments.covariance}: nothing is drawn"
        raise InputError(problem, expected="--covariance bootstrap")


def _checks(arguments: argparse.Namespace) -> tuple[Finding, ...]:
    """Findings of `inspect` on one recording, for the formats that can hold them."""
    out, paths = arguments.out, arguments.recordings
    if out is None or out.suffix not in WITH_CHECKS or len(paths) > 1:
        return ()
    from armimpedance.hand.still.show.gate import CHECKS
    from armimpedance.show.verbs.checks import findings_of
    from armimpedance.show.verbs.results import read_recording, without_trials

    whole = read_recording(paths[0], force_by=arguments.force_by)
    return tuple(findings_of(without_trials(whole, arguments.leave_out), CHECKS))


def _of_recording(
    path: Path, arguments: argparse.Namespace, together: bool
) -> tuple[Estimates, str]:
    """Estimates of one recording, and with --method all the table of methods."""
    from armimpedance.hand.still.show.verb import estimate, estimate_all
    from armimpedance.show.command.screen import bar

    keywords = {**ESTIMATE.keywords(arguments), "leave_out": arguments.leave_out}
    with bar(f"estimating {path.name}") as progress:
        if not together:
            return estimate(path, **keywords, progress=progress), ""
        of_all = {n: v for n, v in keywords.items() if n not in ("method", "band_hz")}
        if keywords["band_hz"] is not None:
            raise InputError("--band with --method all", expected="no band: disturbances return")
        compared: ComparedMethods = estimate_all(path, **of_all, progress=progress)
    title = f"{path.name}\n\n" if len(arguments.recordings) > 1 else ""
    return compared.estimates, f"{title}{compared}"


def _joined(parts: list[Estimates], paths: list[Path]) -> Estimates:
    """All estimates, with the recording's name among the keys if there are several recordings."""
    from dataclasses import replace

    from armimpedance.hand.show.estimates import Estimates

    if len(parts) == 1:
        return parts[0]
    named = [
        replace(e, keys={"recording": name, **e.keys})
        for part, name in zip(parts, distinct_names(paths), strict=True)
        for e in part
    ]
    return Estimates(tuple(named))
