"""Fitted against measured force of the best and the worst trial; residuals and their spectrum."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import FORCE_UNIT
from armimpedance.core.records import ImpedanceEstimate, Recording
from armimpedance.hand.still.show.session.fitted import Fitted, fitted_force
from armimpedance.hand.still.show.session.look import (
    MARKED,
    axis_name,
    direction_look,
    draw_lines,
    force_label,
    zero_line,
)
from armimpedance.show.plots import (
    OKABE_ITO,
    TWO_COLUMNS_IN,
    new_figure,
    panel_letters,
    print_style,
    unit_text,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: The smoothing of a disturbance passes next to nothing beyond this (Hz), nor does a fitted band.
_HIGHEST_HZ = {"trial": 25.0, "block": 60.0}


def plot_fit(recording: Recording, estimate: ImpedanceEstimate) -> Figure:
    """Draw the force of the trials that M, B and K explain best and worst, measured and fitted.

    An offset and a ramp are removed from both, as in the fit: they are what the limb did on its
    own. Of a stochastic perturbation the trials are its blocks of one second.

    Parameters
    ----------
    recording : Recording
        The one that was estimated.
    estimate : ImpedanceEstimate
        Of one of its groups; its `keys` say which.

    Returns
    -------
    Figure
        The best trial above the worst, a column for each axis.

    Raises
    ------
    InputError
        No trial of the recording is of the estimate's group.

    Examples
    --------
    >>> import armimpedance as ai
    >>> from armimpedance.hand.still.show import plot_fit, plot_residuals
    >>> from manipulandum_sim.hand import simulate
    >>> recording, _ = simulate("cocontraction", seed=1, sets=1, conditions=["cocontraction_10"])
    >>> estimate = ai.estimate(recording)[0]
    >>> len(plot_fit(recording, estimate).axes)
    4
    >>> plot_residuals(recording, estimate).axes[-1].get_xlabel()
    'frequency (Hz)'
    """
    shown = fitted_force(recording, estimate)
    explained = shown.explained
    with print_style():
        figure = new_figure(TWO_COLUMNS_IN, 3.6)
        d = shown.measured.shape[2]
        axes = figure.subplots(2, d, sharex=True, sharey=True, squeeze=False)
        for row, (word, trial) in enumerate(
            (("best", int(explained.argmax())), ("worst", int(explained.argmin())))
        ):
            _draw_trial(axes[row], shown, trial)
            for i, ax in enumerate(axes[row]):
                ax.set_title(
                    f"{word}: {shown.unit_name} {shown.trial[trial]}, "
                    f"{axis_name(shown.kind, i)}, {100 * explained[trial]:.1f} % explained"
                )
        for ax in axes[-1]:
            ax.set_xlabel(_time_label(shown))
        panel_letters(list(axes.flat))
        handles, labels = axes[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=3)
    return figure


def _time_label(shown: Fitted) -> str:
    return "time from onset (ms)" if shown.unit_name == "trial" else "time in the block (ms)"


def _draw_trial(row: list[Axes], shown: Fitted, trial: int) -> None:
    time_ms = 1e3 * shown.lag_s
    for i, ax in enumerate(row):
        zero_line(ax)
        measured, fitted = shown.measured[trial, :, i], shown.fitted[trial, :, i]
        ax.plot(time_ms, measured, color="black", linewidth=1.6, alpha=0.55, label="measured")
        ax.plot(
            time_ms, fitted, color=MARKED, linewidth=1.0, linestyle=(0, (4, 1.5)), label="fitted"
        )
        ax.set_xlim(time_ms[0], time_ms[-1])
    row[0].set_ylabel(force_label(shown.kind))


def plot_residuals(recording: Recording, estimate: ImpedanceEstimate) -> Figure:
    """Draw what M, B and K leave unexplained: of each trial over time, and over frequency.

    A direction's mean that departs from zero is no noise: a reflex, friction, a delay. Over
    frequency the residual's amplitude stands below the force's where the model explains the force.

    Parameters
    ----------
    recording : Recording
        The one that was estimated.
    estimate : ImpedanceEstimate
        Of one of its groups; its `keys` say which.

    Returns
    -------
    Figure
        Residuals of each axis, then their amplitude spectra.

    Raises
    ------
    InputError
        No trial of the recording is of the estimate's group.

    See Also
    --------
    plot_fit : With an example of both.
    """
    shown = fitted_force(recording, estimate)
    d = shown.measured.shape[2]
    with print_style():
        figure = new_figure(TWO_COLUMNS_IN, 3.9)
        axes = figure.subplots(2, d, sharey="row", squeeze=False)
        for i in range(d):
            _draw_residuals(axes[0, i], shown, i)
            axes[0, i].set_title(axis_name(shown.kind, i))
            _draw_spectra(axes[1, i], shown, i)
        axes[0, 0].set_ylabel(f"residual ({unit_text(FORCE_UNIT[shown.kind])})")
        axes[1, 0].set_ylabel(f"amplitude ({unit_text(FORCE_UNIT[shown.kind])})")
        panel_letters(list(axes.flat))
        for row, columns in ((0, 2), (1, 2)):
            axes[row, 0].legend(loc="upper right", ncols=columns, borderaxespad=0.1)
    return figure


def _draw_residuals(ax: Axes, shown: Fitted, i: int) -> None:
    residual, time_ms = shown.residual[..., i], 1e3 * shown.lag_s
    zero_line(ax)
    draw_lines(ax, time_ms, residual, f"each {shown.unit_name}", color="0.7", linewidth=0.4)
    labels = shown.direction
    if labels is None:
        ax.plot(time_ms, residual.mean(axis=0), color=OKABE_ITO["blue"], lw=1.4, label="mean")
    else:
        count = int(labels.max()) + 1
        for number in np.unique(labels):
            mean = residual[labels == number].mean(axis=0)
            name = "mean of each direction" if number == labels.min() else None
            ax.plot(time_ms, mean, **direction_look(int(number), count), lw=1.1, label=name)
    ax.set_xlim(time_ms[0], time_ms[-1])
    ax.set_xlabel(_time_label(shown))
    low, high = ax.get_ylim()
    ax.set_ylim(low, high + 0.15 * (high - low))


def _draw_spectra(ax: Axes, shown: Fitted, i: int) -> None:
    frequency, force = spectrum(shown.measured[..., i], shown.rate_hz)
    residual = spectrum(shown.residual[..., i], shown.rate_hz)[1]
    known = (frequency > 0) & (frequency <= min(_HIGHEST_HZ[shown.unit_name], shown.rate_hz / 2))
    own = {"color": OKABE_ITO["blue"], "linestyle": "--", "label": "residual"}
    ax.semilogy(frequency[known], force[known], color="black", label="force")
    ax.semilogy(frequency[known], residual[known], **own)
    ax.yaxis.set_major_formatter("{x:g}")
    ax.set_xlim(0, frequency[known].max())
    ax.set_xlabel("frequency (Hz)")


def spectrum(signals: FloatArray, rate_hz: float) -> tuple[FloatArray, FloatArray]:
    """Frequencies (Hz) and the root mean square amplitude over trials (T, S) in one bin."""
    window = np.hanning(signals.shape[1])
    # a sine of amplitude 1 stands as 1 in its bin
    transformed = 2 * np.abs(np.fft.rfft(signals * window, axis=1)) / window.sum()
    frequency = np.fft.rfftfreq(signals.shape[1], 1 / rate_hz)
    return np.asarray(frequency), np.asarray(np.sqrt((transformed**2).mean(axis=0)))
