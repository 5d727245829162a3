"""Guidali (2013), Fig. 6: box plots of the contribution of 19 people in all conditions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from armimpedance.plots.style import OKABE_ITO, TWO_COLUMNS_IN, new_figure, print_style
from armimpedance.records import FloatArray
from armimpedance_figures.guidali_groups import (
    GROUPS,
    conditions_of,
    groups_of,
    mean_and_sd,
    measured_of,
    projections,
    ratios,
    true_projections,
    true_ratios,
)
from armimpedance_figures.guidali_printed import CONTRIBUTIONS
from armimpedance_figures.source_figure import SourceFigure, script
from armimpedance_figures.table_cells import number
from armimpedance_figures.therapy_study import SUBJECTS, TherapyStudy, design, study
from armimpedance_figures.venture_layout import settle

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: The axis is linear within these per cent, logarithmic beyond: resistance runs to thousands.
LINEAR: Final = 150.0
TICKS: Final = (-5000, -1000, -300, -100, -50, 0, 50, 100, 300, 1000)
RATIO, PROJECTION, TRUE = OKABE_ITO["blue"], OKABE_ITO["vermillion"], OKABE_ITO["green"]
#: Places beside a condition's own.
_PRINTED, _RATIO, _PROJECTION = -0.28, -0.02, 0.24


def draw(studied: TherapyStudy) -> Figure:
    """A panel per movement and group."""
    groups = groups_of(studied)
    figure = new_figure(TWO_COLUMNS_IN, 2.6 * -(-len(groups) // 2) + 0.6)
    with print_style():
        axes = figure.subplots(-(-len(groups) // 2), 2, squeeze=False)
        for letter, ax, group in zip("abcd", axes.flat, groups, strict=False):
            _panel(studied, *group, ax)
            ax.set_title(f"({letter}) {GROUPS[group]}", loc="left")
        _legend(figure)
    settle(figure)
    return figure


def _panel(studied: TherapyStudy, movement: str, group: str, ax: Axes) -> None:
    conditions = conditions_of(movement, group)
    for place, condition in enumerate(conditions):
        measured = measured_of(studied, movement, group, condition)
        printed = CONTRIBUTIONS[movement, group, condition]
        ax.errorbar(
            place + _PRINTED, printed.mean, printed.sd, fmt="D", ms=4, color="black",
            mfc="white" if printed.doubt else "black", elinewidth=0.8, capsize=2,
        )  # fmt: skip
        _box(ax, ratios(measured), place + _RATIO, RATIO)
        _box(ax, projections(measured), place + _PROJECTION, PROJECTION)
        flagged = ratios(measured, valid=False)
        ax.plot(
            np.full(len(flagged), place + _RATIO), flagged, ls="", marker="x", ms=3.5, color="0.6",
        )  # fmt: skip
        for true, at in (
            (true_ratios(measured), _RATIO),
            (true_projections(measured), _PROJECTION),
        ):
            ends = [place + at - 0.13, place + at + 0.13]
            ax.plot(ends, np.full(2, mean_and_sd(true)[0]), color=TRUE, lw=1.8, zorder=5)
    for level, style in ((0, "-"), (100, (0, (5, 2)))):
        ax.axhline(level, color="0.6", lw=0.6, ls=style, zorder=0)
    ax.set_yscale("symlog", linthresh=LINEAR, linscale=1.6)
    ax.set_yticks(TICKS, [f"{t}" for t in TICKS])
    ax.set_ylim(-6000 if movement == "horizontal" else -1000, 400)
    ax.set_xticks(range(len(conditions)), [c.replace("_", "\n") for c in conditions])
    ax.set_xlim(-0.6, len(conditions) - 0.4)
    ax.set_ylabel("contribution (%)")
    ax.minorticks_off()


def _box(ax: Axes, found: FloatArray, place: float, color: str) -> None:
    if not len(found):
        return
    line = {"color": color, "lw": 1.0}
    ax.boxplot(
        found, positions=[place], widths=0.2, manage_ticks=False, boxprops=line, whiskerprops=line,
        capprops=line, medianprops={"color": color, "lw": 1.8},
        flierprops={"marker": "+", "ms": 4, "mec": color},
    )  # fmt: skip


def _legend(figure: Figure) -> None:
    from matplotlib.lines import Line2D

    def mark(marker: str, **look: object) -> Line2D:
        return Line2D([], [], ls="", marker=marker, **look)  # type: ignore[arg-type]

    entries = {
        "(4)": Line2D([], [], color=RATIO, lw=1.8),
        "projection": Line2D([], [], color=PROJECTION, lw=1.8),
        "true mean": Line2D([], [], color=TRUE, lw=1.8),
        "printed mean ± sd": mark("D", color="black", ms=4),
        "doubtful print": mark("D", color="black", mfc="white", ms=4),
        "(4) singular": mark("x", color="0.6", ms=4),
    }
    figure.legend(list(entries.values()), list(entries), loc="outside upper center", ncols=6)


def table(studied: TherapyStudy) -> list[list[str]]:
    """One row per movement."""
    rows = [
        [
            *("subject", "movement", "condition", "trial", "ratio_percent", "ratio_sd"),
            *("ratio_valid", "sum_ratio", "projection_percent", "projection_sd"),
            *("projection_valid", "reference_percent", "true_ratio", "true_projection"),
            "true_ratio_standstill_included",
        ]
    ]
    for person in studied.people:
        for m in person.measured:
            f = m.found
            rows.append(
                [
                    *(person.name, f.movement, f.condition, f.trial),
                    *map(number, [f.ratio_percent, f.ratio_sd]),
                    *("yes" if f.ratio_valid else "no", number(f.sum_ratio)),
                    *map(number, [f.projection_percent, f.projection_sd]),
                    "yes" if f.projection_valid else "no",
                    "" if f.reference_percent is None else number(f.reference_percent),
                    *map(number, [m.truth_percent, m.truth_projection_percent, m.whole_percent]),
                ]
            )
    return rows


def caption(studied: TherapyStudy) -> str:
    """What is shown, who is left out, how far off it is, what differs."""
    refused = [f"{p.name} {axis}" for p in studied.people for axis, _ in p.refused]
    told = [m for p in studied.people for m in p.measured]
    singular = sum(not m.found.ratio_valid for m in told)
    held = [
        low <= m.truth_projection_percent <= high
        for m in told
        if m.found.projection_valid
        for low, high in [m.found.projection_ci95]
    ]
    left_out = f"left out: {', '.join(refused)} (no passive model)" if refused else "nobody refused"
    return (
        "After Guidali et al. (2013), Fig. 6: contribution by the source's (4), by the projection "
        "on what the passive arm needs, and what either is of the simulated torques (true mean), "
        f"all while the axis moves; {left_out}; boxes over all repetitions "
        f"({len(studied.people)} people), + outliers. In {singular} of {len(told)} movements (4) "
        "is flagged: what the passive arm needs cancels out. The 95 % interval of the projection "
        f"holds the truth in {100 * np.mean(held):.1f} %. The source scales its resistive boxes; "
        f"here the axis is logarithmic beyond ±{LINEAR:.0f} %. Hollow diamonds: -102.90 of "
        "resistive elevation repeats the digits of the active condition, 1,487.25 of resistive "
        f"horizontal has lost its minus. {design(studied)}. Differs from the source: simulated; "
        "how active or resistive people are was chosen, the patients' active shares around its "
        "mean and sd, half active exactly half."
    )


FIGURE = SourceFigure(
    "guidali2013_fig06_contribution", ("therapy",), SUBJECTS, draw, caption, table=table,
    study=study,
)  # fmt: skip

if __name__ == "__main__":
    script(FIGURE)
