"""Plot of a body on force plates: measured and predicted contact wrench."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import shortened
from armimpedance.core.skeleton import Skeleton
from armimpedance.joint.body.result import BodyFit
from armimpedance.joint.body.rows import RowChoice, each_trial
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

_ROW_IN = 1.25
_MOST_ROWS = 7
#: Longest name of a motion in a title.
_MOST_LETTERS = 40
_PRINTED = {
    "fx": "F_x",
    "fy": "F_y",
    "fz": "F_z",
    "mx": "M_x",
    "my": "M_y",
    "mz": "M_z",
}


def plot_row(
    measured: FloatArray,
    predicted: FloatArray,
    name: str,
    rate_hz: float,
    ax: Axes | None = None,
) -> Axes:
    """Draw one row (a component of the wrench, or a joint's torque): measured and predicted.

    Parameters
    ----------
    measured, predicted : (S,)
        Values, N or N m.
    name : str
        Label of the axis, with the unit.
    rate_hz : float
        Samples per second.
    ax : Axes, optional
        Axes to draw on; by default those of a new figure.

    Returns
    -------
    Axes
    """
    time = np.arange(len(measured)) / rate_hz
    with print_style():
        ax = new_axes(TWO_COLUMNS_IN, _ROW_IN) if ax is None else ax
        ax.plot(time, measured, color=OKABE_ITO["blue"], lw=1.2, label="measured")
        style = (0, (4, 1.5))
        ax.plot(time, predicted, color=OKABE_ITO["vermillion"], ls=style, lw=1.2, label="predicted")
        ax.margins(x=0.01)
        label_axes(ax, "time (s)", name)
    return ax


def body_figure(fit: BodyFit) -> Figure:
    """Draw the measured and predicted rows of a motion, one panel per row.

    The motion is the held-out one whose moments vary most, or a fitted one if none is held out.

    Parameters
    ----------
    fit : BodyFit
        A fit with its recording, from `joint.body.show.body`.

    Returns
    -------
    Figure
        The figure, with a panel for each row of the motion.

    Examples
    --------
    >>> import armimpedance as ai
    >>> from manipulandum_sim.body import simulate_body
    >>> recording, _ = simulate_body(("all_joints",))
    >>> person = ai.body(recording, method="ls", noise_draws=0)
    >>> figure = ai.body_figure(person)
    >>> figure.axes[-1].get_xlabel()
    'time (s)'
    """
    recording, judged = fit.recording, fit.fitted if fit.held_out is None else fit.held_out
    moments = [judged.rows.index(row) for row in judged.moments]
    varying = (judged.squares[:, moments].sum(axis=1) / judged.samples).argmax()
    motion = judged.motions[int(varying)]
    trial = next(t for t in each_trial(recording, fit.rows) if t.condition == motion)
    names = row_labels(fit.rows, recording.skeleton)[:_MOST_ROWS]
    axes = _stacked(len(names))
    for row, (name, ax) in enumerate(zip(names, axes, strict=True)):
        predicted = trial.W[:, row] @ fit.predicting_phi
        plot_row(trial.w[:, row], predicted, name, recording.sample_rate_hz, ax)
        if row + 1 < len(names):
            ax.set_xlabel("")
    title = shortened(motion.replace("_", " "), _MOST_LETTERS)
    axes[0].set_title(title, loc="left", parse_math=False)
    with print_style():
        axes[0].legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, borderaxespad=0.2)
    return axes[0].figure  # type: ignore[return-value]


def _stacked(rows: int) -> list[Axes]:
    figure = new_figure(TWO_COLUMNS_IN, _ROW_IN * rows)
    with print_style():
        return list(figure.subplots(rows, sharex=True, squeeze=False)[:, 0])


def row_labels(choice: RowChoice, skeleton: Skeleton) -> tuple[str, ...]:
    """Name and unit of every row, as an axis shows them.

    Parameters
    ----------
    choice : RowChoice
    skeleton : Skeleton

    Returns
    -------
    tuple of str
    """
    names, units = choice.row_names(skeleton), choice.row_units(skeleton)
    shown = [_PRINTED.get(n, n.replace("_", " ")) for n in names]
    return tuple(f"{n} ({u})" for n, u in zip(shown, units, strict=True))
