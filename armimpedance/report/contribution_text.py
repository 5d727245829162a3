"""The patient's contribution as text for a terminal: a row a movement, then means."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

import numpy as np

from armimpedance.report.numbers import (
    TABLE_WIDTH,
    aligned_table,
    fixed,
    note_numbers,
    numbered_notes,
)
from armimpedance.therapy import Contribution

_HEADER = (
    *("trial", "condition", "movement", "share (95 %)", "projection", "ratio (4)"),
    *("reference (19)", "notes"),
)
_MEANS_HEADER = (
    *("condition", "movement", "n", "share (%)", "projection", "ratio (4)", "reference (19)"),
)
_LEGEND = (
    "Per cent: 0 is a passive arm, 100 one that needs no support, below 0 one that resists. share: "
    "of the passive arm's torque in the person's, whatever of the robot's own inertia the person "
    "moved beside; projection: the same without that allowance. ± is a standard error; in [ ]: not "
    "valid, see the notes. The interval is for what the same formula gives with the true torques "
    "of this movement."
)
_MEANS_LEGEND = "Means are over movements, valid values only, ± sd between them."


def contribution_text(results: Sequence[Contribution]) -> str:
    """All movements, then conditions by their means."""
    notes = list(dict.fromkeys(note for r in results for note in r.notes))
    table = aligned_table(_HEADER, [_row(r, notes) for r in results])
    means = aligned_table(_MEANS_HEADER, _means(results))
    legend = textwrap.fill(f"{_LEGEND} {_MEANS_LEGEND}", TABLE_WIDTH)
    return "\n".join([table, "", means, "", *numbered_notes(notes), legend])


def _row(r: Contribution, notes: Sequence[str]) -> list[str]:
    share = f"{_number(r.share_percent)} ({' to '.join(map(_number, r.share_ci95))})"
    return [
        r.trial,
        r.condition,
        r.movement,
        share if r.share_valid else f"[{share}]",
        _marked(r.projection_percent, r.projection_sd, r.projection_valid),
        _marked(r.ratio_percent, r.ratio_sd, r.ratio_valid),
        _marked(r.reference_percent, r.reference_sd, r.reference_valid),
        note_numbers(r.notes, notes),
    ]


def _marked(value: float | None, sd: float | None, valid: bool) -> str:
    if value is None or not np.isfinite(value):
        return "-"
    shown = f"{_number(value)} ± {_number(sd)}"
    return shown if valid else f"[{shown}]"


def _number(value: float | None) -> str:
    if value is None or not np.isfinite(value):
        return "?"
    return fixed(value, 1 if abs(value) < 200 else 0)


def _means(results: Sequence[Contribution]) -> list[list[str]]:
    rows = []
    for key in dict.fromkeys((r.condition, r.movement) for r in results):
        own = [r for r in results if (r.condition, r.movement) == key]
        columns = (
            [r.share_percent for r in own if r.share_valid],
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
