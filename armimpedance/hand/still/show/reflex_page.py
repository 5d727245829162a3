"""Page of the reflex guard: does the stiffness contain a reflex?"""

from __future__ import annotations

from armimpedance.core.conventions import group_name
from armimpedance.core.findings import Finding
from armimpedance.core.program import software
from armimpedance.hand.still.show.reflex_plot import plot_reflex
from armimpedance.hand.still.show.reflex_verb import ReflexVerdicts, reflex
from armimpedance.hand.still.show.text import headline, verdict_text
from armimpedance.show.pages import (
    Asked,
    Page,
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


def _sentences(seed: int) -> list[str]:
    return [
        f"Whether a stretch reflex stands in the stiffness was judged with {software()}: "
        "M x'' + B x' + K x + R x(t - D) = -f was fitted beside the limb without R, over "
        "windows of growing length and delays D from 30 to 120 ms",
        f"p values come from random signs of the residuals of whole trials, seed {seed}",
    ]


def page_of(asked: Asked) -> Page:
    """Build the page of the reflex guard."""
    recording = read_recording(asked.recording)
    verdicts = reflex(
        recording, by=asked.by, seed=asked.seed, despite=asked.despite, progress=asked.progress
    )
    findings = (*_findings(verdicts), *asked.checks)
    rows = tuple((group_name(v.keys), headline(v)) for v in verdicts)
    table = Table("One verdict a group", ("group", "verdict"), rows, "verdicts")
    drawn = plot_reflex(verdicts)[0, 0].figure
    return page_from(
        asked,
        findings,
        title="Reflex",
        lead=f"{counted(recording.n_trials, 'trial')} in {counted(len(verdicts), 'group')}; "
        f"subject {recording.subject.id}.",
        count=counted(len(verdicts), "group"),
        next_step="Take K as the limb's own, up to the reflex that would not have been seen.",
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
        reviewer=reviewed(findings, verdict_text(verdicts)),
        methods=methods_of(_sentences(asked.seed), findings=findings),
        options=[("groups by", ", ".join(asked.by)), ("seed", asked.seed)],
        data={"verdicts": verdicts.to_frame()},
    )


def _findings(verdicts: ReflexVerdicts) -> tuple[Finding, ...]:
    """Verdicts as findings."""
    meaning = {"none": "ok", "contaminated": "warning", "unknown": "cannot tell"}
    return tuple(
        Finding("reflex", meaning[v.outcome], f"{group_name(v.keys)}: {headline(v)}")  # type: ignore[arg-type]
        for v in verdicts
    )


TOPIC = Topic("whether a reflex stands in the stiffness", page_of)
