"""The patient's contribution as text for a terminal: a row a movement, then means."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from armimpedance.joint.therapy.share.result import Contribution
from armimpedance.show.text import TABLE_WIDTH, aligned_table, fixed, note_numbers, numbered_notes

_HEADER = (
    *("trial", "condition", "movement", "share (95 %)", "projection", "ratio (4)"),
    *("reference (19)", "notes"),
)
_MEANS_HEADER = (
    *("condition", "movement", "n", "share (%)", "projection", "ratio (4)", "reference (19)"),
)
_METRICS: Final = ("share", "projection", "ratio", "reference")
_LEGEND = (
    "Per cent: 0 is a passive arm, 100 one that needs no support, below 0 one that resists. share: "
    "of the passive arm's torque in the person's, whatever of the robot's own inertia the person "
    "moved beside; projection: the same without that allowance. ± is a standard error; in [ ]: not "
    "valid, see the notes. The interval is for what the same formula gives with the true torques "
    "of this movement."
)
_MEANS_LEGEND = "Means are over movements, valid values only, ± sd between them."


def contribution_text(results: Sequence[Contribution]) -> str:
    """All movements, then conditions by their means.

    Parameters
    ----------
    results : sequence of Contribution
        Contributions of all movements.

    Returns
    -------
    str
    """
    notes = list(dict.fromkeys(note for r in results for note in r.notes))
    table = aligned_table(_HEADER, [_row(r, notes) for r in results])
    means = aligned_table(_MEANS_HEADER, _means(results))
    legend = textwrap.fill(f"{_LEGEND} {_MEANS_LEGEND}", TABLE_WIDTH)
    return "\n".join([table, "", means, "", *numbered_notes(notes), legend])


def _row(r: Contribution, notes: Sequence[str]) -> list[str]:
    share = f"{_number(r.share.percent)} ({' to '.join(map(_number, r.share.ci95))})"
    return [
        r.trial,
        r.condition,
        r.movement,
        share if r.share.valid else f"[{share}]",
        *(_marked(told) for told in (r.projection, r.ratio, r.reference)),
        note_numbers(r.notes, notes),
    ]


def _marked(told: Any) -> str:
    """A metric or the reference with its standard error; in brackets where it is not valid."""
    if told is None or not np.isfinite(told.percent):
        return "-"
    shown = f"{_number(told.percent)} ± {_number(told.sd)}"
    return shown if told.valid else f"[{shown}]"


def _number(value: float) -> str:
    if not np.isfinite(value):
        return "?"
    return fixed(value, 1 if abs(value) < 200 else 0)


def _means(results: Sequence[Contribution]) -> list[list[str]]:
    rows = []
    for key in dict.fromkeys((r.condition, r.movement) for r in results):
        own = [r for r in results if (r.condition, r.movement) == key]
        columns = ((getattr(r, name) for r in own) for name in _METRICS)
        values = ([told.percent for told in c if told and told.valid] for c in columns)
        rows.append([*key, str(len(own)), *map(_mean, values)])
    return rows


def _mean(values: Sequence[float]) -> str:
    known = np.array(values)
    if len(known) == 0:
        return "-"
    sd = f" ± {_number(float(known.std(ddof=1)))}" if len(known) > 1 else ""
    return f"{_number(float(known.mean()))}{sd}"
