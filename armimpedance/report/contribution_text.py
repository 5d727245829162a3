"""The patient's contribution as text for a terminal: a row a movement, then means."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from armimpedance.contribution.metric import Contribution
from armimpedance.report.numbers import aligned_table, fixed, note_numbers, numbered_notes

_HEADER = (
    *("trial", "condition", "movement", "projection (%)", "95 %", "ratio (4)", "|sum|/sum|.|"),
    *("reference (19)", "notes"),
)
_MEANS_HEADER = ("condition", "movement", "n", "projection", "ratio (4)", "reference (19)")
_LEGEND = (
    "0 % is a passive arm, 100 % one that needs no support, below 0 one that resists. ± is a "
    "standard error. In brackets: not valid, see the notes. The interval is for what the same "
    "formula gives with the true torques of this movement."
)
_MEANS_LEGEND = "Means over movements, valid values only, ± sd between them."


def contribution_text(results: Sequence[Contribution]) -> str:
    """All movements, then conditions by their means."""
    notes = list(dict.fromkeys(note for r in results for note in r.notes))
    rows = [_row(r, notes) for r in results]
    means = aligned_table(_MEANS_HEADER, _means(results))
    return "\n".join(
        [
            aligned_table(_HEADER, rows),
            "",
            means,
            "",
            *numbered_notes(notes),
            _LEGEND,
            _MEANS_LEGEND,
        ]
    )


def _row(r: Contribution, notes: Sequence[str]) -> list[str]:
    low, high = r.projection_ci95
    return [
        r.trial,
        r.condition,
        r.movement,
        _marked(r.projection_percent, r.projection_sd, r.projection_valid),
        f"{_number(low)} to {_number(high)}",
        _marked(r.ratio_percent, r.ratio_sd, r.ratio_valid),
        f"{r.sum_ratio:.2f}",
        _marked(r.reference_percent, r.reference_sd, r.reference_valid),
        note_numbers(r.notes, notes),
    ]


def _marked(value: float | None, sd: float | None, valid: bool) -> str:
    if value is None or not np.isfinite(value):
        return "-"
    shown = f"{_number(value)} ± {_number(sd)}"
    return shown if valid else f"({shown})"


def _number(value: float | None) -> str:
    if value is None or not np.isfinite(value):
        return "?"
    return fixed(value, 1 if abs(value) < 1000 else 0)


def _means(results: Sequence[Contribution]) -> list[list[str]]:
    rows = []
    for key in dict.fromkeys((r.condition, r.movement) for r in results):
        own = [r for r in results if (r.condition, r.movement) == key]
        columns = (
            [r.projection_percent for r in own if r.projection_valid],
            [r.ratio_percent for r in own if r.ratio_valid],
            [r.reference_percent for r in own if r.reference_valid],
        )
        rows.append([*key, str(len(own)), *(_mean(c) for c in columns)])
    return rows


def _mean(values: Sequence[float | None]) -> str:
    known = np.array([v for v in values if v is not None])
    if len(known) == 0:
        return "-"
    sd = f" ± {_number(float(known.std(ddof=1)))}" if len(known) > 1 else ""
    return f"{_number(float(known.mean()))}{sd}"
