"""Tsuji (1997), Fig. 10: the hand's stiffness ellipse over shoulder and elbow angle."""

from __future__ import annotations

from armimpedance_figures.over_posture import figure_over_posture
from armimpedance_figures.source_figure import script

FIGURE = figure_over_posture("tsuji1997_fig10_stiffness_over_posture", 10, "stiffness")

if __name__ == "__main__":
    script(FIGURE)
