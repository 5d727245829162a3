"""How the tables' numbers are printed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from armimpedance.core.shown import fixed
from armimpedance.muscles.models import ElementQuality
from armimpedance.show.plots import DrawnRow


def number(value: float) -> str:
    """Six digits for a CSV; empty where there is none."""
    return f"{value:.6g}" if np.isfinite(value) else ""


def correlation_text(value: float) -> str:
    """Three decimals, or a dash."""
    return fixed(value, 3) if np.isfinite(value) else "-"


def error_text(value: float) -> str:
    """Two or three digits, and no exponent."""
    if not np.isfinite(value):
        return "-"
    if value >= 100:
        return f"{value:.0f}"
    return f"{value:#.3g}" if value >= 0.01 else f"{value:.5f}"


def quality_rows(
    found: Mapping[str, ElementQuality], elements: Sequence[str]
) -> tuple[DrawnRow, ...]:
    """R, E, and what they are worth, one column per element."""
    of = [found[element] for element in elements]
    return (
        DrawnRow("R", tuple(correlation_text(q.r) for q in of), strong=True),
        DrawnRow("E", tuple(error_text(q.e) for q in of), strong=True),
        DrawnRow("adj. R²", tuple(correlation_text(q.adjusted_r2) for q in of)),
        DrawnRow("R left out", tuple(correlation_text(q.leave_one_out_r) for q in of)),
        DrawnRow("R of noise", tuple(correlation_text(q.null_r) for q in of)),
    )
