"""Text of the next pushes for a terminal of 100 columns."""

from __future__ import annotations

import textwrap

import numpy as np

from armimpedance.hand.adaptive.next_trials import NextTrials
from armimpedance.hand.adaptive.order import Push
from armimpedance.show.text import aligned_table

_WIDTH = 100
_TARGETS = ("what", "by now", "wished", "after the rest")
_PUSHES = ("push", "condition", "direction", "course", "s", "mm", "pause, s")


def next_text(made: NextTrials) -> str:
    """State of each requirement, the remaining numbers, and the next pushes.

    Parameters
    ----------
    made : NextTrials

    Returns
    -------
    str
        Lines of at most 100 characters if conditions have short names.
    """
    notes = [textwrap.fill(f"Note: {text}", _WIDTH) for text in made.warnings]
    parts = [_targets(made), *notes, _head(made), _pushes(made)]
    return "\n\n".join(part for part in parts if part)


def _targets(made: NextTrials) -> str:
    rows = []
    for target, now, then in zip(made.targets, made.now, made.then, strict=True):
        wished = target.allowed / target.scale
        cells = (f"{wished * part:.3g} {target.unit}" for part in (now, 1.0, then))
        rows.append([target.name, *cells])
    return aligned_table(_TARGETS, rows) if rows else ""


def _head(made: NextTrials) -> str:
    if made.met and made.detected:
        return "The wish is met: the difference is detected (5 %, however often it was asked for)."
    if made.met:
        return "The wish is met: all intervals are as narrow as was asked."
    left = ", ".join(f"{count} of {name}" for name, count in made.remaining.items() if count)
    if not made.targets:
        text = f"Too few pushes yet to choose any. First: {left}, along all directions."
    elif made.enough:
        text = f"Pushes that remain: {left}."
    else:
        text = (
            f"Not met after {sum(made.remaining.values())} more pushes ({left}), by what the "
            "trials show so far. Ask again after the next ones; where it stays so, allow a longer "
            "push, more acceleration or more trials, or ask for less."
        )
    return textwrap.fill(text, _WIDTH)


def _pushes(made: NextTrials) -> str:
    rows = [_row(number, push) for number, push in enumerate(made.pushes, 1)]
    return aligned_table(_PUSHES, rows) if rows else ""


def _row(number: int, push: Push) -> list[str]:
    if len(push.direction) == 2:
        way = f"{push.direction_deg:.1f} deg"
    else:
        way = " ".join(f"{u:+.2f}" for u in np.asarray(push.direction))
    return [
        str(number),
        push.condition,
        way,
        push.profile.shape.name,
        f"{push.profile.duration_s:.3g}",
        f"{1e3 * push.profile.amplitude_m:.3g}",
        f"{push.pause_s:.1f}",
    ]
