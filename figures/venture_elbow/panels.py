"""Venture (elbow), Figs 6-9: panels of measured and estimated torque, and how well they agree."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from armimpedance.hand.show import one_legend
from armimpedance.joint.relaxed import PassiveFit, PassiveSamples
from armimpedance.joint.relaxed.show import plot_passive_fit
from armimpedance.numerics.regression import Validation
from armimpedance.show.plots import TWO_COLUMNS_IN, new_figure, print_style
from armimpedance_figures.table_cells import number

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PANEL_IN = 1.55


@dataclass(frozen=True)
class Panel:
    """Parameters, and the samples whose torque they are to explain.

    Attributes
    ----------
    title : str
    fit : PassiveFit
    samples : PassiveSamples
        Those of the fit, or others.
    """

    title: str
    fit: PassiveFit
    samples: PassiveSamples

    @cached_property
    def agreement(self) -> Validation:
        """Of the samples' torque and its estimate."""
        return self.fit.validate(self.samples)

    @property
    def heading(self) -> str:
        """Title, rms, R^2 and VAF."""
        v = self.agreement
        return f"{self.title}: rms {v.rms[0]:.3f} N m, R² {v.r2:.4f}, VAF {v.vaf:.3f}"


def draw_panels(panels: Sequence[Panel]) -> Figure:
    """One panel below the other, one legend above."""
    figure = new_figure(TWO_COLUMNS_IN, PANEL_IN * len(panels))
    with print_style():
        axes = list(figure.subplots(len(panels), squeeze=False)[:, 0])
        for panel, ax in zip(panels, axes, strict=True):
            plot_passive_fit(panel.fit, panel.samples, ax, title=panel.heading)
            if ax is not axes[-1]:
                ax.set_xlabel("")
        one_legend(figure, axes, columns=3)
    return figure


def panel_table(panels: Sequence[Panel]) -> list[list[str]]:
    """One row a panel."""
    rows = [["panel", "method", "rms_Nm", "r2_about_zero", "vaf", "correlation"]]
    for panel in panels:
        v = panel.agreement
        values = [float(v.rms[0]), v.r2, v.vaf, v.correlation]
        rows.append([panel.title, panel.fit.method, *map(number, values)])
    return rows
