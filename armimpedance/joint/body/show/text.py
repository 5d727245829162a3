"""Identified bodies as text for a terminal."""

from __future__ import annotations

import textwrap

import numpy as np

from armimpedance.core.findings import warnings_of
from armimpedance.core.shown import percent, with_interval
from armimpedance.joint.body.result import BodyFit
from armimpedance.show.text import TABLE_WIDTH, aligned_table, checks_lines, short

#: Parameters shown on a screen; all stand in FIT.json.
_SHOWN = 12


def body_text(fit: BodyFit) -> str:
    """What a person reads first, then the best known base parameters.

    Returns: lines of at most 100 characters but for the notes.
    """
    order = np.argsort(fit.relative_sd_percent)[:_SHOWN]
    rows = []
    for i in order:
        one = fit.parameters[int(i)]
        value = with_interval(one.value, *one.ci95)
        known = percent(float(fit.relative_sd_percent[i]))
        rows.append([short(fit.base.expressions[i], 44), value, one.unit, known])
    table = aligned_table(("base parameter", "value (95 % interval)", "unit", "robust sd"), rows)
    more = fit.base.rank - len(rows)
    tail = f"\n(the best known; {more} more in FIT.json)" if more > 0 else ""
    told = {f"warning: {said}" for said in warnings_of(fit.checks)}
    first = [line for line in fit.lines if line not in told]
    lines = [textwrap.fill(t, TABLE_WIDTH, subsequent_indent="  ") for t in first]
    return "\n".join([*fit.notes, *lines, "", table + tail, *checks_lines(fit.checks)])
