"""Tsuji (1997), Fig. 14: the hand's stiffness ellipse over activation of single-joint muscles."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from armimpedance.muscles.show import activation_surfaces, plot_ellipse_surfaces
from armimpedance.show.plots import Surface
from armimpedance_figures.source_figure import SourceFigure, design, script
from armimpedance_figures.tsuji1997.over_activation import EXPERIMENTS, OverActivation, fit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Muscles from 0: pectoralis and brachialis; infraspinatus and lateral triceps.
FLEXORS, EXTENSORS = (0, 2), (1, 3)
TWO_JOINT = 0.1
#: Points along each activation.
COUNT = 81


def draw(fits: OverActivation) -> Figure:
    """Surfaces above, maps below."""
    figure: Figure = plot_ellipse_surfaces(surfaces(fits))[0, 0].figure
    return figure


def surfaces(fits: OverActivation) -> dict[str, Surface]:
    """Over the larger part of what was measured of each pair."""
    model = fits.ours[fits.drawn_order]
    most = model.activation_range[:, 1]
    reach = [1.15 * float(min(most[list(pair)])) for pair in (FLEXORS, EXTENSORS)]
    return activation_surfaces(
        model,
        fits.arm,
        "stiffness",
        along_x=FLEXORS,
        along_y=EXTENSORS,
        others=TWO_JOINT,
        reach=reach,
        labels=("flexors (% MVC)", "extensors (% MVC)"),
        count=COUNT,
    )


def caption(fits: OverActivation) -> str:
    """What is shown, how much of it rests on measurements, what differs."""
    model = fits.ours[fits.drawn_order]
    outside = 100 * float(np.mean(surfaces(fits)["size"].extrapolated))
    return (
        "After Tsuji (1997), Fig. 14: predicted size (a), orientation from the line shoulder to "
        "hand (b) and shape (c) of the hand's stiffness ellipse over the activation of "
        "single-joint flexors (alpha_1 = alpha_3) and extensors (alpha_2 = alpha_4), "
        f"two-joint muscles at alpha_5 = alpha_6 = {TWO_JOINT:g}, nominal posture, no hand force, "
        f"N = {model.order}. "
        "No measurement lies in this plane: it is drawn where each activation was measured and the "
        "combination is no farther from the measured ones than they are from one another "
        f"(leverage); the rest ({outside:.0f} % of the maps), grey net above and hatched below, "
        "extrapolates, and crosses say that the matrix is not positive definite. Each surface is "
        "seen from the side to which it falls. "
        f"{design(*fits.studied)}, moment arms of Selen et al. (2009). Differs from the source: "
        "simulated; what is extrapolated is marked; maps beside the surfaces."
    )


FIGURE = SourceFigure(
    "tsuji1997_fig14_single_joint_activation", EXPERIMENTS, "B", draw, caption, fit=fit
)

if __name__ == "__main__":
    script(FIGURE)
