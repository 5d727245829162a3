"""A session's quality in one picture: aligned trials, return, noise, force against motion."""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray
from armimpedance.core.conventions import FORCE_UNIT
from armimpedance.core.records import Recording
from armimpedance.hand.still.show.aligned_trials import Aligned, align, chosen, outlying_trials
from armimpedance.hand.still.show.trials_plot import (
    GREY,
    MARKED,
    draw_lines,
    force_label,
    motion_label,
    short_list,
    thin_line,
    zero_line,
)
from armimpedance.numerics.signals import multiple_coherence
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

#: Remaining displacement at the end, in % of the peak, above which a drift correction that relies
#: on the return fails; the check "returns to start" uses the same limit.
RETURN_PERCENT = 2.0
#: Most letters in one row of a legend.
_MOST_LETTERS = 70


def plot_quality(recording: Recording, outliers: Collection[int] | None = None) -> Figure:
    """Draw the quality of a session, all trials of all conditions.

    Panels: displacement and force of every trial from its onset; the remaining displacement after
    the disturbance; the force's noise at rest; force along the motion against the motion. For a
    stochastic perturbation the coherence replaces return and noise.

    Parameters
    ----------
    recording : Recording
        Of the hand or of joints.
    outliers : collection of int, optional
        Numbers of trials to mark; default: those of `outlying_trials`.

    Returns
    -------
    Figure
        Five panels, four for a stochastic perturbation.

    Raises
    ------
    InputError
        No onset is stated or detected.

    Examples
    --------
    >>> from armimpedance.hand.still.show import plot_quality
    >>> from manipulandum_sim.hand import simulate
    >>> recording, _ = simulate("cocontraction", seed=1, sets=1, conditions=["cocontraction_10"])
    >>> len(plot_quality(recording).axes)
    5
    """
    aligned = align(recording)
    marked = chosen(aligned, outlying_trials(recording) if outliers is None else outliers)
    with print_style():
        figure = new_figure(TWO_COLUMNS_IN, 4.6)
        if recording.perturbation == "stochastic":
            axes = list(figure.subplot_mosaic("ab;cd").values())
            _draw_courses(axes[0], axes[1], aligned, marked, recording)
            _draw_coherence(axes[2], recording)
            _draw_against(axes[3], aligned, marked, recording)
        else:
            axes = list(figure.subplot_mosaic("aaabbb;ccddee").values())
            _draw_courses(axes[0], axes[1], aligned, marked, recording)
            _draw_return(axes[2], aligned, marked)
            _draw_noise(axes[3], aligned, marked, unit_text(FORCE_UNIT[recording.kind]))
            _draw_against(axes[4], aligned, marked, recording)
        panel_letters(axes)
        handles, labels = axes[0].get_legend_handles_labels()
        columns = len(labels) if sum(map(len, labels)) < _MOST_LETTERS else 1
        figure.legend(handles, labels, loc="outside upper center", ncols=columns)
    return figure


def _draw_courses(
    left: Axes, right: Axes, aligned: Aligned, marked: BoolArray, recording: Recording
) -> None:
    """Draw the displacement of the limb, and the change of its force."""
    name, factor = motion_label(recording.kind)
    _overlay(left, aligned, marked, factor * _signed(aligned.moved))
    _overlay(right, aligned, marked, _signed(aligned.pushed))
    left.set_ylabel(name)
    right.set_ylabel(f"change of {force_label(recording.kind)}")


def _overlay(ax: Axes, aligned: Aligned, marked: BoolArray, lines: FloatArray) -> None:
    thin, time_ms = aligned.thin(), 1e3 * aligned.lag_s
    out = ~aligned.used & ~marked
    zero_line(ax)
    kinds = (
        (aligned.used & ~marked, "trials", GREY, thin_line(len(lines)), "-", 2.0),
        (out, "left out of estimates", OKABE_ITO["blue"], 0.9, (0, (3, 1.2)), 2.1),
        (marked, "unlike the others", MARKED, 1.0, "-", 2.2),
    )
    for rows, what, color, width, line, order in kinds:
        numbers = aligned.trial[rows].tolist()
        named = f"{what}: trial {short_list(numbers)}"
        label = f"{len(numbers)} {what}" if what == "trials" else named
        draw_lines(
            ax,
            time_ms[thin],
            lines[rows][:, thin],
            label,
            color=color,
            linewidth=width,
            linestyle=line,
            zorder=order,
        )
    ax.set_xlim(time_ms[thin][0], time_ms[thin][-1])
    ax.set_xlabel("time from onset (ms)" if time_ms[0] < 0 else "time (ms)")


def _signed(signal: FloatArray) -> FloatArray:
    """Norm (T, S) of a vector signal (T, S, d); the value itself with one axis."""
    return signal[..., 0] if signal.shape[2] == 1 else np.linalg.norm(signal, axis=2)


def _dots(ax: Axes, aligned: Aligned, marked: BoolArray, values: FloatArray) -> None:
    """Draw a value of each trial in the order of trials, with outliers marked."""
    order, used = np.arange(1, len(values) + 1), aligned.used & ~marked
    ax.plot(order[used], values[used], ".", color=GREY, markersize=3)
    ax.plot(order[~aligned.used], values[~aligned.used], "x", color=OKABE_ITO["blue"], ms=4)
    ax.plot(order[marked], values[marked], "o", color=MARKED, markersize=4)
    ax.set_xlabel("trial in order")
    ax.set_ylim(bottom=0.0)


def _draw_return(ax: Axes, aligned: Aligned, marked: BoolArray) -> None:
    """Draw each trial's remaining displacement at the end, % of the peak."""
    size = np.linalg.norm(aligned.moved, axis=2)
    over = aligned.lag_s >= aligned.duration_s[:, None]
    over[~over.any(axis=1), -1] = True
    remaining = np.where(over, size, 0.0).sum(axis=1) / over.sum(axis=1)
    _dots(ax, aligned, marked, 100 * remaining / np.maximum(size.max(axis=1), 1e-300))
    ax.axhline(RETURN_PERCENT, color="black", linestyle=(0, (4, 2)), linewidth=0.8)
    ax.set_ylabel("left at the end (% of peak)")


def _draw_noise(ax: Axes, aligned: Aligned, marked: BoolArray, unit: str) -> None:
    """Draw the standard deviation of the force before the onset."""
    # If trials begin at their onset there is no rest, and the panel stays empty.
    if aligned.rest.any():
        noise = aligned.pushed[:, aligned.rest].std(axis=1).max(axis=1)
        _dots(ax, aligned, marked, noise)
    ax.set_ylabel(f"noise at rest ({unit})")


def _draw_against(ax: Axes, aligned: Aligned, marked: BoolArray, recording: Recording) -> None:
    """Draw the force along the direction of the largest displacement against the displacement."""
    name, factor = motion_label(recording.kind)
    far = np.linalg.norm(aligned.moved, axis=2).argmax(axis=1)
    peak = aligned.moved[np.arange(len(far)), far]
    direction = peak / np.maximum(np.linalg.norm(peak, axis=1, keepdims=True), 1e-300)
    along, force = (np.einsum("tsd,td->ts", s, direction) for s in (aligned.moved, aligned.pushed))
    thin = aligned.thin()
    from matplotlib.collections import LineCollection

    for rows, color, width in (
        (aligned.used & ~marked, GREY, thin_line(len(along))),
        (~aligned.used & ~marked, OKABE_ITO["blue"], 0.8),
        (marked, MARKED, 1.0),
    ):
        loops = np.stack([factor * along[rows][:, thin], force[rows][:, thin]], axis=-1)
        ax.add_collection(
            LineCollection(list(loops), colors=color, linewidths=width, rasterized=len(loops) > 120)
        )
    ax.autoscale_view()
    zero_line(ax)
    ax.set_xlabel(f"{name.replace('displacement', 'motion along its way')}")
    ax.set_ylabel(f"{force_label(recording.kind)} along it")


def _draw_coherence(ax: Axes, recording: Recording) -> None:
    """Draw the share of the force that a linear limb explains, for each trial."""
    for row in range(recording.n_trials):
        at = recording.samples_of(row)
        spectrum = multiple_coherence(
            recording.position[at], recording.force[at], recording.sample_rate_hz
        )
        ax.plot(spectrum.frequency_hz, spectrum.coherence, color=GREY, linewidth=0.6)
    ax.set(xlim=(0, 60), ylim=(0, 1.02), xlabel="frequency (Hz)", ylabel="coherence")
