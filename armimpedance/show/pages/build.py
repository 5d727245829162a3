"""How a page is put together: what stands on the pages of all topics, and where."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from armimpedance.core.findings import Finding
from armimpedance.show.pages.asked import Asked, made_from
from armimpedance.show.pages.page import Checks, Methods, Page, Printed, Section
from armimpedance.show.pages.verdict import verdict_of

if TYPE_CHECKING:
    import pandas as pd


def page_from(
    asked: Asked,
    findings: Sequence[Finding],
    *,
    title: str,
    lead: str,
    count: str,
    next_step: str,
    reader: Sequence[Section],
    reviewer: Sequence[Section],
    methods: Methods,
    options: Sequence[tuple[str, Any]] = (),
    data: Mapping[str, pd.DataFrame] | None = None,
) -> Page:
    """A page whose verdict follows from the findings, and that says how it was made.

    Parameters
    ----------
    asked : Asked
    findings : sequence of Finding
        All checks, of the data and of the fits.
    title : str
        What is reported; the names of the sources follow it.
    lead : str
    count, next_step : str
        See `verdict_of`.
    reader, reviewer : sequence of Section
    methods : Methods
    options : sequence of (str, value)
        See `made_from`.
    data : mapping from a name to a DataFrame, optional

    Returns
    -------
    Page
    """
    return Page(
        title=f"{title}: {', '.join(path.stem for path in asked.sources)}",
        lead=lead,
        verdict=verdict_of(findings, next_step, count),
        reader=tuple(reader),
        reviewer=tuple(reviewer),
        methods=methods,
        made=made_from(asked, options),
        data=data or {},
    )


def reviewed(findings: Sequence[Finding], printed: str = "", caption: str = "") -> list[Section]:
    """The checks with their caption, and the command's own text: each where there is any."""
    checks = [Section("Checks", (Checks(tuple(findings), caption),))] if findings else []
    text = [Section("As the command prints it", (Printed(printed),))] if printed else []
    return checks + text
