"""Whether a reflex stands in the stiffness."""

from __future__ import annotations

from armimpedance.analyses import ReflexVerdicts, read_recording, reflex
from armimpedance.conventions import group_name
from armimpedance.findings import Finding
from armimpedance.pages.asked import Asked, made_from
from armimpedance.pages.methods_text import (
    checked_sentence,
    paragraph,
    software,
    software_reference,
)
from armimpedance.pages.page import Checks, Methods, Page, Printed, Section, Table
from armimpedance.pages.pictures import picture
from armimpedance.pages.topic import Topic
from armimpedance.pages.verdict import verdict_of
from armimpedance.plots import plot_reflex
from armimpedance.report import counted, headline, verdict_text


def page_of(asked: Asked) -> Page:
    """The page of the reflex guard.

    Parameters
    ----------
    asked : Asked

    Returns
    -------
    Page

    Raises
    ------
    InputError
        The recording cannot be read, or a check stops the analysis.
    """
    recording = read_recording(asked.recording)
    verdicts = reflex(
        recording, by=asked.by, seed=asked.seed, despite=asked.despite, progress=asked.progress
    )
    told = (*_findings(verdicts), *asked.checks)
    rows = tuple((group_name(v.keys), headline(v)) for v in verdicts)
    table = Table("One verdict a group", ("group", "verdict"), rows, "verdicts")
    drawn = plot_reflex(verdicts)[0, 0].figure
    return Page(
        title=f"Reflex: {asked.source.stem}",
        lead=f"{counted(recording.n_trials, 'trial')} in {counted(len(verdicts), 'group')}; "
        f"subject {recording.subject.id}.",
        verdict=verdict_of(
            told,
            "Take K as the limb's own, up to the reflex that would not have been seen.",
            counted(len(verdicts), "group"),
        ),
        reader=(
            Section("Verdicts", (table,)),
            Section(
                "Pictures",
                (
                    picture(
                        drawn,
                        "reflex",
                        "K over the end of the window that is fitted, and how well each delay "
                        "of a reflex explains the trials.",
                    ),
                ),
            ),
        ),
        reviewer=(
            Section("Checks", (Checks(told),)),
            Section("As the command prints it", (Printed(verdict_text(verdicts)),)),
        ),
        methods=Methods(
            paragraph(
                f"Whether a stretch reflex stands in the stiffness was judged with {software()}: "
                "M x'' + B x' + K x + R x(t - D) = -f was fitted beside the limb without R, over "
                "windows of growing length and delays D from 30 to 120 ms",
                "p values come from random signs of the residuals of whole trials, seed "
                f"{asked.seed}",
                checked_sentence(told),
            ),
            (software_reference(),),
        ),
        made=made_from(asked, [("groups by", ", ".join(asked.by)), ("seed", asked.seed)]),
        data={"verdicts": verdicts.to_frame()},
    )


def _findings(verdicts: ReflexVerdicts) -> tuple[Finding, ...]:
    """A reflex that was found, and one that cannot be told, as findings."""
    meaning = {"none": "ok", "contaminated": "warning", "unknown": "cannot tell"}
    return tuple(
        Finding("reflex", meaning[v.outcome], f"{group_name(v.keys)}: {headline(v)}")  # type: ignore[arg-type]
        for v in verdicts
    )


TOPIC = Topic("whether a reflex stands in the stiffness", page_of)
