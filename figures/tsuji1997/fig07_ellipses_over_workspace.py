"""Tsuji (1997), Fig. 7: ellipses of inertia, stiffness and viscosity over the workspace."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from armimpedance.arrays import FloatArray
from armimpedance.ellipses import Which
from armimpedance.plots import (
    TWO_COLUMNS_IN,
    default_scale,
    new_figure,
    plot_ellipses_in_workspace,
    print_style,
)
from armimpedance_figures.source_figure import POOLED, SourceFigure, design, one_legend, script
from armimpedance_figures.tsuji1997.study import StudiedExperiment

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Ellipses may reach into their neighbours' cells by this factor: most are thin and alike.
OVERLAP = 1.3
PANELS: tuple[tuple[str, Which], ...] = (
    ("(a) inertia", "inertia"),
    ("(b) stiffness", "stiffness"),
    ("(c) viscosity", "viscosity"),
)


def draw(studied: StudiedExperiment) -> Figure:
    """Three panels; the two-link model's inertia dashed in the first."""
    models = [studied.model_inertia(found) for found in studied.hand]
    upper_arm = studied.recording.subject.upper_arm_m
    hands = np.array([found.position for found in studied.hand])
    with print_style():
        figure = new_figure(TWO_COLUMNS_IN, 3.8)
        axes = figure.subplots(1, 3, sharex=True, sharey=True)
        for ax, (title, which) in zip(axes, PANELS, strict=True):
            matrices = _usual([getattr(found, which) for found in studied.hand])
            plot_ellipses_in_workspace(
                studied.hand,
                which,
                ax,
                models if which == "inertia" else None,
                "two-link model",
                upper_arm,
                scale=OVERLAP * default_scale(matrices, hands),
            )
            ax.set(title=title, ylim=(-0.13, 0.66))
            ax.label_outer()
        one_legend(figure, axes)
    return figure


def _usual(matrices: list[FloatArray]) -> list[FloatArray]:
    """Without the largest quarter: the outstretched arm's ellipses would make the others specks."""
    ordered = sorted(matrices, key=lambda m: float(np.linalg.eigvalsh(m + m.T)[-1]))
    return ordered[: max(1, 3 * len(ordered) // 4)]


def caption(studied: StudiedExperiment) -> str:
    """What is shown and what differs."""
    return (
        "After Tsuji (1997), Fig. 7: estimated inertia (a), stiffness (b) and viscosity (c) of the "
        "relaxed arm, each ellipse at its hand location, shaded 95 % band (hardly wider than the "
        "line); dashed in (a): inertia of a two-link arm from body mass and segment lengths "
        "(Winter's table), eq. (17); the simulated limb has segments of the same table, so the "
        f"model should agree. {design(studied)}. {POOLED}"
    )


FIGURE = SourceFigure("tsuji1997_fig07_ellipses_over_workspace", ("postures",), "A", draw, caption)

if __name__ == "__main__":
    script(FIGURE)
