"""The page of a fit, sentences of methods paragraphs, and references."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.metadata import version
from typing import Any, Final

import pandas as pd

from armimpedance.core.findings import Finding, checked_sentence
from armimpedance.core.shown import PARAMETER_HEADS
from armimpedance.numerics.regression import FitSummary, NamedParameter, parameter_rows
from armimpedance.show.pages.asked import Asked, page_from, reviewed
from armimpedance.show.pages.page import Block, Methods, Page, Section, Table

# Sentences that the methods paragraphs of all topics share.

#: Kind of covariance -> how a paper says it.
COVARIANCES: Final = {
    "cr3": "the jackknife over trials (CR3)",
    "replicates": "the spread of trials within each direction of disturbance",
    "cr1": "the sandwich covariance clustered by trial (CR1)",
    "bootstrap": "drawing trials with replacement",
}
CITED: Final = "armimpedance: impedance of the human arm, version {}."


def methods_of(
    sentences: Sequence[str], references: Sequence[str] = (), findings: Sequence[Finding] = ()
) -> Methods:
    """Whole sentences as one paragraph, what was checked at its end; the program is cited last.

    Parameters
    ----------
    sentences : sequence of str
        Without a full stop where they are to get one; empty ones are left out.
    references : sequence of str
        Each is listed once.
    findings : sequence of Finding

    Returns
    -------
    Methods
    """
    every = (*sentences, checked_sentence(findings))
    ended = [s if s.endswith((".", "!", "?")) else f"{s}." for s in every if s]
    cited = dict.fromkeys((*references, CITED.format(version("armimpedance"))))
    return Methods(" ".join(ended), tuple(cited))


def parameter_table(parameters: Sequence[NamedParameter], caption: str = "") -> Table:
    """Every parameter with its interval, and whether it is well identified.

    Parameters
    ----------
    parameters : sequence of NamedParameter
    caption : str
        Without it, what the columns are.

    Returns
    -------
    Table
        Its numbers are the page's data "parameters".
    """
    said = caption or (
        "Fitted parameters, ± half the 95 % interval. Well identified: twice the standard error "
        "is below 10 % of the value."
    )
    return Table(said, PARAMETER_HEADS, parameter_rows(parameters), "parameters")


def told_by(warnings: Sequence[str], checks: Sequence[Finding]) -> tuple[Finding, ...]:
    """The checks, and the other warnings as findings without a name.

    Parameters
    ----------
    warnings : sequence of str
    checks : sequence of Finding

    Returns
    -------
    tuple of Finding
    """
    sentences = {check.sentence for check in checks}
    return (*checks, *(Finding("", "warning", w) for w in warnings if w not in sentences))


def next_step(parameters: Sequence[NamedParameter]) -> str:
    """Advice if nothing is wrong: the data that the widest intervals would need."""
    loose = [one.label for one in parameters if not one.well_identified]
    if not loose:
        return "Every parameter is known to within 10 %: nothing more is needed."
    named = ", ".join(loose[:5]) + (f" and {len(loose) - 5} more" if len(loose) > 5 else "")
    are = "is" if len(loose) == 1 else "are"
    return f"{named} {are} not known to within 10 %: four times as much data halves an interval."


def fit_page(
    asked: Asked,
    summary: FitSummary,
    *,
    title: str,
    lead: str,
    pictures: Sequence[Block] = (),
    sections: Sequence[Section] = (),
    printed: str = "",
    methods: Sequence[str] = (),
    references: Sequence[str] = (),
    options: Sequence[tuple[str, Any]] = (),
    frames: dict[str, pd.DataFrame] | None = None,
    emg: bool = False,
) -> Page:
    """One fit as a page.

    Parameters
    ----------
    asked : Asked
    summary : FitSummary
        Method, parameters, warnings, checks.
    title, lead : str
    pictures : sequence of blocks
        What a reader sees first.
    sections : sequence of Section
        What the topic adds for a reviewer.
    printed : str
        The command's own text.
    methods, references : sequence of str
        Sentences of the methods paragraph, and what they cite.
    options : sequence of (str, value)
        What was chosen.
    frames : dict from str to DataFrame, optional
        Further data of the page.
    emg : bool
        Whether the fit uses the EMG: else checks of the EMG do not matter.

    Returns
    -------
    Page
    """
    own_names = {check.name for check in summary.checks}
    of_recording = (
        check
        for check in (asked.checks if emg else asked.checks_without_emg)
        if check.name not in own_names
    )
    told = told_by(summary.warnings, (*summary.checks, *of_recording))
    determined = [Section("What the data determine", (_conditions(summary),))]
    shown = [Section("Pictures", tuple(pictures))] if pictures else []
    return page_from(
        asked,
        told,
        title=title,
        lead=lead,
        count=f"{len(summary.parameters)} parameters from {summary.n} rows",
        next_step=next_step(summary.parameters),
        reader=(*shown, Section("Parameters", (parameter_table(summary.parameters),))),
        reviewer=(*sections, *determined, *reviewed(told, printed)),
        methods=methods_of(methods, references, told),
        options=[("method", summary.method), *options],
        data={"parameters": summary.to_frame().reset_index(), **(frames or {})},
    )


def _conditions(summary: FitSummary) -> Table:
    rows = (
        ("rows of the regression", str(summary.n)),
        ("rank", str(summary.rank)),
        ("condition of the columns, scaled", f"{summary.cond_scaled:.3g}"),
        ("condition of the columns as they are", f"{summary.cond_raw:.3g}"),
        ("R², which cannot see a wrong model", f"{summary.r2:.4f}"),
        ("variance accounted for", f"{100 * summary.vaf:.3g} %"),
    )
    return Table("The regression: a condition below 30 determines every column.", ("", ""), rows)


# The sources of the methods, as a list of references names them.

TSUJI: Final = "T. Tsuji, Human arm impedance in multi-joint movements (1997)."
VENTURE_ELBOW: Final = (
    "G. Venture and colleagues, In-vivo estimation of the human elbow joint dynamics during "
    "passive movements using musculo-skeletal model computations."
)
VENTURE_BODY: Final = "G. Venture, Dynamics identification of human-like systems (poster)."
RUIZ: Final = "A. F. Ruiz and colleagues (2011), on a powered elbow exoskeleton."
GUIDALI: Final = (
    "M. Guidali and colleagues, Estimating the patient's contribution during robot-assisted "
    "therapy (2013)."
)
