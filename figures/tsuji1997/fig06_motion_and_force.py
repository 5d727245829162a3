"""Tsuji (1997), Fig. 6: motion and force of one disturbance, and the force predicted from it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from armimpedance.hand.still.show import plot_motion_and_force
from armimpedance_figures.source_figure import SourceFigure, design, script
from armimpedance_figures.tsuji1997.study import StudiedExperiment

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CONDITION = "cocontraction_10"


def draw(studied: StudiedExperiment) -> Figure:
    """The first trial of the condition that moves furthest along both axes."""
    return plot_motion_and_force(studied.recording, studied.of(CONDITION))


def caption(studied: StudiedExperiment) -> str:
    """What is shown and what differs."""
    found = studied.of(CONDITION)
    return (
        "After Tsuji (1997), Fig. 6: displacement, velocity, acceleration and force by the hand "
        "(solid) with the force predicted from the estimated M, B and K (dashed), co-contraction "
        f"at 10 % MVC. Multiple correlation over all trials of the condition "
        f"{found.quality.multiple_correlation:.3f} (source's example: 0.979). {design(studied)}. "
        "Differs from the source: simulated; motion and force smoothed by one kernel; drift "
        "removed from both sides of the equation, where the source corrects the force alone."
    )


FIGURE = SourceFigure(
    *("tsuji1997_fig06_motion_and_force", ("cocontraction",), "B", draw, caption), samples=True
)

if __name__ == "__main__":
    script(FIGURE)
