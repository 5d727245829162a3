"""Impedance along a reach: ellipses on the path, and elements over the way with their intervals."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from armimpedance.arrays import FloatArray
from armimpedance.conventions import MATRICES, UNITS, group_name
from armimpedance.errors import InputError
from armimpedance.plots.ellipses.ellipse import plot_ellipse
from armimpedance.plots.ellipses.parts import (
    default_scale,
    draw_scale_bar,
    matrix_of,
    one_legend,
)
from armimpedance.plots.paper.letters import panel_letters
from armimpedance.plots.style import (
    OKABE_ITO,
    TWO_COLUMNS_IN,
    label_axes,
    new_figure,
    print_style,
    unit_text,
)
from armimpedance.records import ImpedanceEstimate

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_COLORS = ("blue", "vermillion", "green", "purple")
_MARKERS = ("o", "s", "^", "D")
_HEIGHT_IN = 2.9


def plot_movement(estimates: Sequence[ImpedanceEstimate], axes: Any = None) -> Any:
    """Draw K's ellipses along the path, and the elements of K and B over the way.

    Parameters
    ----------
    estimates : sequence of ImpedanceEstimate
        Of a moving hand, phase by phase; several conditions have colours of their own.
    axes : (3,) array of Axes, optional
        Where to draw; without it a new figure is made.

    Returns
    -------
    axes : (3,) array of Axes

    Raises
    ------
    InputError
        An estimate is not of a hand with a place.
    """
    if not estimates or any(e.level != "hand" or e.position is None for e in estimates):
        raise InputError("no estimates of a moving hand", expected="rows of `movement` at the hand")
    with print_style():
        if axes is None:
            axes = new_figure(TWO_COLUMNS_IN, _HEIGHT_IN).subplots(1, 3, width_ratios=(1, 1.3, 1.3))
        _draw_path(axes[0], estimates)
        way = way_of(estimates)
        for ax, which in zip(axes[1:], ("stiffness", "viscosity"), strict=True):
            _draw_elements(ax, estimates, way, which)
        one_legend(axes[0].figure, [axes[1]], columns=4)
        panel_letters(axes)
    return axes


def way_of(estimates: Sequence[ImpedanceEstimate]) -> FloatArray:
    """How far each hand is from the first, along the line from the first to the last, m."""
    place = np.array([e.position for e in estimates])
    line = place[-1] - place[0]
    length = float(np.hypot(*line))
    return np.asarray((place - place[0]) @ line / length if length > 0 else np.zeros(len(place)))


def _conditions(estimates: Sequence[ImpedanceEstimate]) -> dict[str, list[int]]:
    """Condition -> its rows."""
    found: dict[str, list[int]] = {}
    for row, estimate in enumerate(estimates):
        keys = {name: value for name, value in estimate.keys.items() if name != "phase"}
        found.setdefault(group_name(keys), []).append(row)
    return found


def _draw_path(ax: Axes, estimates: Sequence[ImpedanceEstimate]) -> None:
    from matplotlib.ticker import MaxNLocator

    matrices = [matrix_of(e, "stiffness") for e in estimates]
    hands = np.array([e.position for e in estimates])
    scale = default_scale(matrices, hands)
    for color, rows in zip(_cycled(_COLORS), _conditions(estimates).values(), strict=False):
        ax.plot(*hands[rows].T, "-", color="0.7", linewidth=1.0)
        for row in rows:
            plot_ellipse(
                *(estimates[row], ax, hands[row], scale, "stiffness", True),
                color=OKABE_ITO[color],
                linewidth=0.8,
            )
    middle, half = (hands.max(axis=0) + hands.min(axis=0)) / 2, np.ptp(hands, axis=0).max()
    half = max(0.75 * half, 0.05)
    ax.set(xlim=middle[0] + half * np.array([-1, 1]), ylim=middle[1] + half * np.array([-1, 1]))
    ax.xaxis.set_major_locator(MaxNLocator(3))
    draw_scale_bar(ax, matrices, scale, UNITS["hand"]["K"])
    label_axes(ax, "x (m)", "y (m)")


def _draw_elements(
    ax: Axes, estimates: Sequence[ImpedanceEstimate], way: FloatArray, which: str
) -> None:
    """The four elements of one matrix over the way, each with its 95 % interval."""
    symbol = MATRICES[which][0]
    place = list(MATRICES).index(which)
    value = np.array([e.parameters.reshape(3, 4)[place] for e in estimates])
    limits = np.array([e.interval()[:, place].reshape(2, 4) for e in estimates])
    step = 0.012 * max(float(np.ptp(way)), 0.02)
    for n, rows in enumerate(_conditions(estimates).values()):
        for k, name in enumerate(("xx", "xy", "yx", "yy")):
            ax.errorbar(
                1e2 * (way[rows] + (k - 1.5) * step),
                value[rows, k],
                yerr=np.abs(limits[rows, :, k].T - value[rows, k]),
                color=OKABE_ITO[_COLORS[k]],
                marker=_MARKERS[k],
                markersize=3.5,
                linewidth=0.9,
                linestyle="-" if n == 0 else "--",
                capsize=2,
                label=f"{name}" if n == 0 else None,
            )
    ax.axhline(0.0, color="0.8", linewidth=0.6, zorder=0)
    label_axes(ax, "way (cm)", f"{symbol} ({unit_text(UNITS['hand'][symbol])})")


def _cycled(names: Sequence[str]) -> Sequence[str]:
    return [*names] * 8
