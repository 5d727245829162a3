"""Compare groups of trials: what differs, by how much, and whether chance could have done it.

Examples:
  armimpedance compare session --by condition --out differences.csv --figure postures.png
  armimpedance compare session --by condition --against relaxed
  armimpedance compare monday tuesday --by recording
  armimpedance compare ann ben cem dee --by condition --subjects recording --out group.csv
  armimpedance compare hand.csv --by condition

From recordings, p values come from exchanging trials between the two groups, within each direction
of disturbance; from RESULTS.csv, which holds no trials, from the estimates' covariances. p is
reported for each matrix and for all three, and adjusted for the number of pairs (Holm). With
--subjects the result is the mean change over subjects and the spread between them.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from armimpedance.comparison import ComparedGroup, Pair, SubjectsChange
    from armimpedance.records import ImpedanceEstimate

Subjects = dict[str, "list[ComparedGroup]"]


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    from armimpedance.cli.estimate import add_force_by

    parser.add_argument("inputs", nargs="+", metavar="RECORDING|RESULTS.csv", type=Path)
    parser.add_argument(
        "--by",
        action="append",
        metavar="COLUMN",
        help="trials alike in this column form a group; may be given again (default: condition); "
        "'recording' keeps several recordings apart",
    )
    parser.add_argument("--against", metavar="GROUP", help="compare all groups with this one only")
    parser.add_argument(
        "--subjects",
        metavar="COLUMN",
        help="the column that tells subjects apart; 'recording' or 'subject' (the id in "
        "recording.json) where each has a recording of their own",
    )
    parser.add_argument("--method", metavar="NAME", help="estimator (default: as estimate)")
    parser.add_argument("--out", type=Path, metavar="DIFFERENCES.csv")
    parser.add_argument(
        "--figure", type=Path, metavar="PATH.png", help="ellipses where the hand was"
    )
    parser.add_argument(
        "--which",
        choices=("stiffness", "viscosity", "inertia"),
        default="stiffness",
        help="matrix that the figure shows",
    )
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="of the permutations")
    parser.add_argument(
        "--permutations",
        type=int,
        metavar="N",
        help="of each pair (default: 1999, more where there are many pairs)",
    )
    add_force_by(parser)


def run(arguments: argparse.Namespace) -> int:
    """Compare, print tables, write the differences and the figure."""
    _check(arguments)
    subjects = _subjects(arguments)
    if arguments.subjects is None:
        return _compare_groups(subjects[""], arguments)
    return _compare_subjects(subjects, arguments)


def _compare_groups(groups: list[ComparedGroup], arguments: argparse.Namespace) -> int:
    from armimpedance.cli.parts.progress import bar
    from armimpedance.comparison import compare
    from armimpedance.files import write_differences
    from armimpedance.report import comparison_text

    with bar("exchanging trials") as progress:
        pairs = compare(
            groups,
            against=arguments.against,
            permutations=arguments.permutations,
            seed=arguments.seed,
            progress=progress,
        )
    print(comparison_text(pairs))
    if arguments.out is not None:
        write_differences(pairs, arguments.out)
        print(f"\n{len(pairs)} pairs written to {arguments.out}")
    if arguments.figure is not None:
        _draw(groups, pairs, arguments)
    return 0


def _compare_subjects(subjects: Subjects, arguments: argparse.Namespace) -> int:
    from armimpedance.comparison import compare_subjects
    from armimpedance.files import write_subjects
    from armimpedance.report import subjects_text

    found: list[SubjectsChange] = compare_subjects(subjects, against=arguments.against)
    print(subjects_text(found))
    if arguments.out is not None:
        write_subjects(found, arguments.out)
        print(f"\n{len(found)} rows written to {arguments.out}")
    if arguments.figure is not None:
        everybody = [group for groups in subjects.values() for group in groups]
        _draw(everybody, [], arguments)
    return 0


def _check(arguments: argparse.Namespace) -> None:
    """Refuse before any work what cannot end well."""
    from armimpedance.cli.parts.checks import check_outputs, check_seed
    from armimpedance.errors import InputError
    from armimpedance.impedance import DEFAULT_METHOD, method_named

    method_named(arguments.method or DEFAULT_METHOD)
    if arguments.permutations is not None and arguments.permutations < 1:
        raise InputError(f"{arguments.permutations} permutations", expected="1 or more")
    check_seed(arguments.seed)
    check_outputs(figure=arguments.figure, out=arguments.out)
    for path in arguments.inputs:
        if not path.exists():
            raise InputError(
                "no such file or folder", file=path, expected="a recording or a RESULTS.csv"
            )


def _subjects(arguments: argparse.Namespace) -> Subjects:
    """The groups of every subject; without --subjects all under one empty name."""
    from armimpedance.errors import InputError

    tables = [path for path in arguments.inputs if path.is_file() and path.suffix == ".csv"]
    if not tables:
        return _of_recordings(arguments)
    if len(tables) < len(arguments.inputs):
        raise InputError(
            "recordings and results in one call", expected="only recordings, or only RESULTS.csv"
        )
    return _of_results(arguments)


def _of_results(arguments: argparse.Namespace) -> Subjects:
    from dataclasses import replace

    from armimpedance.comparison import groups_of_estimates, name_of
    from armimpedance.errors import InputError

    by, column = arguments.by or ["condition"], arguments.subjects
    sorted_out: dict[str, list[Any]] = {}
    for path in arguments.inputs:
        for found in _with_errors(path):
            keys = {"recording": path.stem, **found.keys}
            if column is not None and column not in keys:
                expected = f"one of {', '.join(keys)}"
                raise InputError("no such column", file=path, column=column, expected=expected)
            who = "" if column is None else name_of(keys, [column])
            sorted_out.setdefault(who, []).append(replace(found, keys=keys))
    return {who: groups_of_estimates(rows, by) for who, rows in sorted_out.items()}


def _with_errors(path: Path) -> list[ImpedanceEstimate]:
    from armimpedance.errors import InputError
    from armimpedance.files import read_results

    try:
        return read_results(path)
    except InputError as error:
        if error.problem == "no such column" and str(error.column).startswith("sd_"):
            raise InputError(
                "results without covariance: nothing says what chance alone would do",
                file=path,
                expected="the column covariance as `armimpedance estimate --out` writes it, or all "
                "of sd_M_ij, sd_B_ij, sd_K_ij",
            ) from error
        raise


def _of_recordings(arguments: argparse.Namespace) -> Subjects:
    by, column = arguments.by or ["condition"], arguments.subjects
    _check_kept_apart(arguments, by)
    found: Subjects = {}
    for path in arguments.inputs:
        groups = _groups_of(path, by if column is None else [*by, column], arguments)
        for who, group in _split(groups, by, column):
            found.setdefault(who, []).append(group)
    for who, groups in found.items():
        _check_single(who, groups)
    return found


def _groups_of(path: Path, by: list[str], arguments: argparse.Namespace) -> list[ComparedGroup]:
    from armimpedance.cli.estimate import open_checked
    from armimpedance.cli.parts.progress import bar
    from armimpedance.comparison import groups_of_recording
    from armimpedance.errors import ArmImpedanceError, InputError
    from armimpedance.impedance import Options

    recording = open_checked(path, arguments.force_by)
    options = Options(method=arguments.method) if arguments.method else Options()
    keys: dict[str, Any] = {"recording": path.name, "subject": recording.subject.id}
    # a column of the trial table says more than the recording does
    keys = {k: v for k, v in keys.items() if k in by and k not in recording.trials}
    with bar(f"estimating {path.name}") as progress:
        try:
            return groups_of_recording(recording, by, options=options, keys=keys, progress=progress)
        except ArmImpedanceError as error:
            raise InputError(str(error), file=path) from error


def _split(
    groups: list[ComparedGroup], by: list[str], column: str | None
) -> list[tuple[str, ComparedGroup]]:
    """Subject and group of each, the group named without its subject."""
    from dataclasses import replace

    from armimpedance.comparison import name_of

    if column is None:
        return [("", group) for group in groups]

    def keys(group: ComparedGroup) -> Mapping[str, Any]:
        return group.estimate.keys

    return [(name_of(keys(g), [column]), replace(g, name=name_of(keys(g), by))) for g in groups]


def _check_kept_apart(arguments: argparse.Namespace, by: list[str]) -> None:
    from armimpedance.errors import InputError

    apart = arguments.subjects is not None or "recording" in by or "subject" in by
    if len(arguments.inputs) > 1 and not apart:
        raise InputError(
            "several recordings",
            expected="--subjects recording for the mean over subjects, or --by recording to "
            "compare them with one another",
        )


def _check_single(who: str, groups: list[ComparedGroup]) -> None:
    from armimpedance.errors import InputError

    names = [group.name for group in groups]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise InputError(
            f"{f'subject {who}: ' if who else ''}several groups {twice}",
            expected="one: name further columns with --by",
        )


def _draw(groups: list[ComparedGroup], pairs: list[Pair], arguments: argparse.Namespace) -> None:
    from armimpedance.plots import plot_comparison, save

    axes = plot_comparison(groups, pairs, arguments.which)
    path: Path = arguments.figure
    figure = axes.figure
    written = save(figure, path.with_suffix(""), (path.suffix[1:],))  # type: ignore[arg-type]
    print(f"figure written to {written[0]}")
