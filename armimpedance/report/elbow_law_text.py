"""Laws of stiffness and viscosity over EMG, as text and for FIT.json."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

from armimpedance.elbow import EmgLaw, LinearLaw
from armimpedance.regression import FitSummary
from armimpedance.report.numbers import (
    TABLE_WIDTH,
    aligned_table,
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


def _laws(law: EmgLaw) -> list[LinearLaw]:
    return [law.stiffness] if law.viscosity is None else [law.stiffness, law.viscosity]


def law_text(law: EmgLaw, points: Sequence[Mapping[str, Any]], notes: Sequence[str] = ()) -> str:
    """Notes, the points, a table of each law, warnings."""
    blocks = [textwrap.fill(n, TABLE_WIDTH, subsequent_indent="  ") for n in notes]
    blocks += ["", _points_table(points)]
    for one in _laws(law):
        blocks += ["", _law_table(one)]
    return "\n".join([*blocks, "", *numbered_notes([*law.warnings, _LEGEND])])


def _law_table(one: LinearLaw) -> str:
    columns = zip(
        one.names, one.coefficients, one.interval(), one.naive, one.attenuation, strict=True
    )
    rows = [
        [name, with_interval(value, low, high), one.unit, f"{naive:.4g}", fixed(part, 2)]
        for name, value, (low, high), naive, part in columns
    ]
    head = (
        f"{one.symbol} over EMG: {one.n} points, R^2 {one.r2:.3f}, scatter beyond the stated "
        f"errors {one.scatter:.2g} {one.unit}, condition {one.cond_scaled:.3g}"
    )
    return f"{head}\n{aligned_table(_HEADER, rows)}"


def _points_table(points: Sequence[Mapping[str, Any]]) -> str:
    muscles = list(points[0]["amplitude"])
    indexed = "imcj_Nm" in points[0]
    header = ["trial", *(f"{m} (%)" for m in muscles), "K", "B"] + ["IMCJ (Nm)"] * indexed
    rows = []
    for p in points:
        cells = [fixed(100 * p["amplitude"][m], 1) for m in muscles]
        cells += [with_half_width(p[s], 2 * p[f"sd_{s}"]) for s in "KB"]
        if indexed:
            cells.append(with_half_width(p["imcj_Nm"], 2 * p["sd_imcj_Nm"]))
        rows.append([str(p["trial"]), *cells])
    return aligned_table(header, rows)


def law_summary(law: EmgLaw) -> FitSummary:
    """The contract's fields: parameters ``k0, k_<flexor>, k_<extensor>`` and the same of B."""
    laws = _laws(law)
    return FitSummary(
        method="emg-law",
        n=law.stiffness.n,
        cond_raw=law.stiffness.cond_raw,
        cond_scaled=law.stiffness.cond_scaled,
        rank=len(law.stiffness.coefficients),
        r2=law.stiffness.r2,
        vaf=law.stiffness.r2,
        parameters=tuple(p for one in laws for p in one.parameters),
        warnings=law.warnings,
    )


def law_object(
    law: EmgLaw, points: Sequence[Mapping[str, Any]], notes: Sequence[str]
) -> dict[str, Any]:
    """What stands in FIT.json beside the contract's fields."""
    return {
        "laws": [
            {
                "symbol": one.symbol,
                "least_squares": one.naive,
                "attenuation": one.attenuation,
                "scatter": one.scatter,
                "r2": one.r2,
                "reliability": one.reliability,
                "covariance": one.covariance,
                "amplitudes": {"lowest": one.lowest, "highest": one.highest},
            }
            for one in _laws(law)
        ],
        "points": list(points),
        "notes": list(notes),
    }
