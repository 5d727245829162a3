"""Plots of passive joints: activity of the muscles; measured torque, its estimate, and the
residual.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from armimpedance.core.errors import InputError
from armimpedance.core.motion import EmgSignals
from armimpedance.joint.relaxed.passive_fit import PassiveFit, PassiveFits
from armimpedance.joint.relaxed.samples import PassiveSamples
from armimpedance.numerics.signals import EmgLevel, envelope
from armimpedance.show.plots import (
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
_EMG_ROW_IN = 1.5
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

    Trials are drawn one after another with a gap; rows that the method leaves out at their ends
    are not drawn.

    Parameters
    ----------
    fit : PassiveFit
    samples : PassiveSamples
        Those of the fit, or others with its joint.
    ax : Axes, optional
        Axes to draw on; by default those of a new figure.
    title : str, optional

    Returns
    -------
    Axes
    """
    equations = fit.equations(samples)
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
        label_axes(ax, "time (s)", "torque (N m)")
        ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, borderaxespad=0.2)
    return ax


def plot_passive_fits(fits: PassiveFits) -> Figure:
    """Draw all joints' torques and their estimates, one row per joint.

    Parameters
    ----------
    fits : PassiveFits
        The fits of all joints with their samples, from `joint.relaxed.show.passive`.

    Returns
    -------
    Figure
        The figure, with a panel for each joint.

    Examples
    --------
    >>> import armimpedance as ai
    >>> from manipulandum_sim.passive import simulate_passive
    >>> markers, _ = simulate_passive("release", trials=2, duration_s=4.0)
    >>> figure = ai.plot_passive_fits(ai.passive(markers, rest_angle=1.5))
    >>> figure.axes[-1].get_xlabel()
    'time (s)'
    """
    figure = new_figure(TWO_COLUMNS_IN, _ROW_IN * len(fits))
    with print_style():
        axes = figure.subplots(len(fits), squeeze=False)[:, 0]
    for ax, fit in zip(axes, fits, strict=True):
        plot_passive_fit(fit, fits.samples, ax, title=fit.joint.replace("_", " "))
    return figure


def plot_emg_level(
    emg: EmgSignals,
    level: EmgLevel,
    row: int = 0,
    axes: Sequence[Axes] | None = None,
) -> list[Axes]:
    """Draw each muscle's envelope, its running mean and the gate, one muscle below the other.

    One period of the low-pass is left out at both ends, where the envelope is wrong.

    Parameters
    ----------
    emg : EmgSignals
        Normalised to the maximum.
    level : EmgLevel
        Result of the gate, which tests the running mean.
    row : int
        Number of the trial, from 0.
    axes : sequence of Axes, optional
        One per muscle; by default those of a new figure.

    Returns
    -------
    list of Axes

    Raises
    ------
    InputError
        EMG in V; a trial too short for the envelope.
    """
    if emg.unit != "normalised":
        raise InputError("EMG in V", expected="divided by each muscle's maximum")
    rate = emg.sample_rate_hz
    raw = emg.signals[emg.offsets[row] : emg.offsets[row + 1]]
    percent = 100 * envelope(raw, rate, cutoff_hz=level.envelope_hz)
    width = min(max(round(level.window_s * rate), 1), len(percent))
    running = np.cumsum(np.vstack([np.zeros(percent.shape[1]), percent]), axis=0)
    mean = (running[width:] - running[:-width]) / width
    time = np.arange(len(percent)) / rate
    middle = time[: len(mean)] + width / rate / 2
    end = round(rate / level.envelope_hz)
    inner, gate = slice(end, len(percent) - end), level.limit_percent
    with print_style():
        drawn = list(axes or _stacked(len(emg.muscles)))
        for m, (muscle, ax) in enumerate(zip(emg.muscles, drawn, strict=True)):
            label = f"mean over {level.window_s:g} s"
            shown = percent[inner]
            ax.plot(time[inner], shown[:, m], color=OKABE_ITO["blue"], lw=0.6, label="envelope")
            ax.plot(middle, mean[:, m], color="black", lw=1.6, label=label)
            ax.axhline(gate, color=OKABE_ITO["vermillion"], ls=(0, (4, 2)), label="gate")
            ax.set_ylim(0, 1.15 * max(gate, float(shown.max())))
            ax.margins(x=0.01)
            ax.set_title(muscle.replace("_", " "), loc="left")
            label_axes(ax, "time (s)", "EMG (% of max.)")
        for ax in drawn[:-1]:
            ax.set_xlabel("")
        drawn[0].legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, borderaxespad=0.2)
    return drawn


def _stacked(rows: int) -> list[Axes]:
    figure = new_figure(TWO_COLUMNS_IN, _EMG_ROW_IN * rows)
    return list(figure.subplots(rows, sharex=True, squeeze=False)[:, 0])
