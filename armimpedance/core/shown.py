"""Display of fitted numbers: rounded by their uncertainty, and one table for all outputs.

Pages and notebooks show this table; a workbook holds the same numbers in full.
"""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from math import floor, isfinite, log10
from typing import Final

#: Most digits shown; no property of an arm is known better.
_MOST_DIGITS: Final = 6
#: Heads of the table of fitted numbers.
PARAMETER_HEADS: Final = ("parameter", "value", "95 %", "unit", "well identified")


def _decimals(half_width: float, value: float) -> int:
    """Decimals that show two digits of the half-width (negative: round to tens, hundreds).

    A value with half-width 0 or unknown gets four digits.
    """
    largest = floor(log10(abs(value))) if value else 0
    if not (isfinite(half_width) and half_width > 0):
        return 3 - largest
    # Through "e" format, so that 0.0996 counts as 0.10.
    exponent = int(f"{half_width:.1e}".partition("e")[2])
    return min(1 - exponent, _MOST_DIGITS - 1 - max(largest, exponent))


def fixed(value: float, decimals: int) -> str:
    """Return the value rounded to these decimals, without a sign on zero."""
    text = f"{round(value, decimals):.{max(decimals, 0)}f}"
    return text.removeprefix("-") if not any(c in text for c in "123456789") else text


def with_half_width(value: float, half_width: float) -> str:
    """``104.8 ± 9.1``: both with the same decimals, two digits of the half-width.

    Parameters
    ----------
    value : float
        The estimated value.
    half_width : float
        Half-width of its interval, in the same unit.

    Returns
    -------
    str
        Value and half-width; a question mark stands for an unknown half-width, a dash for no value.
    """
    if not isfinite(value):
        return "-"
    decimals = _decimals(half_width, value)
    if not isfinite(half_width):
        return f"{fixed(value, decimals)} ± ?"
    shown = fixed(half_width, decimals)
    if half_width > 0 and float(shown) == 0:
        shown = f"{half_width:.0e}"
    return f"{fixed(value, decimals)} ± {shown}"


def with_interval(value: float, low: float, high: float) -> str:
    """``42100 (39000 to 45300)``: all three with the same decimals."""
    decimals = _decimals((high - low) / 2, value)
    return f"{fixed(value, decimals)} ({fixed(low, decimals)} to {fixed(high, decimals)})"


def percent(value: float) -> str:
    """``720 %``: two digits, without an exponent; ``-`` where there is no finite value."""
    if not isfinite(value):
        return "-"
    if value and abs(value) < 1e-3:
        return "< 0.001 %"
    return f"{float(f'{value:.2g}'):.6g} %" if abs(value) < 1e4 else "> 9999 %"


def html_table(table: Sequence[Sequence[str]]) -> str:
    """Return a table for notebooks, its first row and column as headings; texts are escaped."""
    head, *rows = ([escape(cell) for cell in row] for row in table)
    body = "".join(
        f"<tr><th>{first}</th>{''.join(f'<td>{cell}</td>' for cell in others)}</tr>"
        for first, *others in rows
    )
    return f"<table><tr>{''.join(f'<th>{cell}</th>' for cell in head)}</tr>{body}</table>"


def parameter_row(
    label: str, value: float, ci95: tuple[float, float], unit: str, well_identified: bool
) -> tuple[str, ...]:
    """Return the row of a fitted number for a table with `PARAMETER_HEADS`.

    Parameters
    ----------
    label : str
        Its name, with the joint if there is one.
    value : float
    ci95 : (float, float)
        Its 95 % limits, in its unit.
    unit : str
    well_identified : bool

    Returns
    -------
    tuple of str
        As many as there are heads.
    """
    low, high = ci95
    return (
        label,
        with_half_width(value, (high - low) / 2),
        f"{low:.4g} to {high:.4g}",
        unit,
        "yes" if well_identified else "no",
    )
