"""A body on force plates: the contact wrench that was measured and the one that is predicted."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from armimpedance.body import BodyFit, RowChoice, TrialRows, each_trial
from armimpedance.motion import MotionRecording
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

_ROW_IN = 1.25
_MOST_ROWS = 7
_PRINTED = {
    "fx": "$F_x$",
    "fy": "$F_y$",
    "fz": "$F_z$",
    "mx": "$M_x$",
    "my": "$M_y$",
    "mz": "$M_z$",
}


def plot_row(
    trial: TrialRows, phi: np.ndarray, row: int, name: str, rate_hz: float, ax: Axes | None = None
) -> Axes:
    """Draw one row (a component of the wrench, or a joint's torque): measured and predicted.

    Parameters
    ----------
    trial : TrialRows
    phi : (p,)
        Inertial parameters, then joint terms; a base solution as `BaseParameters.lift` gives it.
    name : str
        With the unit; the axis label.
    """
    time = np.arange(len(trial.w)) / rate_hz
    with print_style():
        ax = new_axes(TWO_COLUMNS_IN, _ROW_IN) if ax is None else ax
        ax.plot(time, trial.w[:, row], color=OKABE_ITO["blue"], lw=1.2, label="measured")
        style = (0, (4, 1.5))
        predicted = trial.W[:, row] @ phi
        ax.plot(time, predicted, color=OKABE_ITO["vermillion"], ls=style, lw=1.2, label="predicted")
        ax.margins(x=0.01)
        label_axes(ax, "time (s)", name)
    return ax


def plot_wrench(
    trial: TrialRows,
    phi: np.ndarray,
    names: Sequence[str],
    rate_hz: float,
    axes: Sequence[Axes] | None = None,
) -> list[Axes]:
    """All rows of a motion, one below the other."""
    drawn = list(axes or _stacked(len(names)))
    for row, (name, ax) in enumerate(zip(names, drawn, strict=True)):
        plot_row(trial, phi, row, name, rate_hz, ax)
        if row + 1 < len(names):
            ax.set_xlabel("")
    drawn[0].set_title(trial.condition.replace("_", " "), loc="left")
    return drawn


def _stacked(rows: int) -> list[Axes]:
    figure = new_figure(TWO_COLUMNS_IN, _ROW_IN * rows)
    with print_style():
        return list(figure.subplots(rows, sharex=True, squeeze=False)[:, 0])


def body_figure(recording: MotionRecording, choice: RowChoice, fit: BodyFit) -> Figure:
    """The held-out motion whose moments vary most; the fitted one if none is held out."""
    judged = fit.fitted if fit.held_out is None else fit.held_out
    moments = [judged.rows.index(row) for row in judged.moments]
    varying = (judged.squares[:, moments].sum(axis=1) / judged.samples).argmax()
    motion = judged.motions[int(varying)]
    trial = next(t for t in each_trial(recording, choice) if t.condition == motion)
    names = row_labels(choice, recording)[:_MOST_ROWS]
    phi = np.asarray(fit.base.lift(fit.values) if fit.phi is None else fit.phi)
    axes = plot_wrench(trial, phi, names, recording.sample_rate_hz)
    with print_style():
        axes[0].legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, borderaxespad=0.2)
    return axes[0].figure  # type: ignore[return-value]


def row_labels(choice: RowChoice, recording: MotionRecording) -> tuple[str, ...]:
    """Name and unit of every row."""
    names, units = choice.row_names(recording.skeleton), choice.row_units(recording.skeleton)
    shown = [_PRINTED.get(n, n.replace("_", " ")) for n in names]
    return tuple(f"{n} ({u})" for n, u in zip(shown, units, strict=True))
