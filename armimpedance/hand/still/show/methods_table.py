"""Every method on one recording, side by side, as text for a terminal of 100 columns."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

import numpy as np

from armimpedance.core.conventions import MATRICES, UNITS
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.hand.ellipses import FIELDS
from armimpedance.hand.levels import symmetric_part
from armimpedance.hand.show.quantities import condition_of, half_widths, principal_values
from armimpedance.hand.still.side_by_side import SideBySide
from armimpedance.show.text import aligned_table, fixed, with_half_width

_WIDTH = 100
_MOST = 1000.0
_LEGEND = (
    "Symmetric parts; ± is the half-width of the 95 % interval. 'apart' is the distance from {0} "
    "(Frobenius norm) in % of {0}'s matrix; 'in se' the same in standard errors of the difference, "
    "from leaving out each trial in both methods, so that the noise they share cancels. Time is of "
    "one estimate with its standard errors."
)


def methods_table(compared: Sequence[SideBySide], reference: str) -> str:
    """All groups: M, B and K of every method, who cannot run and why, who disagrees.

    Parameters
    ----------
    compared : sequence of SideBySide
    reference : str
        The method that the others are measured against.

    Returns
    -------
    str
        A block of text per group, and an explanation of the columns at the end.
    """
    blocks = [block for side in compared for block in _group(side, reference)]
    return "\n\n".join([*blocks, textwrap.fill(_LEGEND.format(reference), _WIDTH)])


def _group(side: SideBySide, reference: str) -> list[str]:
    first = side.estimates[0]
    blocks = [f"{condition_of(first)}: {first.quality.n_trials} trials"]
    for i, (field, (symbol, _)) in enumerate(MATRICES.items()):
        title = f"{field.capitalize()} {symbol} ({UNITS[first.level][symbol]})"
        blocks.append(f"{title}\n{_table(side, i)}")
    refused = [f"{r.method} cannot run: {r.reason}" for r in side.results if r.estimate is None]
    said = [sentence for d in side.disagreements for sentence in d.sentences]
    if not said and side.disagreements:
        said = [f"no method differs from {reference} by more than chance and a few percent"]
    notes = [
        textwrap.fill(note, _WIDTH, initial_indent="- ", subsequent_indent="  ")
        for note in (*said, *refused)
    ]
    return [*blocks, "\n".join(notes)] if notes else blocks


def _table(side: SideBySide, i: int) -> str:
    apart, rows = {d.method: d for d in side.disagreements}, []
    for result in side.results:
        if result.estimate is None:
            continue
        known = apart.get(result.method)
        distance = ["-", "-"]
        if known is not None:
            distance = [_number(known.percent[i]), _number(known.standard_errors[i])]
        time = fixed(1e3 * result.seconds, 1)
        rows.append([result.method, *_cells(result.estimate, i), *distance, time])
    headings = _headings(side.estimates[0].k, i)
    return aligned_table(["method", *headings, "apart (%)", "in se", "time (ms)"], rows)


def _number(value: float) -> str:
    if not np.isfinite(value):
        return "?"
    # without noise any difference is many standard errors
    return fixed(float(value), 1) if value < _MOST else f">{_MOST:g}"


def _headings(k: int, i: int) -> list[str]:
    symbol = "MBK"[i]
    if k > 2:
        return [f"principal {n + 1}" for n in range(k)]
    return [f"{symbol}_{a + 1}{b + 1}" for a in range(k) for b in range(a, k)]


def _cells(made: ImpedanceEstimate, i: int) -> list[str]:
    """Elements of the symmetric part of one or two axes, principal values of more."""
    if made.k > 2:
        values, half = principal_values(made, FIELDS[i])
        return [with_half_width(v, h) for v, h in zip(values, half, strict=True)]
    part = symmetric_part(made)
    matrix, width = getattr(part, FIELDS[i]), half_widths(part)[i]
    upper = np.triu_indices(made.k)
    return [with_half_width(v, h) for v, h in zip(matrix[upper], width[upper], strict=True)]
