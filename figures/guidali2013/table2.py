"""Guidali (2013), Table 2: how well the model predicts movements that were not fitted."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from armimpedance.core.shown import fixed
from armimpedance.joint.therapy import AxisValidation
from armimpedance.show.plots import DrawnRow, TableBlock, plot_table
from armimpedance_figures.guidali2013.printed import (
    TABLE_2_IMPOSSIBLE,
    TABLE_2_R2,
    TABLE_2_RMS,
    TABLE_3,
)
from armimpedance_figures.guidali2013.study import SUBJECTS, TherapyStudy, design, study
from armimpedance_figures.source_figure import SourceFigure, script
from armimpedance_figures.table_cells import number

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw(studied: TherapyStudy) -> Figure:
    """R^2 and rms, axes side by side."""
    found = (studied.validated, studied.mismatched)
    header = [f"axis {a.axis + 1}" for a in studied.validated]
    blocks = [
        TableBlock("R², (17)", tuple(_rows(TABLE_2_R2, found, "r2", 3))),
        TableBlock("RMS error (N m), (16)", tuple(_rows(TABLE_2_RMS, found, "rms_Nm", 2))),
    ]
    return plot_table(header, blocks).figure  # type: ignore[return-value]


def _rows(
    printed: Sequence[float],
    found: Sequence[Sequence[AxisValidation]],
    name: str,
    decimals: int,
) -> list[DrawnRow]:
    source = [
        fixed(value, decimals) + (" *" if i + 1 == TABLE_2_IMPOSSIBLE else "")
        for i, value in enumerate(printed)
    ]
    rows = [DrawnRow("printed", tuple(source))]
    for what, axes in zip(("as calibrated", "mismatched"), found, strict=True):
        for moving in ("", "moving_"):
            cells = tuple(fixed(getattr(a, moving + name), decimals) for a in axes)
            label = f"{what}, while moving" if moving else what
            rows.append(DrawnRow(label, cells, strong=not moving))
    return rows


def table(studied: TherapyStudy) -> list[list[str]]:
    """One row per plant and axis."""
    rows = [["plant", "axis", "r2", "rms_Nm", "moving_r2", "moving_rms_Nm", "printed_r2"]]
    rows[0].append("printed_rms_Nm")
    for plant, axes in (("matched", studied.validated), ("mismatched", studied.mismatched)):
        for a, r2, rms in zip(axes, TABLE_2_R2, TABLE_2_RMS, strict=True):
            own = [a.r2, a.rms_Nm, a.moving_r2, a.moving_rms_Nm, r2, rms]
            rows.append([plant, str(a.axis + 1), *map(number, own)])
    return rows


def caption(studied: TherapyStudy) -> str:
    """What is shown, what cannot be in the print, what differs."""
    i = TABLE_2_IMPOSSIBLE - 1
    spread = TABLE_2_RMS[i] / np.sqrt(1 - TABLE_2_R2[i])
    least = np.rad2deg(studied.validated[0].least_speed_rad_s)
    return (
        "After Guidali et al. (2013), Table 2: coefficient of determination and RMS error of the "
        "motor torque of movements that were not fitted, with nobody in the robot. Mismatched: a "
        "plant whose links are 12 % heavier, its friction 45 % and its cables 30 % stronger than "
        "what was calibrated, the size of misfit that the print has on axis 1. While moving: "
        f"faster than {least:.0f} deg/s, without the static friction that the model leaves out. "
        f"* cannot be: R² and RMS of axis {TABLE_2_IMPOSSIBLE} together mean a motor torque with "
        f"an sd of {spread:.1f} N m, where Table 3's friction alone turns by ±"
        f"{TABLE_3['tau_c'][i]:.1f} N m with the direction. {design(studied)}. Differs from the "
        "source: simulated; its movements are not described, ours are minimum-jerk ways between "
        "random postures."
    )


FIGURE = SourceFigure(
    "guidali2013_table2", ("therapy",), SUBJECTS, draw, caption, table=table, study=study
)

if __name__ == "__main__":
    script(FIGURE)
