"""Estimate inertia, viscosity and stiffness of every condition of one or more recordings.

Examples:
  armimpedance estimate session --out hand.csv
  armimpedance estimate session --by condition --by day --out hand_by_day.csv
  armimpedance estimate monday tuesday --method paper --out paper.csv
  armimpedance estimate session --out hand.json --format json

Each row holds M, B and K with standard errors and 95 % intervals clustered by trial, and size,
orientation and shape of their ellipses. M is the limb's own: the mass between force sensor and
hand (handle_mass_kg of the recording) is subtracted; M_with_handle is as measured.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from armimpedance.records import ImpedanceEstimate, Recording


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("recordings", nargs="+", metavar="RECORDING", type=Path)
    parser.add_argument("--out", type=Path, metavar="RESULTS", help="where the results go")
    parser.add_argument(
        "--by",
        action="append",
        metavar="COLUMN",
        help="group trials by this column of trials.csv; may be given again (default: condition)",
    )
    parser.add_argument(
        "--method", default="exact", metavar="NAME", help="exact (default) or paper"
    )
    parser.add_argument("--format", choices=("csv", "json"), default="csv")
    parser.add_argument(
        "--covariance",
        choices=("cr3", "replicates", "cr1"),
        default="cr3",
        help="clustered by trial: cr3 = jackknife (default), replicates = within each direction, "
        "cr1 = sandwich",
    )
    parser.add_argument(
        "--band",
        nargs=2,
        type=float,
        metavar=("LOW", "HIGH"),
        help="fitted band in Hz, for stochastic perturbations (default: 5 45)",
    )
    add_force_by(parser)


def add_force_by(parser: argparse.ArgumentParser) -> None:
    """The argument that settles the sign of a Kinarm exam's force sensor."""
    parser.add_argument(
        "--force-by",
        choices=("limb", "device"),
        help="Kinarm exams: whose force on the other the sensor's columns hold",
    )


def run(arguments: argparse.Namespace) -> int:
    """Estimate, print a table, write the results."""
    from armimpedance.report.text_table import summary_table

    estimates = []
    for path in arguments.recordings:
        estimates += _estimate_one(path, arguments)
    print(summary_table(estimates))
    if arguments.out is not None:
        _write(estimates, arguments)
    return 0


def _estimate_one(path: Path, arguments: argparse.Namespace) -> list[ImpedanceEstimate]:
    from dataclasses import replace

    from armimpedance.cli.progress import bar
    from armimpedance.errors import ArmImpedanceError, InputError
    from armimpedance.impedance.estimate import DEFAULT_BY, Options, estimate
    from armimpedance.report.result_row import check_group_columns

    recording = open_checked(path, arguments.force_by)
    options = Options(method=arguments.method, covariance=arguments.covariance)
    if arguments.band is not None:
        options = replace(options, band_hz=tuple(arguments.band))
    by = arguments.by or DEFAULT_BY
    check_group_columns(by)
    with bar(f"estimating {path.name}") as progress:
        try:
            estimates = estimate(recording, by=by, options=options, progress=progress)
        except ArmImpedanceError as error:
            raise InputError(str(error), file=path) from error
    if len(arguments.recordings) == 1:
        return estimates
    return [replace(e, keys={"recording": path.name, **e.keys}) for e in estimates]


def open_checked(path: Path, force_by: str | None) -> Recording:
    """Open any recording; errors name the file."""
    from armimpedance.recordings.convert import ReadOptions, open_recording

    return open_recording(path, ReadOptions(force_by=force_by))  # type: ignore[arg-type]


def _write(estimates: list[ImpedanceEstimate], arguments: argparse.Namespace) -> None:
    from armimpedance.report.results_csv import write_results, write_results_json

    write = write_results if arguments.format == "csv" else write_results_json
    write(estimates, arguments.out)
    print(f"\n{len(estimates)} rows written to {arguments.out}")
