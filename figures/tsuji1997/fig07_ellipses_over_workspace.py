"""Tsuji (1997), Fig. 7: ellipses of inertia, stiffness and viscosity over the workspace."""

from __future__ import annotations

from typing import TYPE_CHECKING

from armimpedance.hand.still.show import plot_estimates
from armimpedance_figures.source_figure import POOLED, SourceFigure, design, script
from armimpedance_figures.tsuji1997.study import StudiedExperiment

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw(studied: StudiedExperiment) -> Figure:
    """Three panels; the two-link model's inertia beside the estimate in the first."""
    models = [studied.model_inertia(found) for found in studied.hand]
    return plot_estimates(studied.hand, models)


def caption(studied: StudiedExperiment) -> str:
    """What is shown and what differs."""
    return (
        "After Tsuji (1997), Fig. 7: estimated inertia (a), stiffness (b) and viscosity (c) of the "
        "relaxed arm, each ellipse at its hand location, shaded 95 % band (hardly wider than the "
        "line); wide and grey in (a): inertia of a two-link arm from body mass and segment lengths "
        "(Winter's table), eq. (17); the simulated limb has segments of the same table, so the "
        f"model should agree. {design(studied)}. {POOLED}"
    )


FIGURE = SourceFigure("tsuji1997_fig07_ellipses_over_workspace", ("postures",), "A", draw, caption)

if __name__ == "__main__":
    script(FIGURE)
