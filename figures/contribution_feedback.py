"""Not in the source: one patient's session as a therapist would see it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from armimpedance.contribution.metric import WINDOW_S
from armimpedance.plots.contribution import plot_feedback
from armimpedance_figures.source_figure import SourceFigure, script
from armimpedance_figures.table_cells import number
from armimpedance_figures.therapy_study import SHOWN, SUBJECTS, TherapyStudy, design, study
from armimpedance_figures.venture_layout import settle

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw(studied: TherapyStudy) -> Figure:
    """Conditions from above to below, movements side by side."""
    person = studied.person(SHOWN)
    figure = plot_feedback(person.movements, studied.identified, person.calibration.arm)
    settle(figure)
    return figure


def table(studied: TherapyStudy) -> list[list[str]]:
    """One row per movement."""
    rows = [["trial", "movement", "condition", "projection_percent", "ci95_low", "ci95_high"]]
    rows[0].append("true_projection")
    for m in studied.person(SHOWN).measured:
        values = [m.found.projection_percent, *m.found.projection_ci95, m.truth_projection_percent]
        names = [m.found.trial, m.found.movement, m.found.condition]
        rows.append([*names, *map(number, values)])
    return rows


def caption(studied: TherapyStudy) -> str:
    """What is shown and how far off it is."""
    measured = studied.person(SHOWN).measured
    off = [abs(m.found.projection_percent - m.truth_projection_percent) for m in measured]
    return (
        f"The session of patient {SHOWN} as `armimpedance contribution --figure` shows it: "
        f"projection over the last {WINDOW_S:g} s with its 95 % band; at the right and in the "
        "titles that of each whole movement with its 95 % interval; 0 % is a passive arm, 100 % "
        "one that needs no support, below 0 it resists. Grey: cannot be told, because the passive "
        "arm needs next to nothing there. Lines begin once the axis moves: what sticks bears "
        "anything up to its static friction. "
        f"The whole movements are at most {max(off):.1f} points from the simulated truth while "
        "the axis moves. "
        f"{design(studied)}. Differs from the source: simulated, and the source shows no such view."
    )


FIGURE = SourceFigure(
    "contribution_feedback", ("therapy",), SUBJECTS, draw, caption, table=table, study=study
)

if __name__ == "__main__":
    script(FIGURE)
