"""Estimate inertia, viscosity and stiffness of every condition of one or more recordings.

Examples:
  armimpedance estimate session --out hand.csv
  armimpedance estimate session --by condition --by day --out hand_by_day.csv
  armimpedance estimate monday tuesday --method paper --out paper.csv
  armimpedance estimate session --method all --out every_method.csv
  armimpedance estimate session --out hand.json --format json

Each row holds M, B and K with standard errors and 95 % intervals clustered by trial, and size,
orientation and shape of their ellipses. M is the limb's own: the mass between force sensor and
hand (handle_mass_kg of the recording) is subtracted; M_with_handle is as measured.

--method all runs every method, prints them side by side, says why a method cannot run on this
recording, and which ones differ from the default by more than chance: an assumption that fails.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from armimpedance.records import ImpedanceEstimate, Recording


Made = TypeVar("Made")


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
        "--method",
        metavar="NAME",
        help="weighted (default), exact, paper, likelihood, instruments, weak_form, frequency, "
        "definite; or all, side by side",
    )
    parser.add_argument("--format", choices=("csv", "json"), default="csv")
    parser.add_argument(
        "--covariance",
        choices=("cr3", "replicates", "cr1", "bootstrap"),
        default="cr3",
        help="clustered by trial: cr3 = jackknife (default), replicates = within each direction, "
        "cr1 = sandwich, bootstrap = trials drawn with replacement",
    )
    parser.add_argument("--seed", type=int, default=0, help="of the bootstrap (default: 0)")
    parser.add_argument(
        "--workers", type=int, default=1, metavar="N", help="processes; same result (default: 1)"
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
    from armimpedance.cli.parts.checks import check_seed
    from armimpedance.report import summary_table

    check_seed(arguments.seed)
    if arguments.method == "all":
        return _run_all(arguments)
    estimates = []
    for path in arguments.recordings:
        estimates += _estimate_one(path, arguments)
    print(summary_table(estimates))
    if arguments.out is not None:
        _write(estimates, arguments)
    return 0


def _run_all(arguments: argparse.Namespace) -> int:
    """Every method side by side."""
    from armimpedance.impedance import DEFAULT_METHOD, side_by_side
    from armimpedance.report import methods_table

    estimates: list[ImpedanceEstimate] = []
    for path in arguments.recordings:
        compared = _on_recording(side_by_side, path, arguments)
        if len(arguments.recordings) > 1:
            print(f"{path.name}\n")
        print(methods_table(compared, DEFAULT_METHOD), end="\n\n")
        estimates += _named([e for side in compared for e in side.estimates], path, arguments)
    if arguments.out is not None:
        _write(estimates, arguments)
    return 0


def _estimate_one(path: Path, arguments: argparse.Namespace) -> list[ImpedanceEstimate]:
    from functools import partial

    from armimpedance.impedance import estimate

    with_workers = partial(estimate, workers=arguments.workers)
    return _named(_on_recording(with_workers, path, arguments), path, arguments)


def _on_recording(
    function: Callable[..., list[Made]], path: Path, arguments: argparse.Namespace
) -> list[Made]:
    """Apply `estimate` or `side_by_side`; errors name the recording."""
    from dataclasses import replace

    from armimpedance.cli.parts.progress import bar
    from armimpedance.errors import ArmImpedanceError, InputError
    from armimpedance.files import check_group_columns
    from armimpedance.impedance import DEFAULT_BY, Options

    recording = open_checked(path, arguments.force_by)
    options = Options(covariance=arguments.covariance, seed=arguments.seed)
    if arguments.method not in (None, "all"):
        options = replace(options, method=arguments.method)
    if arguments.band is not None:
        options = replace(options, band_hz=tuple(arguments.band))
    by = arguments.by or DEFAULT_BY
    check_group_columns(by)
    with bar(f"estimating {path.name}") as progress:
        try:
            return function(recording, by=by, options=options, progress=progress)
        except ArmImpedanceError as error:
            raise InputError(str(error), file=path) from error


def _named(
    estimates: list[ImpedanceEstimate], path: Path, arguments: argparse.Namespace
) -> list[ImpedanceEstimate]:
    """With the recording's name among the keys, where there are several."""
    from dataclasses import replace

    if len(arguments.recordings) == 1:
        return estimates
    return [replace(e, keys={"recording": path.name, **e.keys}) for e in estimates]


def open_checked(path: Path, force_by: str | None) -> Recording:
    """Open any recording; errors name the file."""
    from armimpedance.analyses import read_recording

    return read_recording(path, force_by=force_by)  # type: ignore[arg-type]


def _write(estimates: list[ImpedanceEstimate], arguments: argparse.Namespace) -> None:
    from armimpedance.files import write_results

    write_results(estimates, arguments.out)
    print(f"\n{len(estimates)} rows written to {arguments.out}")
