"""The methods paragraph that a file carries where nobody wrote another."""

from __future__ import annotations

from importlib.metadata import version
from typing import Final

from armimpedance.core.findings import checked_sentence
from armimpedance.show.files.sentences import of_one_cell, shared_steps
from armimpedance.show.files.written.content import Content

#: More steps than this stand in the sheet of the provenance only.
_MOST_STEPS: Final = 6


def software() -> str:
    """The program and its version."""
    return f"armimpedance {version('armimpedance')}"


def methods_paragraph(content: Content) -> str:
    """What was done, in sentences: program, methods, steps that all rows share, intervals, checks.

    Parameters
    ----------
    content : Content

    Returns
    -------
    str
    """
    methods = ", ".join(dict.fromkeys(str(r["method"]) for r in content.rows if r.get("method")))
    said = [f"The results were computed with {software()}"]
    said += [f"Method: {methods}"] if methods else []
    said += [f"{step[0].upper()}{step[1:]}" for step in _shared_steps(content)]
    if any(one.lower is not None for one in content.long):
        said.append("Intervals are 95 % intervals")
    said += [checked_sentence(content.about.checks)]
    return " ".join(s if s.endswith((".", "!", "?")) else f"{s}." for s in said if s)


def _shared_steps(content: Content) -> list[str]:
    """Steps of the provenance that every row has, in their order; none where there are many."""
    steps = [of_one_cell(str(row.get("provenance") or "")) for row in content.rows]
    return shared_steps(steps)[:_MOST_STEPS]
