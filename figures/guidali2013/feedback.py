"""Not in the source: one patient's session as a therapist would see it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from armimpedance.joint.therapy import STEADY_S
from armimpedance.joint.therapy.show import plot_feedback
from armimpedance_figures.guidali2013.study import SHOWN, SUBJECTS, TherapyStudy, design, study
from armimpedance_figures.source_figure import SourceFigure, script
from armimpedance_figures.table_cells import number

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw(studied: TherapyStudy) -> Figure:
    """Conditions from above to below, movements side by side."""
    person = studied.person(SHOWN)
    return plot_feedback(person.movements, studied.identified, person.calibration.arm)


def table(studied: TherapyStudy) -> list[list[str]]:
    """One row per movement."""
    rows = [["trial", "movement", "condition", "share_valid"]]
    for name in ("share", "projection"):
        rows[0] += [f"{name}_percent", f"{name}_ci95_low", f"{name}_ci95_high", f"true_{name}"]
    for m in studied.person(SHOWN).measured:
        f = m.found
        values = [f.share.percent, *f.share.ci95, m.truth_share_percent]
        values += [f.projection.percent, *f.projection.ci95, m.truth_projection_percent]
        names = [f.trial, f.movement, f.condition, "yes" if f.share.valid else "no"]
        rows.append([*names, *map(number, values)])
    return rows


def caption(studied: TherapyStudy) -> str:
    """What is shown and how far off it is."""
    measured = studied.person(SHOWN).measured
    off = [abs(m.found.share.percent - m.truth_share_percent) for m in measured]
    return (
        f"The session of patient {SHOWN} as `armimpedance therapy contribution --figure` shows it: "
        "share of the movement so far, beside the robot's own inertia torque, with its 95 % band; "
        "at the right and in the titles that of each whole movement with its 95 % interval (in the "
        "titles the widest); 0 % is a passive arm, 100 % one that needs no support, below 0 it "
        f"resists. Lines begin once the share has been told for {STEADY_S:g} s: the axis moves, "
        "and what the arm needs no longer looks like the robot's inertia. "
        f"The whole movements are at most {max(off):.1f} points from the simulated truth while "
        "the axis moves. "
        f"{design(studied)}. Differs from the source: simulated, and the source shows no such view."
    )


FIGURE = SourceFigure(
    "contribution_feedback", ("therapy",), SUBJECTS, draw, caption, table=table, study=study
)

if __name__ == "__main__":
    script(FIGURE)
