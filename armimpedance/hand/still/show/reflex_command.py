"""Is the stiffness the limb's own, or does a reflex stand in it?

Examples:
  armimpedance reflex session
  armimpedance reflex session --by condition --out reflex.csv --figure reflex.png
  armimpedance reflex session --delay-ms 55

A stretch reflex answers a disturbance some tens of milliseconds late; a fit of M, B and K takes it
for stiffness, and the multiple correlation does not see it. The verdict of each group is one of:
no sign of a reflex (and how large one would have been seen); contaminated from about so many ms
after the onset (and by how much K is overstated); cannot be told. Delays from 30 to 120 ms are
scanned, unless one is given.
"""

from __future__ import annotations

from textwrap import fill
from typing import TYPE_CHECKING, Final

from armimpedance.hand.still.show.options import REFLEX
from armimpedance.show.command.verb import Command

if TYPE_CHECKING:
    from armimpedance.hand.still.show.reflex_verb import ReflexVerdicts


def _text(verdicts: ReflexVerdicts) -> str:
    """The verdicts, followed by the warnings of the checks."""
    from armimpedance.hand.still.show.text import verdict_text

    warnings = [fill(f"warning: {warning}", 100) for warning in verdicts.warnings]
    return "\n\n".join([verdict_text(verdicts), *warnings])


def _caption(verdicts: ReflexVerdicts) -> str:
    from armimpedance.hand.still.show.reflex_plot import MOST_GROUPS

    few = f" The {MOST_GROUPS} groups with the smallest p of {len(verdicts)}."
    return (
        "Left: principal values of K over the end of the fitted window with 95 % bands; with the "
        "reflex that was found, the intrinsic K dashed and the interval of the delay shaded. "
        "Right: log-likelihood ratio of a reflex of each delay against none."
        + (few if len(verdicts) > MOST_GROUPS else "")
    )


_COMMAND: Final = Command(
    REFLEX,
    progress="looking for reflexes",
    call="armimpedance.hand.still.show.reflex_verb:reflex",
    out="the verdicts, one row a group",
    text=_text,
    figure="K over the window's end, and the delay",
    draw="armimpedance.hand.still.show.reflex_plot:plot_reflex",
    caption=_caption,
    rows=len,
)
configure, run = _COMMAND.configure, _COMMAND.run
