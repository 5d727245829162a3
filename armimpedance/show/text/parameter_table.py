"""The table of a fit's parameters, as every command prints it."""

from __future__ import annotations

from collections.abc import Sequence

from armimpedance.numerics.regression import NamedParameter
from armimpedance.show.text.numbers import aligned_table, percent, with_interval


def parameter_table(parameters: Sequence[NamedParameter], plain_sd: str) -> str:
    """Value with interval, unit, both standard errors in per cent, and the source's verdict.

    Parameters
    ----------
    parameters : sequence of NamedParameter
    plain_sd : str
        Heading of `NamedParameter.sd`.
    """
    header = ("", "value (95 % interval)", "unit", plain_sd, "robust sd", "well identified")
    rows = [
        [
            p.name,
            with_interval(p.value, *p.ci95),
            p.unit,
            percent(p.relative_sd_percent),
            percent(100 * p.sd_robust / abs(p.value)) if p.value else "-",
            "yes" if p.well_identified else "no",
        ]
        for p in parameters
    ]
    return aligned_table(header, rows)
