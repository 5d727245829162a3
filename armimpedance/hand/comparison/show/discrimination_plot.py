"""Two groups told apart: every person's value with its interval, and the threshold."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from armimpedance.hand.comparison.discrimination import Discrimination
from armimpedance.show.plots import OKABE_ITO, ONE_COLUMN_IN, new_axes, print_style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_COLORS = (OKABE_ITO["blue"], OKABE_ITO["vermillion"])
_MARKERS = ("o", "s")
#: Width of the cloud of points of one group, in units of the distance between groups.
_SPREAD = 0.5


def plot_discrimination(
    result: Discrimination, ax: Axes | None = None, *, label: str | None = None
) -> Axes:
    """Draw each person's value (95 % interval where known), the groups' means, the threshold.

    Parameters
    ----------
    result : Discrimination
    ax : Axes, optional
        Where to draw; without it a new figure is made.
    label : str, optional
        The axis label; by default the quantity.

    Returns
    -------
    Axes
    """
    with print_style():
        ax = new_axes(ONE_COLUMN_IN, 0.85 * ONE_COLUMN_IN) if ax is None else ax
        for at, group in enumerate((result.first, result.second)):
            order = np.argsort(group.values)
            x = at + _SPREAD * (np.linspace(0, 1, len(order)) - 0.5)
            error = None if group.sd is None else 1.96 * group.sd[order]
            ax.errorbar(
                x,
                group.values[order],
                error,
                fmt=_MARKERS[at],
                ms=3.5,
                lw=0.8,
                color=_COLORS[at],
                label=group.name,
            )
            mean = float(group.values.mean())
            ax.plot([at - 0.36, at + 0.36], [mean, mean], color=_COLORS[at], lw=1.6, alpha=0.6)
        ax.axhline(result.threshold, color="0.4", lw=0.8, ls=(0, (4, 2)))
        ax.text(0.5, result.threshold, "threshold", ha="center", va="bottom", fontsize=7)
        ax.set_xlim(-0.5, 1.5)
        names = [f"{g.name}\n(n = {len(g.people)})" for g in (result.first, result.second)]
        ax.set_xticks([0, 1], names)
        ax.set_ylabel(label or result.quantity)
        ax.set_title(
            f"area under ROC {result.auc:.2f} ({result.auc_ci95[0]:.2f} to "
            f"{result.auc_ci95[1]:.2f})\n{result.correct} of {result.people} in the right group, "
            "each left out",
            fontsize=8,
        )
    return ax
