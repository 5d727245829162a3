"""Trials of one group laid over one another, directions told apart, outliers marked."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from armimpedance.core.records import Recording
from armimpedance.hand.still.show.session.aligned import Aligned, align, chosen, rows_of
from armimpedance.hand.still.show.session.look import (
    axis_name,
    direction_look,
    draw_lines,
    force_label,
    motion_label,
    short_list,
    zero_line,
)
from armimpedance.show.plots import TWO_COLUMNS_IN, new_figure, panel_letters, print_style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: More directions than this are not told apart by name.
_MOST_NAMED = 8
#: What the legend calls trials that are looked at one by one.
_MARKED = ("left out", "unlike the others")


def plot_trials(
    recording: Recording,
    keys: Mapping[str, Any],
    outliers: Collection[int] | None = None,
) -> Figure:
    """Draw displacement and force of every trial of a group from the onset, axis by axis.

    Colour and line tell the directions: opposite ones share a colour, and one of the two is dashed.

    Parameters
    ----------
    recording : Recording
        Of the hand or of joints.
    keys : mapping
        Columns of the trial table and values of the group, as `ImpedanceEstimate.keys`.
    outliers : collection of int, optional
        Numbers of trials to mark; without it those that `outlying_trials` finds.

    Returns
    -------
    Figure
        Displacement above force, a column for each axis.

    Raises
    ------
    InputError
        No trial is of that group, or no onset is stated or seen.

    Examples
    --------
    >>> from armimpedance.hand.still.show import plot_trials
    >>> from manipulandum_sim.hand import simulate
    >>> recording, _ = simulate("cocontraction", seed=1, sets=1, conditions=["cocontraction_10"])
    >>> figure = plot_trials(recording, {"condition": "cocontraction_10"})
    >>> [ax.get_ylabel() for ax in figure.axes[::2]]
    ['displacement (mm)', 'force (N)']
    """
    aligned = align(recording, rows_of(recording, keys))
    marked = chosen(aligned, outliers)
    d, (name, factor) = recording.axes, motion_label(recording.kind)
    with print_style():
        figure = new_figure(TWO_COLUMNS_IN, 4.0)
        axes = figure.subplots(2, d, sharex=True, sharey="row", squeeze=False)
        for i in range(d):
            _draw(axes[0, i], aligned, factor * aligned.moved[..., i], marked)
            _draw(axes[1, i], aligned, aligned.pushed[..., i], marked)
            axes[0, i].set_title(axis_name(recording.kind, i))
            axes[1, i].set_xlabel("time from onset (ms)" if aligned.lag_s[0] < 0 else "time (ms)")
        axes[0, 0].set_ylabel(name)
        axes[1, 0].set_ylabel(force_label(recording.kind))
        figure.align_ylabels(list(axes[:, 0]))
        panel_letters(list(axes.flat))
        _legend(figure, axes[0, 0])
    return figure


def _draw(ax: Axes, aligned: Aligned, lines: Any, marked: Any) -> None:
    thin, time_ms = aligned.thin(), 1e3 * aligned.lag_s
    zero_line(ax)
    labels = aligned.direction
    count = 1 if labels is None else int(labels.max()) + 1
    plain = aligned.used & ~marked
    for number in range(count):
        own = plain if labels is None else plain & (labels == number)
        named = bool(aligned.direction_names) and count <= _MOST_NAMED
        label = aligned.direction_names[number] if named else ("trials" if number == 0 else "")
        look = direction_look(number, count) | {"linewidth": 0.6}
        draw_lines(ax, time_ms[thin], lines[own][:, thin], label, **look)
    for rows, what, color in (
        (~aligned.used & ~marked, _MARKED[0], "0.6"),
        (marked, _MARKED[1], "black"),
    ):
        label = f"{what}: trial {short_list(aligned.trial[rows].tolist())}"
        look = {"color": color, "linewidth": 1.3, "zorder": 3}
        draw_lines(ax, time_ms[thin], lines[rows][:, thin], label, **look)
    ax.set_xlim(time_ms[thin][0], time_ms[thin][-1])


def _legend(figure: Figure, ax: Axes) -> None:
    """Directions above the panels, marked trials below; lines thick enough for their style."""
    handles, labels = ax.get_legend_handles_labels()
    marked = [label.startswith(_MARKED) for label in labels]
    places: dict[bool, Any] = {False: "outside upper center", True: "outside lower center"}
    for below, place in places.items():
        rows = [row for row, is_marked in enumerate(marked) if is_marked == below]
        if not rows:
            continue
        made = figure.legend(
            [handles[row] for row in rows],
            [labels[row] for row in rows],
            loc=place,
            ncols=1 if below else min(8, len(rows)),
            handlelength=1.6,
            columnspacing=1.2,
        )
        for line in made.legend_handles:
            if line is not None:
                thick = np.maximum(1.2, line.get_linewidth())  # type: ignore[attr-defined]
                line.set_linewidth(thick)  # type: ignore[attr-defined]
