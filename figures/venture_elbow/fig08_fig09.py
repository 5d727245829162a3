"""Venture (elbow), Figs 8 and 9: torque of recordings that were not fitted, and its prediction."""

from __future__ import annotations

from typing import TYPE_CHECKING

from armimpedance.joint.relaxed import METHODS
from armimpedance_figures.source_figure import SourceFigure, script
from armimpedance_figures.venture_elbow.panels import Panel, draw_panels, panel_table
from armimpedance_figures.venture_elbow.study import SUBJECTS, StudiedTest, design, study

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def panels(p5: tuple[StudiedTest, ...], release: tuple[StudiedTest, ...]) -> list[Panel]:
    """For every subject a release and another P5, both by the fit to P5."""
    shown = []
    for number, (shaken, let_go) in enumerate(zip(p5, release, strict=True), start=8):
        fit, who = shaken.fits[METHODS.default], shaken.subject
        shown.append(Panel(f"Fig. {number}: release, subject {who}", fit, let_go.samples))
        shown.append(Panel(f"Fig. {number}: another P5, subject {who}", fit, shaken.again))
    return shown


def draw(*tests: tuple[StudiedTest, ...]) -> Figure:
    """One panel a recording."""
    return draw_panels(panels(*tests))


def table(*tests: tuple[StudiedTest, ...]) -> list[list[str]]:
    """How well each recording is predicted."""
    return panel_table(panels(*tests))


def caption(p5: tuple[StudiedTest, ...], release: tuple[StudiedTest, ...]) -> str:
    """What is shown and what differs."""
    every = [*p5, *release]
    return (
        "After Venture et al. (in-vivo elbow), Figs 8 and 9, cross-validation: k, h and f fitted "
        f"to one P5 recording (method '{METHODS.default}') predict the torque of releases of the "
        "forearm and of another P5 recording of the same subject. R² is about zero, where a P5 "
        "has most of it for free; VAF takes the mean off. The release asks more of the fit: "
        f"there the elbow swings about its rest angle ({_spread(release)} rad rms about the mean), "
        f"in P5 it hangs far from it and moves less ({_spread(p5)} rad). "
        f"{design(*every)}. Differs from the source: simulated, and here one set of parameters is "
        "true in both tests, where the source prints k 10 to 12 % apart."
    )


def _spread(studied: tuple[StudiedTest, ...]) -> str:
    return " and ".join(f"{one.samples.q.std():.2f}" for one in studied)


FIGURE = SourceFigure(
    "venture_elbow_fig08_fig09",
    ("p5", "release"),
    SUBJECTS,
    draw,
    caption,
    table=table,
    study=study,
)

if __name__ == "__main__":
    script(FIGURE)
