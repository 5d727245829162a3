"""Groups of trials compared with one another, within one person or over several."""

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

# What `compare` returns: changes and tests as a table, a figure and text.


@dataclass(frozen=True, repr=False, eq=False)
class Comparison(WrittenResult, FrozenRecord):
    """What differs between groups of trials, and whether chance could have done it.

    Attributes
    ----------
    groups : tuple of ComparedGroup
        All groups, of all subjects.
    pairs : sequence of Pair
        Pairs of groups with their changes and tests; empty where subjects were told apart.
    over_subjects : tuple of SubjectsChange
        Mean changes over subjects and the spread between them; empty otherwise.
    warnings : tuple of str
        What the checks of the recordings said; each row of the table is marked with them.
    checks : tuple of Finding
        What holds the groups against each other, with the smallest change it would have seen.

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
        """The rows and columns of DIFFERENCES.csv, marked where checks warned."""
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
        left = [["...", f"{count - 9} more"]] if count > 9 else []
        heads = ["M", "B", "K", "all"] if self.pairs else ["size of K"]
        return [["adjusted p", *heads], *rows[:9], *left]

    def __repr__(self) -> str:
        return "\n".join(f"{first}: {', '.join(others)}" for first, *others in self._table())

    def _repr_html_(self) -> str:
        table = self._table()
        return html_table([row + [""] * (len(table[0]) - len(row)) for row in table])


#: What is compared: trials, or estimates without their trials.
Source = Recording | Sequence[ImpedanceEstimate] | PathLike
#: The groups of every subject; of one empty name where subjects are not told apart.
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
        found = reading.of_recordings(named)
    else:
        _check_results(named, method, force_by)
        found = _of_results(named, columns, subjects)
    everybody = tuple(group for groups in found.values() for group in groups)
    warnings = () if reading is None else tuple(dict.fromkeys(reading.marks))
    if subjects is not None:
        changes = tuple(compare_subjects(found, against=against))
        return Comparison(everybody, over_subjects=changes, warnings=warnings)
    pairs = compare_groups(
        found[""], against=against, permutations=permutations, seed=seed, progress=progress
    )
    checks = check_inertia(everybody, pairs)
    return Comparison(everybody, pairs, warnings=(*warnings, *warnings_of(checks)), checks=checks)


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
    """Names of files and folders that tell them apart, of results without their suffix."""
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
    """Whether this is one source, and not a sequence of them."""
    return isinstance(inputs, str | os.PathLike | Recording) or _is_results(inputs)


def _is_results(source: object) -> bool:
    """Whether this is a RESULTS.csv or a sequence of estimates."""
    if isinstance(source, str | os.PathLike):
        return is_results_file(source)
    return (
        isinstance(source, Sequence)
        and len(source) > 0
        and all(isinstance(one, ImpedanceEstimate) for one in source)
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
    """How groups are made of recordings; `marks` fills with what their checks say."""

    by: tuple[str, ...]
    column: str | None
    method: str | None
    force_by: ForceBy | None
    despite: str | Collection[str]
    progress: Progress | None
    marks: list[str] = field(default_factory=list)

    def of_recordings(self, named: Sequence[tuple[str, Any]]) -> Subjects:
        """The groups of every subject; without a column of subjects all under one empty name."""
        apart = self.column is not None or "recording" in self.by or "subject" in self.by
        if len(named) > 1 and not apart:
            raise InputError(
                "several recordings",
                expected="--subjects recording for the mean over subjects, or --by recording to "
                "compare them with one another",
            )
        found: Subjects = {}
        for name, source in named:
            for who, group in self._split(self._groups(name, source)):
                found.setdefault(who, []).append(group)
        for who, groups in found.items():
            _check_single(who, groups)
        return found

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
            # a column of the trial table says more than the recording does
            keys = {k: v for k, v in keys.items() if k in by and k not in recording.trials}
            groups = groups_of_recording(
                recording, by, options=options, keys=keys, progress=self.progress
            )
            return [replace(each, estimate=each.estimate.marked(marks)) for each in groups]

    def _split(self, groups: Sequence[ComparedGroup]) -> Iterator[tuple[str, ComparedGroup]]:
        """Subject and group of each, the group named without its subject."""
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
