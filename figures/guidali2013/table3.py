"""Guidali (2013), Table 3: friction and cables of five axes, printed and identified."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from armimpedance.core.shown import fixed, with_half_width
from armimpedance.show.plots import DrawnRow, TableBlock, plot_table
from armimpedance_figures.guidali2013.printed import TABLE_3
from armimpedance_figures.guidali2013.study import SUBJECTS, TherapyStudy, design, study
from armimpedance_figures.source_figure import SourceFigure, script
from armimpedance_figures.table_cells import number

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Parameter -> heading; and, to the source's units, what an SI value is multiplied by.
HEADINGS: Final = {
    "tau_c": "Coulomb friction (N m)",
    "k_v": "viscous friction (N m s/deg)",
    "k_c": "cable stiffness (N m/deg)",
    "q_c": "cables' equilibrium (deg)",
}
_PER_DEG: Final = np.pi / 180
TO_PRINTED: Final = {"tau_c": 1.0, "k_v": _PER_DEG, "k_c": _PER_DEG, "q_c": 1 / _PER_DEG}


@dataclass(frozen=True)
class Cell:
    """One coefficient in the source's unit."""

    axis: int
    name: str
    value: float
    low: float
    high: float
    true: float

    @property
    def exists(self) -> bool:
        """Whether the axis has it."""
        return np.isfinite(self.value)

    @property
    def error_text(self) -> str:
        """Per cent of the truth; degrees for an angle, the value's own unit where that is 0."""
        if not self.exists:
            return "-"
        off = self.value - self.true
        if self.name == "q_c":
            return f"{fixed(off, 2)} deg"
        return f"{fixed(100 * off / self.true, 2)} %" if self.true else f"{off:.1g}"


def cells_of(studied: TherapyStudy, name: str) -> list[Cell]:
    """One for each axis."""
    truth, factor = studied.robot.truth, TO_PRINTED[name]
    true = {
        "tau_c": truth.coulomb,
        "k_v": truth.viscous,
        "k_c": truth.cable_stiffness,
        "q_c": truth.cable_rest_rad,
    }[name]
    known = {p.joint: p for p in studied.robot.found.summary.parameters if p.name == name}
    cells = []
    for axis, value in enumerate(true, start=1):
        p = known.get(axis)
        found = (np.nan,) * 3 if p is None else (p.value, *p.ci95)
        cells.append(Cell(axis, name, *(factor * x for x in found), true=factor * float(value)))
    return cells


def draw(studied: TherapyStudy) -> Figure:
    """One block per coefficient."""
    blocks = []
    for name, heading in HEADINGS.items():
        cells = cells_of(studied, name)
        found = [with_half_width(c.value, (c.high - c.low) / 2).split(" ± ") for c in cells]
        blocks.append(
            TableBlock(
                heading,
                (
                    DrawnRow("printed", tuple(f"{v:g}" for v in TABLE_3[name])),
                    DrawnRow("identified", tuple(f[0] for f in found), strong=True),
                    DrawnRow("   ±", tuple(f[-1] for f in found)),
                    DrawnRow("off the truth by", tuple(c.error_text for c in cells)),
                ),
            )
        )
    header = [f"axis {i + 1}" for i in range(len(TABLE_3["tau_c"]))]
    return plot_table(header, blocks).figure  # type: ignore[return-value]


def table(studied: TherapyStudy) -> list[list[str]]:
    """One row per coefficient and axis, in the source's units."""
    rows = [["parameter", "axis", "printed", "true", "identified", "ci95_low", "ci95_high"]]
    for name in HEADINGS:
        for c, printed in zip(cells_of(studied, name), TABLE_3[name], strict=True):
            numbers = [printed, c.true, c.value, c.low, c.high]
            rows.append([name, str(c.axis), *map(number, numbers)])
    return rows


def caption(studied: TherapyStudy) -> str:
    """What is shown, how many intervals hold the truth, what differs."""
    cells = [c for name in HEADINGS for c in cells_of(studied, name) if c.exists]
    inside = sum(c.low <= c.true <= c.high for c in cells)
    rise = fixed(float(np.rad2deg(studied.identified.identified.rise_rad_s[0])), 2)
    return (
        "After Guidali et al. (2013), Table 3: friction and cables of the five axes from sweeps "
        "at constant velocities of 0.1 to 60 deg/s, both ways. The printed coefficients are the "
        f"simulated truth. ±: half of the 95 % interval; {inside} of {len(cells)} intervals hold "
        "the truth. Axis 1 has a spring, no cables. A v_s is not printed, and none can be "
        f"measured below the static range: ours is set ({rise} deg/s). {design(studied)}. "
        "Differs from the source: simulated; intervals, where the source prints none."
    )


FIGURE = SourceFigure(
    "guidali2013_table3", ("therapy",), SUBJECTS, draw, caption, table=table, study=study
)

if __name__ == "__main__":
    script(FIGURE)
