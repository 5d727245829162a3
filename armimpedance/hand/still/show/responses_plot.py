"""What a disturbance did to one hand, and what the estimated impedance makes of it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.conventions import AXES, Kind
from armimpedance.core.errors import InputError
from armimpedance.core.records import Response
from armimpedance.show.plots import (
    OKABE_ITO,
    ONE_COLUMN_IN,
    TWO_COLUMNS_IN,
    new_figure,
    print_style,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Row of the figure: field, label, what the unit of the record is multiplied by.
_ROWS: dict[str, tuple[tuple[str, str, float], ...]] = {
    "hand": (
        ("displacement", "displacement\n(mm)", 1e3),
        ("velocity", "velocity\n(m/s)", 1.0),
        ("acceleration", "acceleration\n(m/s²)", 1.0),
        ("force", "force\n(N)", 1.0),
    ),
    "joint": (
        ("displacement", "displacement\n(rad)", 1.0),
        ("velocity", "velocity\n(rad/s)", 1.0),
        ("acceleration", "acceleration\n(rad/s²)", 1.0),
        ("force", "torque\n(N m)", 1.0),
    ),
}


def plot_response(
    response: Response,
    predicted_force: ArrayLike,
    trial_index: int = 0,
    axes: Any = None,
    kind: Kind = "hand",
) -> Any:
    """Draw one trial's displacement, velocity, acceleration and force, as in Tsuji (1997), Fig. 6.

    Measured is solid, the prediction of the force dashed. Columns share their scale, so that the
    axes compare.

    Parameters
    ----------
    response : Response
    predicted_force : (T, S, d) or (S, d)
        Of all trials, or of this one.
    trial_index : int
        Row of the response, from 0.
    axes : (4, d) array of Axes, optional
    kind : {"hand", "joint"}

    Returns
    -------
    axes : (4, d) array of Axes

    Raises
    ------
    InputError
        When there is no such trial, it is not usable, or the prediction has another shape.
    """
    predicted = _of_trial(response, predicted_force, trial_index)
    with print_style():
        grid = _new_grid(response.axes) if axes is None else np.asarray(axes)
        if grid.shape != (4, response.axes):
            raise InputError(f"axes of shape {grid.shape}", expected=f"(4, {response.axes})")
        for row, (field, label, factor) in zip(grid, _ROWS[kind], strict=True):
            signal = factor * getattr(response, field)[trial_index]
            for i, ax in enumerate(row):
                _draw(ax, response, signal[:, i], predicted[:, i] if field == "force" else None)
            row[0].set_ylabel(label)
        for i, ax in enumerate(grid[0]):
            ax.set_title(AXES[i] if kind == "hand" else f"joint {i + 1}")
        for ax in grid[-1]:
            ax.set_xlabel("time from onset (ms)")
        grid[-1, 0].legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, borderaxespad=0.2)
        grid[0, 0].figure.align_ylabels(list(grid[:, 0]))
    return grid


def _of_trial(response: Response, predicted_force: ArrayLike, trial_index: int) -> Any:
    trials, shape = len(response.trial), response.force.shape
    if not 0 <= trial_index < trials:
        raise InputError(f"no trial of index {trial_index}", expected=f"0 to {trials - 1}")
    if not response.usable[trial_index]:
        number = response.trial[trial_index]
        raise InputError(f"trial {number} does not fill the window", expected="a usable trial")
    predicted = np.asarray(predicted_force, dtype=float)
    if predicted.shape not in (shape, shape[1:]):
        problem = f"a predicted force of shape {predicted.shape}"
        raise InputError(problem, expected=f"{shape} or {shape[1:]}")
    return predicted[trial_index] if predicted.ndim == 3 else predicted


def _new_grid(columns: int) -> Any:
    figure = new_figure(TWO_COLUMNS_IN if columns > 1 else ONE_COLUMN_IN, 4.8)
    return figure.subplots(4, columns, sharex=True, sharey="row", squeeze=False)


def _draw(ax: Axes, response: Response, measured: Any, predicted: Any) -> None:
    time_ms = 1e3 * response.lag_s
    ax.axhline(0.0, color="0.8", linewidth=0.6, zorder=0)
    ax.plot(time_ms, measured, color=OKABE_ITO["black"], label="measured")
    if predicted is not None:
        color = OKABE_ITO["vermillion"]
        ax.plot(time_ms, predicted, color=color, linestyle=(0, (4, 2)), label="predicted")
