"""Guidali (2013), text of the Results: mean contributions of all conditions, printed and ours."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.shown import fixed
from armimpedance.show.plots import DrawnRow, TableBlock, plot_table
from armimpedance_figures.guidali2013.groups import (
    GROUPS,
    conditions_of,
    differences,
    groups_of,
    lowest,
    mean_and_sd,
    measured_of,
    projections,
    ratios,
    shares,
    true_projections,
    true_ratios,
    true_shares,
)
from armimpedance_figures.guidali2013.printed import CONTRIBUTIONS
from armimpedance_figures.guidali2013.study import SUBJECTS, TherapyStudy, design, study
from armimpedance_figures.source_figure import SourceFigure, script
from armimpedance_figures.table_cells import number

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HEADER: Final = (
    *("printed (4)", "(4)", "true", "projection", "true", "share", "true"),
    *("print. diff.", "diff."),
)
WIDTHS: Final = (1.0, 1.28, 0.6, 1.1, 0.55, 1.15, 0.6, 1.0, 0.95)
#: Found and true, in the columns' order.
METRICS: Final = (
    (ratios, true_ratios), (projections, true_projections), (shares, true_shares),
)  # fmt: skip


def draw(studied: TherapyStudy) -> Figure:
    """A block per movement and group."""
    blocks = []
    for key in groups_of(studied):
        rows = tuple(_row(studied, *key, condition) for condition in conditions_of(*key))
        blocks.append(TableBlock(GROUPS[key], rows))
    return plot_table(HEADER, blocks, widths=WIDTHS).figure  # type: ignore[return-value]


def _row(studied: TherapyStudy, movement: str, group: str, condition: str) -> DrawnRow:
    printed = CONTRIBUTIONS[movement, group, condition]
    measured = measured_of(studied, movement, group, condition)
    cells = [_spread((printed.mean, printed.sd)) + (" *" if printed.doubt else "")]
    for found, true in METRICS:
        cells += [_found(found(measured)), _mean(true(measured))]
    cells += [_spread((printed.difference, printed.difference_sd)), _found(differences(measured))]
    return DrawnRow(condition.replace("_", " "), tuple(cells))


def _found(values: FloatArray) -> str:
    return _spread(mean_and_sd(values))


def _mean(values: FloatArray) -> str:
    return _spread((mean_and_sd(values)[0], float("nan")))


def _spread(pair: tuple[float, float]) -> str:
    mean, sd = pair
    if not np.isfinite(mean):
        return "-"
    decimals = 0 if abs(mean) >= 100 or sd >= 20 else 1
    shown = fixed(mean, decimals)
    return shown if not np.isfinite(sd) else f"{shown} ± {fixed(sd, decimals)}"


def table(studied: TherapyStudy) -> list[list[str]]:
    """One row per movement, group and condition."""
    rows = [["movement", "group", "condition", "movements", "ratio_valid", "projection_valid"]]
    rows[0].append("share_valid")
    names = [f"{of}{metric}" for metric in ("ratio", "projection", "share") for of in ("", "true_")]
    names.append("reference_less_ratio")
    rows[0] += [f"{name}_{what}" for name in names for what in ("mean", "sd")]
    rows[0] += ["printed_mean", "printed_sd", "printed_difference", "printed_difference_sd"]
    rows[0].append("doubt")
    for movement, group in groups_of(studied):
        for condition in conditions_of(movement, group):
            measured = measured_of(studied, movement, group, condition)
            printed = CONTRIBUTIONS[movement, group, condition]
            own = [each(measured) for pair in METRICS for each in pair]
            own.append(differences(measured))
            values = [x for v in own for x in mean_and_sd(v)]
            values += [printed.mean, printed.sd, printed.difference, printed.difference_sd]
            counts = [str(len(measured)), *(str(len(own[i])) for i in (0, 2, 4))]
            rows.append([movement, group, condition, *counts, *map(number, values), printed.doubt])
    return rows


def caption(studied: TherapyStudy) -> str:
    """What is shown, what is doubtful, what differs."""
    every = [m for person in studied.people for m in person.measured]
    metrics = ("ratio", "projection", "share")
    counts = [sum(getattr(m.found, name).valid for m in every) for name in metrics]
    valid = ", ".join(map(str, counts))
    return (
        "After Guidali et al. (2013), text of the Results: contribution in per cent, mean ± sd "
        "over all repetitions of all people. Ours by (4), by the "
        "projection on what the passive arm needs, and by the share of it beside any multiple of "
        f"the robot's own inertia torque, where they are valid ({valid} of {len(every)} "
        f"movements). {lowest(studied)} True: means "
        "of the same of the simulated torques in the same samples, those in which the axis moves; "
        "diff.: the comparison by a measured reference torque, (19), less (4), where both are "
        "valid. * doubtful prints: -102.90 of resistive elevation repeats the digits of the active "
        "condition; 1,487.25 of resistive horizontal has lost its minus. "
        f"{design(studied)}. Differs from the source: simulated; how active or resistive people "
        "are was chosen, the patients' active shares around its mean and sd, half active exactly "
        "half: its spread is not to be compared."
    )


FIGURE = SourceFigure(
    "guidali2013_contribution_means",
    ("therapy",),
    SUBJECTS,
    draw,
    caption,
    table=table,
    study=study,
)

if __name__ == "__main__":
    script(FIGURE)
