"""Tsuji (1997), Figs 12 and 13: joint stiffness and viscosity, measured against predicted."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.special import stdtrit

from armimpedance.core.arrays import FloatArray
from armimpedance.hand.show import one_legend
from armimpedance.muscles.models import ELEMENTS, JointPrediction
from armimpedance.muscles.show import plot_predicted_against_measured
from armimpedance.show.plots import TWO_COLUMNS_IN, element_text, new_figure, print_style
from armimpedance_figures.source_figure import SourceFigure, design, script
from armimpedance_figures.table_cells import number
from armimpedance_figures.tsuji1997.over_activation import EXPERIMENTS, OverActivation, fit
from armimpedance_figures.tsuji1997.rows import by_element

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MATRICES = (("K", "stiffness", "N m/rad"), ("B", "viscosity", "N m s/rad"))
GROUPS = ("co-contraction", "hand force")


def draw(fits: OverActivation) -> Figure:
    """Elements of K above, of B below."""
    prediction = _prediction(fits)
    with print_style():
        figure = new_figure(TWO_COLUMNS_IN, 5.0)
        axes = figure.subplots(2, 3)
        for row, (symbol, which, unit) in zip(axes, MATRICES, strict=True):
            measured, half = _measured(fits, symbol)
            for i, (ax, element) in enumerate(zip(row, ELEMENTS, strict=True)):
                plot_predicted_against_measured(
                    getattr(prediction, which)[:, i],
                    measured[:, i],
                    prediction.half_width(which)[:, i],
                    half[:, i],
                    _groups(fits),
                    ax,
                    label=f"{element_text(f'{symbol}_{element}')} ({unit})",
                )
                words = _correlations(fits, f"{symbol}_{element}")
                ax.text(0.98, 0.03, words, transform=ax.transAxes, ha="right", fontsize=7.5)
        one_legend(figure, axes.ravel())
    return figure


def _prediction(fits: OverActivation) -> JointPrediction:
    return fits.ours[fits.drawn_order].predict(fits.rows.activation)  # type: ignore[arg-type]


def _measured(fits: OverActivation, symbol: str) -> tuple[FloatArray, FloatArray]:
    """Elements (P, 3) and half-widths of their 95 % intervals."""
    values, sd = fits.rows.elements(symbol)
    dof = np.array([e.dof for one in fits.studied for e in one.joint])
    return values, stdtrit(dof, 0.975)[:, None] * np.asarray(sd)


def _groups(fits: OverActivation) -> list[str]:
    return [name for name, one in zip(GROUPS, fits.studied, strict=True) for _ in one.joint]


def _correlations(fits: OverActivation, element: str) -> str:
    found = [f"{by_element(m.quality)[element].r:.3f}" for m in fits.ours.values()]
    return f"R = {', '.join(found)}"


def table(fits: OverActivation) -> list[list[str]]:
    """One row per condition and element: measured and predicted with half-widths."""
    prediction = _prediction(fits)
    header = ("experiment", "condition", "element", "unit", "measured", "predicted")
    rows = [[*header, "measured_half_width", "predicted_half_width"]]
    groups = _groups(fits)
    for symbol, which, unit in MATRICES:
        measured, half = _measured(fits, symbol)
        model, model_half = getattr(prediction, which), prediction.half_width(which)
        for p, name in enumerate(fits.rows.labels):
            for i, element in enumerate(ELEMENTS):
                values = (measured[p, i], model[p, i], half[p, i], model_half[p, i])
                named = [groups[p], name, f"{symbol}_{element}", unit]
                rows.append([*named, *map(number, values)])
    return rows


def caption(fits: OverActivation) -> str:
    """What is shown, what differs."""
    orders = ", ".join(str(order) for order in fits.ours)
    return (
        "After Tsuji (1997), Figs 12 and 13: joint stiffness (above) and viscosity (below) "
        f"measured in experiments 2 and 3 against those predicted from muscle activation, N = "
        f"{fits.drawn_order}; bars: 95 % intervals of both (of B hardly longer than the marks), "
        f"grey: identity. In each panel R for N = {orders}. {design(*fits.studied)}, moment "
        f"arms of Selen et al. (2009). {' '.join(fits.left_out)} Differs from the source: "
        "simulated; pooled disturbances; the terms of hand force and of the curvature of the "
        "muscles' paths are in, rows are weighted by their errors."
    ).replace("  ", " ")


FIGURE = SourceFigure(
    *("tsuji1997_fig12_fig13_predicted_against_measured", EXPERIMENTS, "B", draw, caption),
    table=table,
    fit=fit,
)

if __name__ == "__main__":
    script(FIGURE)
