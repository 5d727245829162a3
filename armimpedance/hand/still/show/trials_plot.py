"""Plots of trials: fitted and measured force, residuals, courses of a group."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import FORCE_UNIT, Kind, axis_name
from armimpedance.core.records import ImpedanceEstimate, Recording
from armimpedance.hand.still.show.aligned_trials import (
    Aligned,
    FittedForce,
    align,
    chosen,
    fitted_force,
    rows_of,
)
from armimpedance.show.plots import (
    LINE_STYLES,
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

# Common parts of the pictures of a session: thin lines, labels, the look of a direction.

#: More lines than this are stored as pixels in a vector file, which else would take megabytes.
MOST_VECTOR_LINES = 120
GREY = "0.55"
MARKED = OKABE_ITO["vermillion"]
_COLORS = ("blue", "orange", "green", "purple")


def motion_label(kind: Kind) -> tuple[str, float]:
    """Label of a displacement, and its factor from SI."""
    return ("displacement (mm)", 1e3) if kind == "hand" else ("displacement (rad)", 1.0)


def force_label(kind: Kind) -> str:
    """Label of a force or torque."""
    return f"{'force' if kind == 'hand' else 'torque'} ({unit_text(FORCE_UNIT[kind])})"


def direction_look(number: int, count: int) -> dict[str, Any]:
    """Colour and line style of a direction: opposite ones share a colour, one of them dashed."""
    half = max(1, count // 2) if count % 2 == 0 and count <= 2 * len(_COLORS) else count
    color = OKABE_ITO[_COLORS[(number % half) % len(_COLORS)]]
    if half < count:
        return {"color": color, "linestyle": LINE_STYLES[0] if number < half else (0, (3, 1.2))}
    return {"color": color, "linestyle": LINE_STYLES[(number // len(_COLORS)) % len(LINE_STYLES)]}


def draw_lines(ax: Axes, x: FloatArray, lines: FloatArray, label: str = "", **look: Any) -> None:
    """Draw many lines (n, S) over one x (S,), as one artist."""
    from matplotlib.collections import LineCollection

    if not len(lines):
        return
    points = np.stack([np.broadcast_to(x, lines.shape), lines], axis=-1)
    drawn = LineCollection(
        list(points),
        colors=look.get("color", GREY),
        linestyles=look.get("linestyle", "-"),
        linewidths=look.get("linewidth", 0.5),
        alpha=look.get("alpha"),
        zorder=look.get("zorder", 2),
        label=label or "_lines",
        rasterized=len(lines) > MOST_VECTOR_LINES,
    )
    ax.add_collection(drawn)
    ax.autoscale_view()


def zero_line(ax: Axes) -> None:
    """Draw a faint line at zero."""
    ax.axhline(0.0, color="0.8", linewidth=0.6, zorder=0)


def thin_line(count: int) -> float:
    """Width of one of many lines, points: a thousand of the usual width would be a black area."""
    return float(np.clip(0.6 / np.sqrt(max(count, 1) / 40), 0.12, 0.6))


def short_list(numbers: Sequence[int], most: int = 6) -> str:
    """Trial numbers for a legend."""
    shown = ", ".join(map(str, numbers[:most]))
    return shown + (f" and {len(numbers) - most} more" if len(numbers) > most else "")


#: Upper limit of the plotted frequency (Hz): smoothed trials and fitted bands have nothing above.
_HIGHEST_HZ = {"trial": 25.0, "block": 60.0}


def plot_fit(recording: Recording, estimate: ImpedanceEstimate) -> Figure:
    """Draw the force of the trials that M, B and K explain best and worst, measured and fitted.

    An offset and a ramp are removed from both, as in the fit: they are the limb's own slow force.
    The trials of a stochastic perturbation are its blocks of one second.

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


def _time_label(shown: FittedForce) -> str:
    return "time from onset (ms)" if shown.unit_name == "trial" else "time in the block (ms)"


def _draw_trial(row: list[Axes], shown: FittedForce, trial: int) -> None:
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
    """Draw the residuals of M, B and K: of each trial over time, and over frequency.

    A direction's mean that differs from zero is not noise but a reflex, friction or a delay. Over
    frequency the residual's amplitude is below the force's if the model explains the force.

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


def _draw_residuals(ax: Axes, shown: FittedForce, i: int) -> None:
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


def _draw_spectra(ax: Axes, shown: FittedForce, i: int) -> None:
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
    # a sine of amplitude 1 has the value 1 in its bin
    transformed = 2 * np.abs(np.fft.rfft(signals * window, axis=1)) / window.sum()
    frequency = np.fft.rfftfreq(signals.shape[1], 1 / rate_hz)
    return np.asarray(frequency), np.asarray(np.sqrt((transformed**2).mean(axis=0)))


# Trials of one group in one picture, with distinct directions and marked outliers.

#: More directions than this are not named.
_MOST_NAMED = 8
#: Legend entries of trials that are marked one by one.
_MARKED = ("left out", "unlike the others")


def plot_trials(
    recording: Recording,
    keys: Mapping[str, Any],
    outliers: Collection[int] | None = None,
) -> Figure:
    """Draw displacement and force of every trial of a group from the onset, axis by axis.

    Colour and line style show the direction: opposite ones share a colour, one of them dashed.

    Parameters
    ----------
    recording : Recording
        Of the hand or of joints.
    keys : mapping
        Columns of the trial table and values of the group, as `ImpedanceEstimate.keys`.
    outliers : collection of int, optional
        Numbers of trials to mark; default: those of `outlying_trials`.

    Returns
    -------
    Figure
        Displacement above force, a column for each axis.

    Raises
    ------
    InputError
        No trial is of that group, or no onset is stated or detected.

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
    """Place directions above the panels, marked trials below; draw lines thick enough."""
    handles, labels = ax.get_legend_handles_labels()
    marked = [label.startswith(_MARKED) for label in labels]
    places: dict[bool, Any] = {False: "outside upper center", True: "outside lower center"}
    for below, place in places.items():
        rows = [row for row, is_marked in enumerate(marked) if is_marked == below]
        if not rows:
            continue
        legend = figure.legend(
            [handles[row] for row in rows],
            [labels[row] for row in rows],
            loc=place,
            ncols=1 if below else min(8, len(rows)),
            handlelength=1.6,
            columnspacing=1.2,
        )
        for line in legend.legend_handles:
            if line is not None:
                thick = np.maximum(1.2, line.get_linewidth())  # type: ignore[attr-defined]
                line.set_linewidth(thick)  # type: ignore[attr-defined]
