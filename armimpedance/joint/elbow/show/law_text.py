"""Laws of stiffness and viscosity over EMG as text."""

from __future__ import annotations

import textwrap

from armimpedance.joint.elbow.emg.law_result import EmgLaw, LinearLaw, OperatingPoints
from armimpedance.show.text import (
    TABLE_WIDTH,
    aligned_table,
    checks_lines,
    fixed,
    numbered_notes,
    with_half_width,
    with_interval,
)

_HEADER = ("", "value (95 % interval)", "unit", "least squares", "attenuation")
_LEGEND = (
    "Errors of the amplitudes are accounted for; least squares, beside it, takes them as exact and "
    "flattens the slopes by the attenuation. Amplitudes are parts of the maximum contraction."
)


def law_text(law: EmgLaw) -> str:
    """Notes, the points, a table of each law, warnings.

    Parameters
    ----------
    law : EmgLaw

    Returns
    -------
    str
    """
    blocks = [textwrap.fill(n, TABLE_WIDTH, subsequent_indent="  ") for n in law.notes]
    if law.points is not None:
        blocks += ["", _points_table(law.points)]
    for one in law.laws:
        blocks += ["", _law_table(one)]
    blocks += checks_lines(law.checks)
    return "\n".join([*blocks, "", *numbered_notes([*law.warnings, _LEGEND])])


def _law_table(one: LinearLaw) -> str:
    rows = [
        [p.name, with_interval(p.value, *p.ci95), p.unit, f"{naive:.4g}", fixed(part, 2)]
        for p, naive, part in zip(one.parameters, one.naive, one.attenuation, strict=True)
    ]
    head = (
        f"{one.symbol} over EMG: {one.n} points, R^2 {one.r2:.3f}, scatter beyond the stated "
        f"errors {one.scatter:.2g} {one.unit}, condition {one.cond_scaled:.3g}"
    )
    return f"{head}\n{aligned_table(_HEADER, rows)}"


def _points_table(given: OperatingPoints) -> str:
    points, muscles, indexed = given.to_dict(), given.muscles, given.imcj is not None
    header = ["trial", *(f"{m} (%)" for m in muscles), "K", "B"] + ["IMCJ (N m)"] * indexed
    rows = []
    for p in points:
        cells = [fixed(100 * p["amplitude"][m], 1) for m in muscles]
        cells += [with_half_width(p[s], 2 * p[f"sd_{s}"]) for s in "KB"]
        if indexed:
            cells.append(with_half_width(p["imcj_Nm"], 2 * p["sd_imcj_Nm"]))
        rows.append([str(p["trial"]), *cells])
    return aligned_table(header, rows)
