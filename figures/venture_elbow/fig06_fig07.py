"""Venture (elbow), Figs 6 and 7: torque of the recordings that were fitted, and its estimate."""

from __future__ import annotations

from typing import TYPE_CHECKING

from armimpedance.joint.relaxed import METHODS
from armimpedance_figures.source_figure import SourceFigure, script
from armimpedance_figures.venture_elbow.panels import Panel, draw_panels, panel_table
from armimpedance_figures.venture_elbow.study import SUBJECTS, StudiedTest, design, study

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def panels(*tests: tuple[StudiedTest, ...]) -> list[Panel]:
    """P5 of all subjects, then the release of all."""
    return [
        Panel(f"Fig. {number}: {one.title}", one.fits[METHODS.default], one.samples)
        for number, studied in zip((6, 7), tests, strict=True)
        for one in studied
    ]


def draw(*tests: tuple[StudiedTest, ...]) -> Figure:
    """One panel a recording."""
    return draw_panels(panels(*tests))


def table(*tests: tuple[StudiedTest, ...]) -> list[list[str]]:
    """How well each recording is explained."""
    return panel_table(panels(*tests))


def caption(*tests: tuple[StudiedTest, ...]) -> str:
    """What is shown and what differs."""
    every = [one for studied in tests for one in studied]
    return (
        "After Venture et al. (in-vivo elbow), Figs 6 and 7, direct validation: passive torque of "
        "the elbow, minus that of inertia and gravity, of the recordings that k, h and f were "
        f"fitted to (measured), the estimate W X by method '{METHODS.default}', and the "
        "difference. R² is about zero, as torque without an offset is judged; in P5, where k holds "
        "the forearm up all the time, most of it comes for free. VAF takes the mean off. What "
        "is left over is mostly noise of the twice differentiated angle. The four releases follow "
        "one another. "
        f"{design(*every)}. Differs from the source: simulated; another estimator (the source's "
        "'ls' is in the table)."
    )


FIGURE = SourceFigure(
    "venture_elbow_fig06_fig07",
    ("p5", "release"),
    SUBJECTS,
    draw,
    caption,
    table=table,
    study=study,
)

if __name__ == "__main__":
    script(FIGURE)
