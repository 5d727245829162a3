"""Passive joints: the torque that was measured, what the parameters make of it, and the rest."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from armimpedance.passive.methods import method_named
from armimpedance.passive.result import PassiveFit
from armimpedance.passive.samples import PassiveSamples
from armimpedance.plots.style import (
    OKABE_ITO,
    TWO_COLUMNS_IN,
    label_axes,
    new_axes,
    new_figure,
    print_style,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_ROW_IN = 1.9
#: Measured solid, estimated dashed, the difference dotted, as in Venture's Figs 6-9.
_LOOK = (
    ("measured", OKABE_ITO["blue"], "-", 1.2),
    ("estimated", OKABE_ITO["vermillion"], (0, (4, 1.5)), 1.2),
    ("difference", "0.2", (0, (1, 1.5)), 0.9),
)


def plot_passive_fit(
    fit: PassiveFit, samples: PassiveSamples, ax: Axes | None = None, title: str | None = None
) -> Axes:
    """Draw the passive torque Y, its estimate ``W X`` and their difference over time.

    Trials follow one another with a gap; rows that the method leaves out at their ends are not
    drawn.

    Parameters
    ----------
    fit : PassiveFit
    samples : PassiveSamples
        Those of the fit, or others that hold its joint.
    """
    one = samples.only(samples.joint(fit.joint))
    equations = method_named(fit.method).equations(one, fit.terms)
    with print_style():
        ax = new_axes(TWO_COLUMNS_IN, _ROW_IN) if ax is None else ax
        start = 0.0
        for number, (W, Y) in enumerate(zip(equations.W, equations.Y, strict=True)):
            time = start + np.arange(len(Y)) / samples.sample_rate_hz
            estimated = fit.torque_fit.predict(W)[:, 0]
            lines = (Y[:, 0], estimated, Y[:, 0] - estimated)
            for line, (label, color, style, width) in zip(lines, _LOOK, strict=True):
                label = label if number == 0 else "_"
                ax.plot(time, line, color=color, ls=style, lw=width, label=label)
            start = time[-1] + 1.0
        ax.margins(x=0.01)
        if title is not None:
            ax.set_title(title, loc="left")
        label_axes(ax, "time (s)", "torque (Nm)")
        ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, borderaxespad=0.2)
    return ax


def plot_passive_fits(fits: Sequence[PassiveFit], samples: PassiveSamples) -> Figure:
    """One row a joint."""
    figure = new_figure(TWO_COLUMNS_IN, _ROW_IN * len(fits))
    with print_style():
        axes = figure.subplots(len(fits), squeeze=False)[:, 0]
    for ax, fit in zip(axes, fits, strict=True):
        plot_passive_fit(fit, samples, ax, title=fit.joint.replace("_", " "))
    return figure
