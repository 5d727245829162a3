"""Page of inertia, viscosity and stiffness of the hand, group by group."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import pandas as pd

from armimpedance.core.conventions import MATRICES, UNITS, group_name
from armimpedance.core.errors import ArmImpedanceError, InputError
from armimpedance.core.findings import Finding
from armimpedance.core.program import software
from armimpedance.core.records import ImpedanceEstimate, Recording
from armimpedance.core.shown import with_half_width
from armimpedance.hand.comparison.show import differences_of
from armimpedance.hand.ellipses import FIELDS
from armimpedance.hand.reaching.show import NAGAR, is_moving, moving_sentences
from armimpedance.hand.show.estimates import Estimates, read_results
from armimpedance.hand.show.quantities import condition_of, half_widths
from armimpedance.hand.show.results_csv import is_results_file
from armimpedance.hand.still.methods import METHODS
from armimpedance.hand.still.show.linked import ellipse_numbers, ellipse_outlines, linked_ellipses
from armimpedance.hand.still.show.linked_trials import linked_trials, trial_data
from armimpedance.hand.still.show.quality_plot import plot_quality
from armimpedance.hand.still.show.session_plot import plot_session
from armimpedance.hand.still.show.trials_plot import plot_fit, plot_residuals
from armimpedance.hand.still.show.verb import estimate, estimate_all
from armimpedance.show.files import read_left_out, shared_steps
from armimpedance.show.pages import (
    COVARIANCES,
    TSUJI,
    Asked,
    Block,
    Methods,
    Page,
    Printed,
    Section,
    Table,
    Topic,
    methods_of,
    page_from,
    picture,
    reviewed,
)
from armimpedance.show.text import counted
from armimpedance.show.verbs.results import read_recording

#: Columns of a results file that are not shown on a page.
_LEFT_OUT: Final = ("covariance", "shared_errors", "provenance")
#: Fewest trials for a picture of the course over a session.
_COURSE: Final = 24
_CHECKED: Final = "Each check says the smallest violation that it would have seen."


def page_of(asked: Asked) -> Page:
    """Build the page of a session with disturbances, or of a RESULTS file."""
    if is_results_file(asked.source):
        return of_estimates(asked, read_results(asked.source), None)
    recording = read_recording(asked.recording)
    return of_estimates(asked, _estimates(asked, recording), recording)


def _estimates(asked: Asked, recording: Recording) -> Estimates:
    options: dict[str, Any] = {
        "by": asked.by,
        "covariance": asked.covariance,
        "seed": asked.seed,
        "despite": asked.despite,
        "progress": asked.progress,
    }
    method = None if asked.method == "all" else asked.method
    return estimate(recording, method=method, **options)


def of_estimates(
    asked: Asked,
    estimates: Estimates,
    recording: Recording | None,
) -> Page:
    """Build the page of estimates of the hand or of joints.

    Parameters
    ----------
    asked : Asked
    estimates : Estimates
        Of two axes or more, all of one level.
    recording : Recording or None
        Source of the estimates, if it is known.

    Returns
    -------
    Page
    """
    findings = (*asked.checks, *_of_estimates(estimates, asked.checks))
    level = estimates[0].level
    data: dict[str, pd.DataFrame] = {
        "results": estimates.to_frame().drop(columns=list(_LEFT_OUT), errors="ignore"),
        "outlines": ellipse_outlines(estimates),
        "ellipses": ellipse_numbers(estimates),
    }
    if recording is not None:
        data["trials"], data["courses"] = trial_data(
            recording, {condition_of(estimate): estimate.keys for estimate in estimates}
        )
    used = dict.fromkeys(e.method for e in estimates)
    return page_from(
        asked,
        findings,
        title=f"Impedance of the {'hand' if level == 'hand' else 'joints'}",
        lead=_lead(recording, estimates),
        count=f"{counted(len(estimates), 'group')}, {_trials(estimates)} trials",
        next_step=_next_step(estimates),
        reader=(
            Section("Ellipses", (linked_ellipses(estimates, "outlines", "ellipses"),)),
            Section("Estimates", tuple(_tables(estimates))),
            *filter(None, [differences_of(estimates, asked.by)]),
        ),
        reviewer=(
            *_reviewed(asked, estimates, recording, data.get("trials")),
            *reviewed(findings, caption=_CHECKED),
        ),
        methods=_methods(asked, estimates, recording, findings),
        options=_options(asked, tuple(used)),
        data=data,
    )


def _trials(estimates: Sequence[ImpedanceEstimate]) -> int:
    # rows of a course over time (`movement --course`) come from the same trials
    counts: dict[str, int] = {}
    for row, e in enumerate(estimates):
        of_course = str(e.keys.get("phase", "")).endswith(" s")
        rest = {k: v for k, v in e.keys.items() if k != "phase"}
        counts[group_name(rest) if of_course else f"row {row}"] = e.quality.n_trials
    return sum(counts.values())


def _of_estimates(
    estimates: Sequence[ImpedanceEstimate], findings: Sequence[Finding]
) -> tuple[Finding, ...]:
    """Warnings of the fits that the recording does not have already, each with its groups."""
    known = {finding.sentence for finding in findings}
    groups: dict[str, list[str]] = {}
    for e in estimates:
        for warning in e.warnings:
            if warning not in known:
                groups.setdefault(warning, []).append(condition_of(e))
    return tuple(
        Finding("", "warning", f"{warning} ({_some(names, len(estimates))})")
        for warning, names in groups.items()
    )


def _some(names: Sequence[str], every: int) -> str:
    if len(names) == every and every > 1:
        return "all groups"
    return ", ".join(names[:4]) + (f" and {len(names) - 4} more" if len(names) > 4 else "")


def _lead(recording: Recording | None, estimates: Sequence[ImpedanceEstimate]) -> str:
    if recording is None:
        return f"{counted(len(estimates), 'group')} of trials, read from a file of results."
    return (
        f"{counted(recording.n_trials, 'trial')} at {recording.sample_rate_hz:g} Hz, "
        f"{counted(len(estimates), 'group')}; subject {recording.subject.id}."
    )


def _next_step(estimates: Sequence[ImpedanceEstimate]) -> str:
    """Sentence on the widest interval of stiffness, and the trials needed to halve it."""
    halves = [half_widths(e)[2].max() / max(abs(e.stiffness).max(), 1e-12) for e in estimates]
    widest = max(range(len(halves)), key=halves.__getitem__)
    return (
        f"The widest interval of K is that of {condition_of(estimates[widest])}, "
        f"± {100 * halves[widest]:.2g} % of its largest element: four times as many trials would "
        "halve it."
    )


def _tables(estimates: Sequence[ImpedanceEstimate]) -> list[Block]:
    """One table for each matrix, stiffness first: value and half-width of every element."""
    return [
        _table(estimates, which, MATRICES[which][0], i)
        for i, which in reversed(list(enumerate(FIELDS)))
    ]


def _table(estimates: Sequence[ImpedanceEstimate], which: str, symbol: str, row: int) -> Table:
    unit = UNITS[estimates[0].level][symbol]
    k = estimates[0].k
    names = [f"{symbol}_{i + 1}{j + 1}" for i in range(k) for j in range(k)]
    rows = []
    for e in estimates:
        values, halves = getattr(e, which).ravel(), half_widths(e)[row].ravel()
        cells = [with_half_width(float(v), float(h)) for v, h in zip(values, halves, strict=True)]
        rows.append((condition_of(e), str(e.quality.n_trials), *cells))
    return Table(
        caption=f"{which.capitalize()} {symbol} ({unit}), ± half the 95 % interval",
        columns=("group", "trials", *names),
        rows=tuple(rows),
        numbers="results",
        chooses=True,
    )


def _reviewed(
    asked: Asked,
    estimates: Estimates,
    recording: Recording | None,
    trials: pd.DataFrame | None,
) -> tuple[Section, ...]:
    """Sections on trials, fits, identifiability, and on request the methods side by side."""
    determined = Section("What the data determine", (_quality_table(estimates),))
    if recording is None or trials is None:
        return (determined,)
    sections = [*_drawn(recording, estimates, trials), determined, *_left(asked, estimates)]
    if asked.method == "all":
        sides = estimate_all(recording, by=asked.by, seed=asked.seed, despite=asked.despite)
        sections.append(Section("Methods side by side", (Printed(str(sides)),)))
    return tuple(sections)


def _drawn(recording: Recording, estimates: Estimates, trial_table: pd.DataFrame) -> list[Section]:
    """Pictures of all trials, the session's quality, and the fit of the worst fitted group."""
    worst = min(estimates, key=lambda estimate: estimate.quality.vaf)
    name = condition_of(worst)
    quality = picture(
        plot_quality(recording),
        "quality",
        "The session: all trials aligned, those that are unlike the others marked, return to the "
        "start, noise at rest, force against motion.",
    )
    fit = picture(
        plot_fit(recording, worst),
        "fit",
        f"Measured and fitted force of the best and the worst trial of {name}, the group with the "
        "most unexplained variance.",
    )
    left = picture(
        plot_residuals(recording, worst), "residuals", f"Residuals of {name} and their spectrum."
    )
    trials = linked_trials(recording, trial_table, "trials", "courses")
    return [
        Section("Trials", (trials, quality, *_over_session(recording))),
        Section("Fit and residuals", (fit, left)),
    ]


def _over_session(recording: Recording) -> tuple[Block, ...]:
    """Picture of M and K over the session, if there are enough trials."""
    if recording.perturbation != "returning" or recording.n_trials < _COURSE:
        return ()
    try:
        drawn = plot_session(recording)
    except InputError:
        return ()
    caption = (
        "Inertia M and stiffness K of blocks of trials in the order of the session, as parts of "
        "the whole session's, with 95 % intervals. M does not change while one person is measured "
        "with one rig."
    )
    return (picture(drawn, "session", caption),)


def _left(asked: Asked, estimates: Estimates) -> list[Section]:
    """Table of stiffness with and without the trials left out by hand."""
    if asked.leave_out is None or asked.whole is None:
        return []
    title = "Left out by hand"
    try:
        all_estimates = _estimates(asked, asked.whole)
    except ArmImpedanceError as error:
        # what a check refuses may be the very reason for leaving trials out
        return [Section(title, (Printed(f"With these trials nothing can be estimated: {error}"),))]
    with_all = {condition_of(e): e for e in all_estimates}
    rows = [
        (
            condition_of(e),
            str(whole.quality.n_trials - e.quality.n_trials),
            *_cells(e, whole),
        )
        for e in estimates
        if (whole := with_all[condition_of(e)]).quality.n_trials != e.quality.n_trials
    ]
    names = [f"{name} {which}" for name in ("K_11", "K_22") for which in ("without", "with")]
    caption = f"Trials of {asked.leave_out.name} were left out by hand: K without and with them"
    return [Section(title, (Table(caption, ("group", "trials", *names), tuple(rows)),))]


def _cells(estimate: ImpedanceEstimate, whole: ImpedanceEstimate) -> list[str]:
    return [
        with_half_width(float(e.stiffness[i, i]), float(half_widths(e)[2, i, i]))
        for i in (0, estimate.k - 1)
        for e in (estimate, whole)
    ]


def _quality_table(estimates: Sequence[ImpedanceEstimate]) -> Table:
    """Rank, condition and correlation of every fit."""
    rows = []
    for e in estimates:
        q = e.quality
        least = e.efficiency
        efficiency = "-" if least is None else f"{100 * least.min():.0f} %"
        rows.append(
            (
                condition_of(e),
                f"{q.rank} of {3 * e.k}",
                f"{q.cond_scaled:.3g}",
                f"{q.multiple_correlation:.4f}",
                f"{100 * (1 - q.vaf):.2g} %",
                efficiency,
            )
        )
    heads = ("rank", "condition", "correlation", "unexplained variance", "least efficiency")
    caption = (
        "Rank and condition of the regression: full rank and a condition below 30 say that every "
        "element is determined. The correlation cannot see a wrong model. Efficiency: the "
        "Cramer-Rao bound over the variance that was found."
    )
    return Table(caption, ("group", *heads), tuple(rows))


def _methods(
    asked: Asked,
    estimates: Sequence[ImpedanceEstimate],
    recording: Recording | None,
    findings: Sequence[Finding],
) -> Methods:
    names = list(dict.fromkeys(e.method for e in estimates))
    known = [METHODS[name] for name in names if name in METHODS]
    groups = counted(len(estimates), "group")
    dof = ", ".join(sorted({f"{e.dof:.0f}" for e in estimates}, key=float)[:3])
    moving = is_moving(estimates)
    posture = (
        f"Inertia M, viscosity B and stiffness K were estimated from {_trials(estimates)} "
        f"disturbances in {groups} with {software()}, as M x'' + B x' + K x = -f, where x is the "
        "displacement from rest and f the change of the force that the limb exerts on the device",
        *(f"Estimator: {name} ({METHODS[name].reference})" for name in names if name in METHODS),
    )
    sentences = [
        *(moving_sentences(estimates, _trials(estimates)) if moving else posture),
        *map(_as_sentence, shared_steps([e.provenance for e in estimates])),
        f"Intervals are 95 % intervals of the t distribution ({dof} degrees of freedom), their "
        f"standard errors from {COVARIANCES.get(asked.covariance, asked.covariance)}"
        if recording is not None
        else "Intervals are 95 % intervals of the t distribution, as the file holds them",
        _left_out_sentence(asked),
    ]
    cited = [NAGAR] if moving else [TSUJI, *(m.reference for m in known)]
    return methods_of(sentences, cited, findings)


def _left_out_sentence(asked: Asked) -> str:
    if asked.leave_out is None:
        return ""
    return (
        f"{counted(len(read_left_out(asked.leave_out)), 'trial')} that somebody looked at and "
        "judged no answer to the disturbance were left out"
    )


def _as_sentence(step: str) -> str:
    return f"{step[0].upper()}{step[1:]}" if step else ""


def _options(asked: Asked, methods: Sequence[str]) -> list[tuple[str, Any]]:
    return [
        ("groups by", ", ".join(asked.by)),
        ("method", ", ".join(methods)),
        ("covariance", asked.covariance),
        ("seed", asked.seed),
        ("force by", asked.force_by),
        ("despite", ", ".join(asked.despite)),
        ("left out", None if asked.leave_out is None else asked.leave_out.name),
    ]


TOPIC = Topic("inertia, viscosity and stiffness of the hand", page_of)
