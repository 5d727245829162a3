"""Guidali (2013), Table 4: passive stiffness and rest angle of 19 people."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.shown import with_half_width
from armimpedance.joint.therapy import AxisCalibration
from armimpedance.numerics.regression import NamedParameter
from armimpedance.show.plots import DrawnRow, TableBlock, plot_table
from armimpedance_figures.guidali2013.groups import mean_and_sd
from armimpedance_figures.guidali2013.printed import TABLE_4, TABLE_4_MEANS, recomputed_means
from armimpedance_figures.guidali2013.study import SUBJECTS, Person, TherapyStudy, design, study
from armimpedance_figures.source_figure import SourceFigure, script
from armimpedance_figures.table_cells import number

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Axis (from 0) and name of the four columns.
COLUMNS: Final = ((0, "k_s"), (0, "q_0"), (1, "k_s"), (1, "q_0"))
HEADER: Final = tuple(
    text for axis, name in COLUMNS for text in ("printed", f"{name}{axis + 1}".replace("_", ""))
)
WIDTHS: Final = (0.75, 1.3) * 4
GROUP_NAMES: Final = {"S": "able-bodied", "P": "patients"}


@dataclass(frozen=True)
class Cell:
    """One person's stiffness or rest angle.

    Attributes
    ----------
    printed : float or None
    found : NamedParameter
    true : float
        Mean over the passive repetitions.
    identified, refused : bool
        Known well enough to be quoted; the whole axis refused.
    """

    printed: float | None
    found: NamedParameter
    true: float
    identified: bool
    refused: bool

    @property
    def text(self) -> str:
        """In brackets where it is too uncertain to be quoted."""
        if self.refused:
            return "refused"
        if not np.isfinite(self.found.value):
            return "none"
        low, high = self.found.ci95
        shown = with_half_width(self.found.value, (high - low) / 2)
        return shown if self.identified else f"({shown})"

    @property
    def covered(self) -> bool:
        """Whether the interval holds the truth."""
        low, high = self.found.ci95
        return low <= self.true <= high


def cells_of(person: Person) -> list[Cell]:
    """The four columns of one person."""
    printed = TABLE_4.get(person.name, (None,) * 4)
    axes = {a.axis: a for a in person.calibration.axes}
    cells = []
    for (axis, name), value in zip(COLUMNS, printed, strict=True):
        found, elastic = axes[axis], axes[axis].elastic
        k = name == "k_s"
        cells.append(
            Cell(
                printed=value,
                found=found.stiffness if k else found.rest,
                true=_true(person, "stiffness" if k else "rest_rad", axis),
                identified=elastic.stiffness_identified if k else elastic.rest_identified,
                refused=not elastic.repeatable,
            )
        )
    return cells


def _true(person: Person, name: str, axis: int) -> float:
    """Mean of the passive repetitions that moved the axis."""
    moved = (person.passive.trials["axis"] == axis + 1).to_numpy()
    rows = person.passive.trials["trial"].to_numpy()[moved] - 1
    return float(np.mean(getattr(person.truth, name)[rows, axis]))


def draw(studied: TherapyStudy) -> Figure:
    """A block per group."""
    blocks = []
    for group, name in GROUP_NAMES.items():
        people = [p for p in studied.people if p.group == group]
        if people:
            rows = [_row(person) for person in people]
            blocks.append(TableBlock(name, (*rows, *_mean_rows(group, people))))
    header = [h.replace("ks", "k_s").replace("q0", "q_0") for h in HEADER]
    return plot_table(header, blocks, widths=WIDTHS).figure  # type: ignore[return-value]


def _row(person: Person) -> DrawnRow:
    texts = [text for cell in cells_of(person) for text in (_printed(cell.printed), cell.text)]
    return DrawnRow(person.name, tuple(texts))


def _printed(value: float | None) -> str:
    """As in the source: two decimals, three where there is nothing else to see."""
    if value is None:
        return "-"
    return f"{value:.2f}" if abs(value) >= 0.03 else f"{value:.3f}"


def _mean_rows(group: str, people: Sequence[Person]) -> Iterator[DrawnRow]:
    printed, own_rows = np.array(TABLE_4_MEANS[group]), recomputed_means(group)
    ours = np.array([mean_and_sd(column) for column in _columns(people)])
    marks = [not np.allclose(p, r, atol=0.011) for p, r in zip(printed, own_rows, strict=True)]
    for name, values, marked in (
        ("printed mean ± sd", printed, marks),
        ("of its printed rows", own_rows, [False] * 4),
        ("identified", ours, [False] * 4),
    ):
        cells = [
            text
            for (mean, sd), mark in zip(values, marked, strict=True)
            for text in ("", f"{mean:.2f} ± {sd:.2f}" + (" *" if mark else ""))
        ]
        yield DrawnRow(name, tuple(cells), strong=name == "identified")


def _columns(people: Sequence[Person]) -> list[FloatArray]:
    """Values of all axes that were not refused, for each column."""
    every = [cells_of(person) for person in people]
    return [
        np.array([c.found.value for c in column if not c.refused and np.isfinite(c.found.value)])
        for column in zip(*every, strict=True)
    ]


def table(studied: TherapyStudy) -> list[list[str]]:
    """One row per person and parameter."""
    rows = [["subject", "axis", "parameter", "unit", "printed", "true", "identified_value"]]
    rows[0] += ["ci95_low", "ci95_high", "quoted", "refused"]
    for person in studied.people:
        for (axis, name), c in zip(COLUMNS, cells_of(person), strict=True):
            values = [c.true, c.found.value, *c.found.ci95]
            rows.append(
                [
                    *(person.name, str(axis + 1), name, c.found.unit),
                    "" if c.printed is None else f"{c.printed:g}",
                    *map(number, values),
                    *("yes" if flag else "no" for flag in (c.identified, c.refused)),
                ]
            )
    return rows


def caption(studied: TherapyStudy) -> str:
    """What is shown, what is refused, what of the print does not add up, what differs."""
    cells = [(p, c) for p in studied.people for c in cells_of(p)]
    known = [c for _, c in cells if not c.refused and np.isfinite(c.found.value)]
    covered, quoted = sum(c.covered for c in known), sum(c.identified for c in known)
    refused = list(dict.fromkeys(p.name for p, c in cells if c.refused))
    widest_stiffness, widest_share, widest_rest = AxisCalibration.WIDEST
    who = f"refused: {', '.join(refused)}" if refused else "nobody refused"
    return (
        "After Guidali et al. (2013), Table 4: passive stiffness k_s (N m/rad) and rest angle q_0 "
        "(rad) of axes 1 (elevation) and 2 (horizontal) from three passive repetitions, (21). The "
        "printed values are the simulated truth up to 2 % and 0.015 rad between repetitions. ±: "
        "half of the 95 % interval, which counts that body segments differ from the table of "
        f"masses by 3 %; {covered} of {len(known)} hold the truth. {quoted} of {len(known)} are "
        f"known: k_s to ± {widest_stiffness} N m/rad or {100 * widest_share:.0f} % of it, "
        f"q_0 to ± {widest_rest} rad; the others stand in brackets. As in the source S4 and P1 "
        f"move their trunk; {who}. * the printed means of the horizontal columns do not follow "
        f"from the printed rows. {design(studied)}. Differs from the source: simulated; intervals."
    )


FIGURE = SourceFigure(
    "guidali2013_table4", ("therapy",), SUBJECTS, draw, caption, table=table, study=study
)

if __name__ == "__main__":
    script(FIGURE)
