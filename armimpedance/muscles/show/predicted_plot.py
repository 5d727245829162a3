"""Predicted values beside measured ones."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.show.plots import OKABE_ITO, label_axes, new_axes, print_style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_GROUP_LOOKS: Final = (("o", "blue"), ("s", "vermillion"), ("^", "green"), ("D", "purple"))


def plot_predicted_against_measured(
    predicted: ArrayLike,
    measured: ArrayLike,
    predicted_half: ArrayLike,
    measured_half: ArrayLike,
    groups: Sequence[str],
    ax: Axes | None = None,
    *,
    label: str = "",
) -> Axes:
    """Draw measured values over predicted ones, with 95 % intervals of both and the identity line.

    Parameters
    ----------
    predicted, measured : (P,)
        Values in one unit.
    predicted_half, measured_half : (P,)
        Half-widths of the intervals.
    groups : (P,) sequence of str
        Experiments, told apart by shape and colour; at most four.
    ax : Axes, optional
        Drawn into a new figure without it.
    label : str
        What it is, with its unit.

    Returns
    -------
    Axes
        The axes drawn into.

    Raises
    ------
    InputError
        Vectors of different lengths, or more than four groups.

    Examples
    --------
    >>> from armimpedance.muscles.show import plot_predicted_against_measured
    >>> half, groups = [0.5, 0.5], ["force", "force"]
    >>> ax = plot_predicted_against_measured([10, 20], [11, 19], half, half, groups, label="K")
    >>> ax.get_xlabel()
    'predicted K'
    """
    x, y, x_half, y_half = (
        np.asarray(v, dtype=float) for v in (predicted, measured, predicted_half, measured_half)
    )
    names = list(dict.fromkeys(groups))
    if not x.shape == y.shape == x_half.shape == y_half.shape == (len(groups),):
        raise InputError("predicted and measured values of different numbers", expected="as many")
    if len(names) > len(_GROUP_LOOKS):
        raise InputError(f"{len(names)} groups", expected=f"at most {len(_GROUP_LOOKS)}")
    with print_style():
        ax = new_axes() if ax is None else ax
        ends = [
            min((x - x_half).min(), (y - y_half).min()),
            max((x + x_half).max(), (y + y_half).max()),
        ]
        margin = 0.04 * (ends[1] - ends[0]) or 0.04 * max(1.0, abs(float(ends[0])))
        limits = (ends[0] - margin, ends[1] + margin)
        ax.plot(limits, limits, color="0.6", linewidth=0.8, zorder=0, label="identity")
        for name, look in zip(names, _GROUP_LOOKS, strict=False):
            own = np.array([group == name for group in groups])
            _draw_group(ax, x[own], y[own], x_half[own], y_half[own], look, name)
        ax.set(xlim=limits, ylim=limits)
        ax.set_aspect("equal")
        label_axes(ax, f"predicted {label}", f"measured {label}")
    return ax


def _draw_group(
    ax: Axes,
    x: FloatArray,
    y: FloatArray,
    x_half: FloatArray,
    y_half: FloatArray,
    look: tuple[str, str],
    name: str,
) -> None:
    """Points of one experiment with bars along both axes; its look is a marker and a colour."""
    ax.errorbar(
        x,
        y,
        xerr=x_half,
        yerr=y_half,
        fmt=look[0],
        color=OKABE_ITO[look[1]],
        mfc="white",
        markersize=3.5,
        mew=0.8,
        elinewidth=0.7,
        label=name,
    )
