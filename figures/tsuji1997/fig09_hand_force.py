"""Tsuji (1997), Fig. 9: stiffness ellipses over direction and amplitude of the hand force."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from armimpedance.core.conventions import FORCE_UNIT_N
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.hand.show import plot_ellipse_rose
from armimpedance.show.plots import TWO_COLUMNS_IN, new_figure, print_style
from armimpedance_figures.source_figure import POOLED, SourceFigure, design, script
from armimpedance_figures.tsuji1997.study import StudiedExperiment

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SIZES = (0.5, 1.0, 2.0, 3.0)


def _targets(studied: StudiedExperiment) -> dict[str, np.ndarray]:
    trials = studied.trials.drop_duplicates("condition")
    columns = trials[["target_force_x_N", "target_force_y_N"]].to_numpy(dtype=float)
    return dict(zip(trials["condition"], columns, strict=True))


def _of_size(studied: StudiedExperiment, size: float) -> list[ImpedanceEstimate]:
    return [e for e in studied.hand if e.keys["condition"].startswith(f"force_{size:.1f}_")]


def draw(studied: StudiedExperiment) -> Figure:
    """One panel per amplitude; all panels share the scale of the ellipses, relative to the axes."""
    targets = _targets(studied)
    with print_style():
        figure = new_figure(TWO_COLUMNS_IN, 6.6)
        for ax, size in zip(figure.subplots(2, 2).flat, SIZES, strict=True):
            found = _of_size(studied, size)
            forces = np.array([targets[e.keys["condition"]] for e in found])
            plot_ellipse_rose(found, "stiffness", ax, forces, _scale(studied, size))
            reach = 1.5 * size * FORCE_UNIT_N
            ax.set(xlim=(-reach, reach), ylim=(-1.15 * reach, reach))
            ax.set_title(f"{size:g} x {FORCE_UNIT_N} N")
    return figure


def _scale(studied: StudiedExperiment, size: float) -> float:
    """Axes' N per N/m such that ellipses keep their size on paper from panel to panel."""
    largest = max(np.linalg.eigvalsh(e.stiffness + e.stiffness.T)[-1] / 2 for e in studied.hand)
    return 0.52 * size * FORCE_UNIT_N / float(largest)


def caption(studied: StudiedExperiment) -> str:
    """What is shown and what differs."""
    return (
        "After Tsuji (1997), Fig. 9: hand stiffness in the nominal posture while the hand holds a "
        "force; each ellipse stands at its target force, shaded 95 % band (hardly wider than the "
        "line). 0.5, 1 and 2 x 9.8 N in eight directions, 3 x 9.8 N along y only. "
        f"{design(studied)}. {POOLED}"
    )


FIGURE = SourceFigure("tsuji1997_fig09_hand_force", ("force",), "C", draw, caption)

if __name__ == "__main__":
    script(FIGURE)
