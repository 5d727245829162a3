"""The verb `compare`: groups of trials of one person, or changes over several persons."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from textwrap import fill
from typing import Any

from armimpedance.core.arrays import FrozenRecord
from armimpedance.core.errors import InputError
from armimpedance.core.findings import Finding, warnings_of
from armimpedance.core.inputs import distinct_names
from armimpedance.core.progress import Progress
from armimpedance.core.records import ImpedanceEstimate, Recording
from armimpedance.core.shown import html_table
from armimpedance.hand.comparison.compare import compare as compare_groups
from armimpedance.hand.comparison.groups import (
    ComparedGroup,
    Pair,
    check_inertia,
    groups_of_estimates,
    groups_of_recording,
    name_of,
)
from armimpedance.hand.comparison.show.options import COMPARE
from armimpedance.hand.comparison.show.table import COMPARED, comparison_content
from armimpedance.hand.comparison.show.text import comparison_text, subjects_text
from armimpedance.hand.comparison.subjects import SubjectsChange, compare_subjects
from armimpedance.hand.show.estimates import ForceBy, estimates_of
from armimpedance.hand.show.results_csv import is_results_file
from armimpedance.hand.still import Options, in_step
from armimpedance.hand.still.show import checked_response
from armimpedance.show.files import Content, WrittenResult
from armimpedance.show.text import TABLE_WIDTH, checks_lines
from armimpedance.show.verbs.results import (
    PathLike,
    as_columns,
    naming,
    read_recording,
)

# Result of `compare`: changes and tests as a table and text.


@dataclass(frozen=True, repr=False, eq=False)
class Comparison(WrittenResult, FrozenRecord):
    """Differences between groups of trials, and their significance.

    Attributes
    ----------
    groups : tuple of ComparedGroup
        All groups of all subjects.
    pairs : sequence of Pair
        Pairs of groups with their changes and tests; empty if changes are means over subjects.
    over_subjects : tuple of SubjectsChange
        Mean changes over subjects and the spread between them; empty otherwise.
    warnings : tuple of str
        Warnings of the recordings' checks; each row of the table is marked with them.
    checks : tuple of Finding
        Checks of the groups against each other, with their detection limits.

    Examples
    --------
    >>> import armimpedance as ai
    >>> from manipulandum_sim.hand import simulate
    >>> levels = ["cocontraction_10", "cocontraction_30"]
    >>> session, _ = simulate("cocontraction", seed=1, sets=2, conditions=levels)
    >>> difference = ai.compare(session, permutations=99)
    >>> sorted(difference.to_frame()["matrix"].unique())
    ['all', 'inertia', 'stiffness', 'viscosity']
    """

    DESCRIBED = COMPARED

    groups: tuple[ComparedGroup, ...]
    pairs: Sequence[Pair] = ()
    over_subjects: tuple[SubjectsChange, ...] = ()
    warnings: tuple[str, ...] = ()
    checks: tuple[Finding, ...] = ()

    @property
    def content(self) -> Content:
        """The rows and columns of DIFFERENCES.csv, marked with the warnings of checks."""
        return comparison_content(self.pairs, self.over_subjects, self.warnings, self.checks)

    def to_dict(self) -> list[dict[str, Any]]:
        """One mapping per row of DIFFERENCES.csv."""
        return [dict(row) for row in self.content.rows]

    def __str__(self) -> str:
        """The tables that ``armimpedance compare`` prints."""
        subjects = self.over_subjects
        tables = subjects_text(subjects) if subjects else comparison_text(self.pairs)
        warnings = [fill(f"warning: {text}", TABLE_WIDTH) for text in self.warnings]
        seen = [check for check in self.checks if check.verdict == "ok"]
        return "\n\n".join([tables, *warnings, *("\n".join(checks_lines(seen)),) * bool(seen)])

    def _table(self) -> list[list[str]]:
        rows = [
            [f"{pair.first} | {pair.second}", *(f"{t.p_t2_adjusted:.3g}" for t in pair.tests)]
            for pair in self.pairs[:9]
        ]
        rows += [
            [f"{c.first} | {c.second}", f"{c.p_adjusted:.3g}"]
            for c in self.over_subjects
            if (c.matrix, c.quantity) == ("stiffness", "size")
        ]
        count = len(self.pairs) or len(rows)
        rest = [["...", f"{count - 9} more"]] if count > 9 else []
        heads = ["M", "B", "K", "all"] if self.pairs else ["size of K"]
        return [["adjusted p", *heads], *rows[:9], *rest]

    def __repr__(self) -> str:
        return "\n".join(f"{first}: {', '.join(others)}" for first, *others in self._table())

    def _repr_html_(self) -> str:
        table = self._table()
        return html_table([row + [""] * (len(table[0]) - len(row)) for row in table])


#: Input of a comparison: trials, or estimates without their trials.
Source = Recording | Sequence[ImpedanceEstimate] | PathLike
#: The groups of every subject; under one empty name if subjects are not distinguished.
Subjects = dict[str, list[ComparedGroup]]


@COMPARE.function
def compare(
    inputs: Source | Sequence[Source] | Mapping[str, Source],
    *,
    by: str | Sequence[str] = "condition",
    against: str | None = None,
    subjects: str | None = None,
    method: str | None = None,
    permutations: int | None = None,
    seed: int = 0,
    force_by: ForceBy | None = None,
    despite: str | Collection[str] = (),
    progress: Progress | None = None,
) -> Comparison:
    """Compare groups of trials pair by pair, or their changes over several subjects.

    From recordings, p values come from exchanging trials between two groups, within each direction
    of disturbance; from results, which hold no trials, from the estimates' covariances.

    Parameters
    ----------
    inputs : recording, results or path, or a sequence or mapping of them
        All recordings, or all results (`Estimates`, or the path of a RESULTS.csv). The key of a
        mapping is the recording's name; a path's name is that of its file.
    {options}
    progress : function (done, all), optional
        Called after each group that is estimated, then after each pair.

    Returns
    -------
    Comparison
        The groups and the differences of their pairs, or the mean changes over the subjects.

    Raises
    ------
    InputError
        An input cannot be read, a check of `inspect` says STOP, recordings and results are mixed,
        a column is missing, there are fewer than two groups or subjects, or an option has no effect
        on these inputs.
    NotIdentifiableError
        The motion of a group does not determine its parameters.

    Examples
    --------
    >>> from armimpedance.hand.comparison.show import compare
    >>> from manipulandum_sim.hand import simulate
    >>> conditions = ["cocontraction_10", "cocontraction_30"]
    >>> recording, _ = simulate("cocontraction", seed=1, sets=2, conditions=conditions)
    >>> difference = compare(recording, permutations=99)
    >>> difference.pairs[0].second
    'cocontraction_30'
    """
    if permutations is not None and subjects is not None:
        raise InputError(
            "permutations have no effect where subjects are told apart",
            expected="none: the spread between subjects decides",
        )
    named = _named(inputs)
    columns, reading = as_columns(by), None
    if not any(_is_results(source) for _, source in named):
        reading = _Reading(columns, subjects, method, force_by, despite, progress)
        groups_by_subject = reading.of_recordings(named)
    else:
        _check_results(named, method, force_by)
        groups_by_subject = _of_results(named, columns, subjects)
    all_groups = tuple(group for groups in groups_by_subject.values() for group in groups)
    warnings = () if reading is None else tuple(dict.fromkeys(reading.marks))
    if subjects is not None:
        changes = tuple(compare_subjects(groups_by_subject, against=against))
        return Comparison(all_groups, over_subjects=changes, warnings=warnings)
    pairs = compare_groups(
        groups_by_subject[""],
        against=against,
        permutations=permutations,
        seed=seed,
        progress=progress,
    )
    checks = check_inertia(all_groups, pairs)
    return Comparison(all_groups, pairs, warnings=(*warnings, *warnings_of(checks)), checks=checks)


def _named(inputs: Source | Sequence[Source] | Mapping[str, Source]) -> list[tuple[str, Source]]:
    """The inputs with the names of their recordings."""
    if isinstance(inputs, Mapping):
        return [(str(name), source) for name, source in inputs.items()]
    sources: Sequence[Any] = (inputs,) if _is_one(inputs) else inputs  # type: ignore[assignment]
    for source in sources if isinstance(sources, Sequence) else (sources,):
        if not _is_one(source):
            raise TypeError(
                f"got {type(source).__name__}: recordings, results or paths are expected"
            )
    if not sources:
        raise InputError("nothing to compare", expected="recordings or results")
    named = iter(_names_of([Path(s) for s in sources if isinstance(s, str | os.PathLike)]))
    return [
        (next(named) if isinstance(source, str | os.PathLike) else f"recording {number}", source)
        for number, source in enumerate(sources, start=1)
    ]


def _names_of(paths: Sequence[Path]) -> list[str]:
    """Distinct names of files and folders, for results without their suffix."""
    for path in paths:
        if not path.exists():
            raise InputError(
                "no such file or folder", file=path, expected="a recording or a RESULTS.csv"
            )
    whole = distinct_names(paths)
    short = [
        n.rsplit(".", 1)[0] if _is_results(p) else n for n, p in zip(whole, paths, strict=True)
    ]
    return short if len(set(short)) == len(short) else whole


def _is_one(inputs: object) -> bool:
    """True if this is a single source, not a sequence of sources."""
    return isinstance(inputs, str | os.PathLike | Recording) or _is_results(inputs)


def _is_results(source: object) -> bool:
    """True if this is a RESULTS.csv or a sequence of estimates."""
    if isinstance(source, str | os.PathLike):
        return is_results_file(source)
    return (
        isinstance(source, Sequence)
        and len(source) > 0
        and all(isinstance(item, ImpedanceEstimate) for item in source)
    )


def _check_results(
    named: Sequence[tuple[str, Source]], method: str | None, force_by: ForceBy | None
) -> None:
    if not all(_is_results(source) for _, source in named):
        raise InputError(
            "recordings and results in one call", expected="only recordings, or only RESULTS.csv"
        )
    if method is not None or force_by is not None:
        option = "method" if method is not None else "force_by"
        raise InputError(
            f"{option} has no effect on results, which are estimated already",
            expected="recordings, or none",
        )


def _of_results(
    named: Sequence[tuple[str, Source]], by: Sequence[str], column: str | None
) -> Subjects:
    sorted_out: dict[str, list[ImpedanceEstimate]] = {}
    for name, source in named:
        file = source if isinstance(source, str | os.PathLike) else None
        for estimate in _results(source):
            keys = {"recording": name, **estimate.keys}
            if column is not None and column not in keys:
                expected = f"one of {', '.join(keys)}"
                raise InputError("no such column", file=file, column=column, expected=expected)
            who = "" if column is None else name_of(keys, [column])
            sorted_out.setdefault(who, []).append(replace(estimate, keys=keys))
    return {who: groups_of_estimates(rows, by) for who, rows in sorted_out.items()}


def _results(source: Any) -> Sequence[ImpedanceEstimate]:
    try:
        return estimates_of(source)
    except InputError as error:
        if error.problem == "no such column" and str(error.column).startswith("sd_"):
            raise InputError(
                "results without covariance: nothing says what chance alone would do",
                file=source,
                expected="the column covariance as `armimpedance estimate --out` writes it, or all "
                "of sd_M_ij, sd_B_ij, sd_K_ij",
            ) from error
        raise


@dataclass(frozen=True)
class _Reading:
    """Reader of groups from recordings; `marks` collects the messages of their checks."""

    by: tuple[str, ...]
    column: str | None
    method: str | None
    force_by: ForceBy | None
    despite: str | Collection[str]
    progress: Progress | None
    marks: list[str] = field(default_factory=list)

    def of_recordings(self, named: Sequence[tuple[str, Any]]) -> Subjects:
        """Groups of every subject; without a column of subjects all under one empty name."""
        apart = self.column is not None or "recording" in self.by or "subject" in self.by
        if len(named) > 1 and not apart:
            raise InputError(
                "several recordings",
                expected="--subjects recording for the mean over subjects, or --by recording to "
                "compare them with one another",
            )
        groups_by_subject: Subjects = {}
        for name, source in named:
            for who, group in self._split(self._groups(name, source)):
                groups_by_subject.setdefault(who, []).append(group)
        for who, groups in groups_by_subject.items():
            _check_single(who, groups)
        return groups_by_subject

    def _groups(self, name: str, source: Recording | PathLike) -> list[ComparedGroup]:
        by = self.by if self.column is None else (*self.by, self.column)
        with naming(source):
            recording = read_recording(source, force_by=self.force_by)
            if self.method is not None and recording.perturbation == "stochastic":
                raise InputError(
                    "a method has no effect on stochastic perturbations",
                    column="perturbation",
                    expected="no method, or disturbances that return",
                )
            marks = checked_response(recording, self.despite, by=by)
            self.marks.extend(f"{name}: {mark}" for mark in marks)
            recording, _ = in_step(recording)
            options = Options() if self.method is None else Options(method=self.method)
            keys: dict[str, Any] = {"recording": name, "subject": recording.subject.id}
            # a column of the trial table takes precedence over the recording
            keys = {k: v for k, v in keys.items() if k in by and k not in recording.trials}
            groups = groups_of_recording(
                recording, by, options=options, keys=keys, progress=self.progress
            )
            return [replace(group, estimate=group.estimate.marked(marks)) for group in groups]

    def _split(self, groups: Sequence[ComparedGroup]) -> Iterator[tuple[str, ComparedGroup]]:
        """Yield subject and group of each group; the group is named without its subject."""
        for group in groups:
            if self.column is None:
                yield "", group
            else:
                keys = group.estimate.keys
                yield name_of(keys, [self.column]), replace(group, name=name_of(keys, self.by))


def _check_single(who: str, groups: Sequence[ComparedGroup]) -> None:
    names = [group.name for group in groups]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise InputError(
            f"{f'subject {who}: ' if who else ''}several groups {twice}",
            expected="one: name further columns with --by",
        )
