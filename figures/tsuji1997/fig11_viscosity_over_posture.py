"""Tsuji (1997), Fig. 11: the hand's viscosity ellipse over shoulder and elbow angle."""

from __future__ import annotations

from armimpedance_figures.source_figure import script
from armimpedance_figures.tsuji1997.over_posture import figure_over_posture

FIGURE = figure_over_posture("tsuji1997_fig11_viscosity_over_posture", 11, "viscosity")

if __name__ == "__main__":
    script(FIGURE)
