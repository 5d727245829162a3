"""Plot of the frequency response under random perturbations, element by element."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from armimpedance.core.conventions import UNITS
from armimpedance.hand.random.random_fit import RandomFit
from armimpedance.show.plots import (
    OKABE_ITO,
    TWO_COLUMNS_IN,
    label_axes,
    new_figure,
    print_style,
    unit_text,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_ROW_IN = 1.5
_COLORS: Final = ("blue", "vermillion", "green")
#: Standard errors of a 95 % band.
_BAND: Final = 1.96


def plot_response_matrix(fit: RandomFit, axes: Any = None) -> Any:
    """Draw the impedance over frequency, measured without a model and as fitted, and coherence.

    `fit`: one group of `random`.
    `axes` (d + 1,) of Axes: coherence, then one for each direction of force; default: those of a
    new figure.
    Returns: `ax`: the first of them.
    """
    response, d = fit.response, fit.estimate.k
    with print_style():
        if axes is None:
            figure = new_figure(TWO_COLUMNS_IN, _ROW_IN * (d + 1))
            axes = figure.subplots(d + 1, 1, sharex=True)
        for i in range(d):
            color = OKABE_ITO[_COLORS[i]]
            axes[0].plot(response.frequency_hz, response.multiple[:, i], color=color)
            _draw_row(axes[i + 1], fit, i)
        axes[0].set_ylim(0, 1.02)
        axes[0].set_ylabel("coherence")
        axes[-1].set_xlabel("frequency (Hz)")
        axes[1].legend(ncols=d, loc="upper left")
    return axes[0]


def _draw_row(ax: Axes, fit: RandomFit, i: int) -> None:
    """Draw the magnitudes of the elements of one force over the motions of all axes."""
    response, names = fit.response, _names(fit)
    how = "along" if fit.estimate.level == "hand" else "about"
    f = response.frequency_hz
    for j, color in zip(range(fit.estimate.k), _COLORS, strict=False):
        size, sd = np.abs(response.impedance[:, i, j]), response.sd[:, i, j]
        low, high = np.maximum(size - _BAND * sd, size / 10), size + _BAND * sd
        ax.fill_between(f, low, high, color=OKABE_ITO[color], alpha=0.2, linewidth=0)
        label = f"motion {how} {names[j]}"
        ax.plot(f, size, ".", color=OKABE_ITO[color], markersize=2.5, label=label)
        ax.plot(f, np.abs(response.model[:, i, j]), color=OKABE_ITO[color], linewidth=0.8)
    ax.set_yscale("log")
    ax.yaxis.set_major_formatter("{x:g}")
    unit = unit_text(UNITS[fit.estimate.level]["K"])
    label_axes(ax, "", f"|Z| of {names[i]} ({unit})")


def _names(fit: RandomFit) -> tuple[str, ...]:
    return ("x", "y", "z") if fit.estimate.level == "hand" else ("axis 1", "axis 2", "axis 3")
