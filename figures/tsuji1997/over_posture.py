"""What Figs 10 and 11 of Tsuji (1997) share: hand ellipses over posture, model and measured."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from armimpedance.limb.arm import TwoLinkArm, arm_of
from armimpedance.muscles.models import PostureModel, correlation, fit_posture_model
from armimpedance.muscles.show import (
    PARAMETERS,
    Predicted,
    plot_ellipse_surfaces,
    posture_points,
    posture_surfaces,
)
from armimpedance.show.plots import MeasuredPoints
from armimpedance_figures.source_figure import POOLED, SourceFigure, design
from armimpedance_figures.tsuji1997.rows import rows_of, without_errors
from armimpedance_figures.tsuji1997.study import StudiedExperiment

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Points along each angle.
COUNT = 49


@dataclass(frozen=True)
class OverPosture:
    """The source's first-order model, and one with a constant joint impedance beside it."""

    studied: StudiedExperiment
    arm: TwoLinkArm
    model: PostureModel
    constant: PostureModel


def fit(studied: StudiedExperiment) -> OverPosture:
    """Least squares of L = 1 and L = 0."""
    rows = without_errors(rows_of(studied))
    first, constant = (fit_posture_model(rows, order=L, model="polynomial") for L in (1, 0))
    return OverPosture(studied, arm_of(studied.subject), first, constant)


def figure_over_posture(name: str, number: int, which: Predicted) -> SourceFigure:
    """Fig. 10 (stiffness) or 11 (viscosity)."""
    return SourceFigure(name, ("postures",), "A", _draw(which), _caption(number, which), fit=fit)


def _draw(which: Predicted) -> Callable[[OverPosture], Figure]:
    def draw(fits: OverPosture) -> Figure:
        """Surfaces above, maps below."""
        surfaces = posture_surfaces(fits.model, fits.arm, which, count=COUNT)
        points = posture_points(fits.model, fits.arm, fits.studied.hand, which)
        figure: Figure = plot_ellipse_surfaces(surfaces, points)[0, 0].figure
        return figure

    return draw


def _caption(number: int, which: Predicted) -> Callable[[OverPosture], str]:
    def caption(fits: OverPosture) -> str:
        """What is shown, how near the points are, what differs."""
        near = _correlations(posture_points(fits.model, fits.arm, fits.studied.hand, which))
        flat = _correlations(posture_points(fits.constant, fits.arm, fits.studied.hand, which))
        return (
            f"After Tsuji (1997), Fig. {number}: size (a), orientation from the line shoulder to "
            f"hand (b) and shape (c) of the hand's {which} ellipse over both joint angles. Above: "
            "first-order model (L = 1, least squares) as a surface, grey net where it "
            "extrapolates, seen from the side to which it falls; measured points on stems, filled "
            "above the surface, open below. Below: the same as maps, points in the colours of "
            "their measured values, hatched outside of the measured postures, crosses where there "
            "is no ellipse. "
            f"Measured against predicted: R = {near}; with a joint {which} that is the same at all "
            f"postures already {flat}: that much is the arm's geometry alone. "
            f"{design(fits.studied)}. {POOLED}"
        )

    return caption


def _correlations(points: dict[str, MeasuredPoints]) -> str:
    """Of size, orientation and shape, where both have an ellipse."""
    values = []
    for name in PARAMETERS:
        known = np.isfinite(points[name].values) & np.isfinite(points[name].predicted)
        values.append(correlation(points[name].values[known], points[name].predicted[known]))
    return ", ".join(f"{v:.2f}" for v in values[:-1]) + f" and {values[-1]:.2f}"
