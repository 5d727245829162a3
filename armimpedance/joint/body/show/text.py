"""Identified bodies as text for a terminal."""

from __future__ import annotations

import textwrap

import numpy as np

from armimpedance.core.findings import warnings_of
from armimpedance.core.shown import percent, with_interval
from armimpedance.joint.body.result import BodyFit
from armimpedance.show.text import TABLE_WIDTH, aligned_table, checks_lines, short

#: Number of parameters shown on a screen; all are in FIT.json.
_SHOWN = 12


def body_text(fit: BodyFit) -> str:
    """The most important results, then the best known base parameters, as text.

    Returns: lines of at most 100 characters, except the notes.
    """
    order = np.argsort(fit.relative_sd_percent)[:_SHOWN]
    rows = []
    for i in order:
        parameter = fit.parameters[int(i)]
        value = with_interval(parameter.value, *parameter.ci95)
        relative_sd = percent(float(fit.relative_sd_percent[i]))
        rows.append([short(fit.base.expressions[i], 44), value, parameter.unit, relative_sd])
    table = aligned_table(("base parameter", "value (95 % interval)", "unit", "robust sd"), rows)
    more = fit.base.rank - len(rows)
    tail = f"\n(the best known; {more} more in FIT.json)" if more > 0 else ""
    warnings = {f"warning: {warning}" for warning in warnings_of(fit.checks)}
    first = [line for line in fit.lines if line not in warnings]
    lines = [textwrap.fill(t, TABLE_WIDTH, subsequent_indent="  ") for t in first]
    return "\n".join([*fit.notes, *lines, "", table + tail, *checks_lines(fit.checks)])
