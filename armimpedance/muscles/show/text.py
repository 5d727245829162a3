"""A fitted model as text for a terminal of 100 columns."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

import numpy as np

from armimpedance.core.shown import fixed
from armimpedance.muscles.models import ElementQuality, FittedModel
from armimpedance.show.text import aligned_table, checks_lines

_WIDTH = 100
_LEGEND = (
    "R is the correlation of measured and fitted values, E the sum of squared errors, in the "
    "rows' units squared; adj. R2 charges the fit for its coefficients; R left out is the "
    "correlation with predictions made without the row itself; R of noise is what the same fit "
    "reaches when the rows are shuffled. A fit whose R is not well above R of noise says nothing. "
    "Intervals take the errors of single rows as independent; what makes all rows wrong alike (a "
    "reflex, a force gain, lengths) is in them as far as the rows' shared_errors say."
)


def model_text(model: FittedModel) -> str:
    """Rank and condition, the quality of each element, warnings.

    Returns: lines of at most 100 characters.
    """
    s = model.summary
    head = (
        f"{s.method}: {s.n} numbers, rank {s.rank}, condition {_short(s.cond_scaled)} "
        f"(columns scaled), variance accounted for {fixed(100 * s.vaf, 1)} %"
    )
    notes = [textwrap.fill(f"- {w}", _WIDTH, subsequent_indent="  ") for w in s.warnings]
    parts = [textwrap.fill(head, _WIDTH), quality_table(model.quality)]
    checks = "\n".join(checks_lines(s.checks)).strip("\n")
    paragraphs = (part for part in (checks, "\n".join(notes)) if part)
    parts += [textwrap.fill(_LEGEND, _WIDTH), *paragraphs]
    return "\n\n".join(parts)


def quality_table(quality: Sequence[ElementQuality]) -> str:
    """One row per element: R and E as the source prints them, and what they are worth."""
    header = ["element", "R", "E", "adj. R2", "R left out", "R of noise"]
    return aligned_table(header, [_row(q) for q in quality])


def _row(q: ElementQuality) -> list[str]:
    judged = (_or_dash(v) for v in (q.adjusted_r2, q.leave_one_out_r, q.null_r))
    return [q.element, fixed(q.r, 3), _short(q.e), *judged]


def _or_dash(value: float) -> str:
    return fixed(value, 3) if np.isfinite(value) else "-"


def _short(value: float) -> str:
    return f"{value:.4g}"
